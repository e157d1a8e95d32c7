"""eigenshape studio, serve and report: what the package eigenshape-studio shows in a browser."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._extras import import_extra
from eigenshape.cli import steps
from eigenshape.cli.console import print_address, print_written, progress_bar
from eigenshape.cli.inputs import SEAMS, memory_bytes


def studio(
    shapes: Annotated[list[Path] | None, typer.Argument()] = None,
    *,
    index: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    host: str = "127.0.0.1",
    port: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    browser: bool = True,
    allow_remote: bool = False,
) -> None:
    """Open a window in the browser: bend a shape by hand, see its spectrum, heat and parts, and search.

    Needs the package eigenshape-studio. Ctrl-C ends it.

    For instance: eigenshape studio scan.ply --index my-index

    Parameters
    ----------
    shapes
        Files, folders of files, an index, or the folder of a collection. The first shape is shown,
        and the others stand in a list; two stand side by side. By default a synthetic creature.
    index
        Folder of an index to search in.
    port
        Port to listen on; 0 takes any that is free. By default 8642 if it is free, so that open
        pages go on when the studio is started again.
    browser
        Open the address in a browser.
    allow_remote
        Let other machines in. Whoever has the address controls the studio, and nothing is
        encrypted.
    """
    side = steps.picture_side(view, up)
    server = import_extra("eigenshape_studio.server", "eigenshape-studio")

    server.serve(
        shapes or (),
        index=index,
        **side,
        host=host,
        port=port,
        allow_remote=allow_remote,
        announce=partial(print_address, "studio"),
        browse=browser,
    )


def serve(
    index: Path,
    *,
    host: str = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535)] = 8000,
    allow_remote: bool = False,
    allow_host: list[str] | None = None,
    token: Annotated[str | None, typer.Option(envvar="EIGENSHAPE_TOKEN")] = None,
    write_token: Annotated[str | None, typer.Option(envvar="EIGENSHAPE_WRITE_TOKEN")] = None,
    workers: Annotated[int, typer.Option(min=1)] = 2,
    timeout: Annotated[float, typer.Option(min=1)] = 60.0,
    memory: Annotated[float | None, typer.Option(min=0.5)] = None,
    show_sources: bool = False,
    prefix: str = "",
    browser: bool = False,
) -> None:
    """Serve an index: upload a scan, by a page or a program, and get the most similar shapes.

    Needs the package eigenshape-studio. Programs send the header `Authorization: Bearer TOKEN`; the
    address /docs lists the calls. Ctrl-C or SIGTERM ends the service when the queries that run have
    ended.

    For instance: eigenshape serve my-index

    Parameters
    ----------
    port
        Port to listen on; 0 takes any that is free.
    allow_remote
        Let other machines in, if they have the token. Nothing is encrypted.
    allow_host : NAME[:PORT]
        Answer to this name, too, as clients send it; may be given several times. Names of this
        machine are known.
    token
        Secret that requests must bring, at least 16 letters; other users of the machine can read
        options, but not the environment variable. By default a random one is printed.
    write_token
        Another secret, with which programs may also add and remove shapes. Without it the service
        only reads.
    workers
        Number of processes that describe uploaded meshes.
    timeout
        Seconds after which an uploaded mesh is given up.
    memory
        Gigabytes that a process may use; a mesh that needs more is refused. By default each
        process has an equal share of the machine's memory.
    show_sources
        Name the files of shapes in answers.
    prefix : PATH
        Path below which a proxy offers the service, such as /shapes, whether the proxy passes it on
        or leaves it out.
    browser
        Open the address in a browser.
    """
    server = import_extra("eigenshape_studio.service.server", "eigenshape-studio")

    server.serve(
        index,
        host=host,
        port=port,
        allow_remote=allow_remote,
        allow_hosts=allow_host or (),
        token=token,
        write_token=write_token,
        workers=es.retrieval.Workers(workers, timeout, memory_bytes(memory)),
        show_sources=show_sources,
        prefix=prefix,
        announce=partial(print_address, "service"),
        browse=browser,
    )


def report(
    mesh: Path,
    *,
    output: Path,
    n_modes: Annotated[int, typer.Option(min=1, max=200)] = 20,
    view: str = "auto",
    up: str = "auto",
    repair: str = SEAMS,
) -> None:
    """Write a shape with its spectrum, heat and parts to one HTML file that any browser opens.

    Needs the package eigenshape-studio.

    For instance: eigenshape report scan.ply -o scan.html

    Parameters
    ----------
    output
        Write the page (HTML), which any browser opens without a server.
    n_modes
        Number of eigenfunctions to write.
    """
    steps.require_output(output, (".html",), "A report")
    side = steps.picture_side(view, up, shapes=[mesh])
    writer = import_extra("eigenshape_studio.report", "eigenshape-studio")
    surface = steps.load_surface(mesh, repair)
    with progress_bar("report") as progress:
        writer.write_report(
            surface, output, name=mesh.name, n_modes=n_modes, **side, progress=progress
        )
    print_written(output)
