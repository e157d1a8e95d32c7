"""eigenshape report: a shape in one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from eigenshape._studio import studio_module
from eigenshape.cli import steps
from eigenshape.cli.console import print_written, progress_bar


def report(
    mesh: Path,
    *,
    output: Path,
    n_modes: Annotated[int, typer.Option(min=1, max=200)] = 20,
    view: str = "auto",
    up: str = "auto",
    repair: str = "none",
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
    side = steps.picture_side(view, up)
    writer = studio_module("report")
    surface = steps.load_mesh(mesh, repair)
    with progress_bar("report") as progress:
        writer.write_report(
            surface, output, name=mesh.name, n_modes=n_modes, **side, progress=progress
        )
    print_written(output)
