"""eigenshape serve: a search service on an index, for programs and for the browser."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._studio import studio_module
from eigenshape.cli.console import print_address
from eigenshape.cli.inputs import HostOption, memory_bytes


def serve(
    index: Annotated[Path, typer.Argument(help="Folder of the index.")],
    *,
    host: HostOption = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes any that is free.")
    ] = 8000,
    allow_remote: Annotated[
        bool,
        typer.Option(
            "--allow-remote",
            help="Let other machines in, if they have the token. Nothing is encrypted.",
        ),
    ] = False,
    allow_host: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[:PORT]",
            help="Answer to this name, too, as clients send it; may be repeated. Names of this "
            "machine are known.",
        ),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            envvar="EIGENSHAPE_TOKEN",
            help="Secret that requests must bring, at least 16 letters; other users of the machine "
            "can read options, but not the environment variable. By default a random one is printed.",
        ),
    ] = None,
    write_token: Annotated[
        str | None,
        typer.Option(
            envvar="EIGENSHAPE_WRITE_TOKEN",
            help="Another secret, with which programs may also add and remove shapes. Without it "
            "the service only reads.",
        ),
    ] = None,
    workers: Annotated[
        int, typer.Option(min=1, help="Number of processes that describe uploaded meshes.")
    ] = 2,
    timeout: Annotated[
        float, typer.Option(min=1, help="Seconds after which an uploaded mesh is given up.")
    ] = 60.0,
    memory: Annotated[
        float | None,
        typer.Option(
            min=0.5,
            help="Gigabytes that a process may use; a mesh that needs more is refused. By default "
            "each process has an equal share of the machine's memory.",
        ),
    ] = None,
    show_sources: Annotated[
        bool, typer.Option("--show-sources", help="Name the files of shapes in answers.")
    ] = False,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the address in a browser.")
    ] = False,
) -> None:
    """Serve an index: upload a scan, by a page or a program, and get the most similar shapes.

    Needs the package eigenshape-studio. Programs send the header `Authorization: Bearer TOKEN`; the
    address /docs lists the calls. Ctrl-C or SIGTERM ends the service when the queries that run have
    ended.

    For instance: eigenshape serve my-index
    """
    server = studio_module("service.server")

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
        announce=partial(print_address, "service"),
        browse=browser,
    )
