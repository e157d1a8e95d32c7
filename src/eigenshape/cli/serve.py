"""eigenshape serve: a search service on an index, for programs and for the browser."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._studio import studio_module
from eigenshape.cli.console import print_address
from eigenshape.cli.inputs import memory_bytes


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
    browser
        Open the address in a browser.
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
