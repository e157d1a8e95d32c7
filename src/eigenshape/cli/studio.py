"""eigenshape studio: a window in the browser."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from eigenshape._studio import studio_module
from eigenshape.cli import steps
from eigenshape.cli.console import print_address
from eigenshape.cli.inputs import HostOption, UpOption, ViewOption


def studio(
    mesh: Annotated[
        Path | None,
        typer.Argument(help="Mesh file to open. By default a synthetic creature."),
    ] = None,
    *,
    shelf: Annotated[
        Path | None,
        typer.Option("--index", help="Folder of an index to search in, as `index` writes it."),
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    host: HostOption = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes any that is free.")
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the address in a browser.")
    ] = True,
    allow_remote: Annotated[
        bool,
        typer.Option(
            "--allow-remote",
            help="Let other machines in. Whoever has the address controls the studio, and nothing is "
            "encrypted.",
        ),
    ] = False,
) -> None:
    """Open a window in the browser: bend a shape by hand, see its spectrum, heat and parts, and search.

    Needs the package eigenshape-studio. Ctrl-C ends it.

    For instance: eigenshape studio scan.ply --index my-index
    """
    side = steps.parse_side(view, up)
    server = studio_module("server")

    server.serve(
        mesh,
        index=shelf,
        **side,
        host=host,
        port=port,
        allow_remote=allow_remote,
        announce=partial(print_address, "studio"),
        browse=browser,
    )
