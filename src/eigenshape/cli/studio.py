"""eigenshape studio: a window in the browser."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from eigenshape._studio import studio_module
from eigenshape.cli import steps
from eigenshape.cli.console import print_address


def studio(
    mesh: Path | None = None,
    *,
    index: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    host: str = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535)] = 0,
    browser: bool = True,
    allow_remote: bool = False,
) -> None:
    """Open a window in the browser: bend a shape by hand, see its spectrum, heat and parts, and search.

    Needs the package eigenshape-studio. Ctrl-C ends it.

    For instance: eigenshape studio scan.ply --index my-index

    Parameters
    ----------
    mesh
        Mesh file to open. By default a synthetic creature.
    index
        Folder of an index to search in.
    port
        Port to listen on; 0 takes any that is free.
    browser
        Open the address in a browser.
    allow_remote
        Let other machines in. Whoever has the address controls the studio, and nothing is
        encrypted.
    """
    side = steps.picture_side(view, up)
    server = studio_module("server")

    server.serve(
        mesh,
        index=index,
        **side,
        host=host,
        port=port,
        allow_remote=allow_remote,
        announce=partial(print_address, "studio"),
        browse=browser,
    )
