"""eigenshape report: a shape in one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from eigenshape._studio import studio_module
from eigenshape.cli import steps
from eigenshape.cli.console import print_written, progress_bar
from eigenshape.cli.inputs import MeshArgument, RepairOption, UpOption, ViewOption


def report(
    mesh: MeshArgument,
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="HTML file to write; it opens without a server.")
    ],
    n_modes: Annotated[
        int,
        typer.Option("-n", "--n-modes", min=1, max=200, help="Number of eigenfunctions in it."),
    ] = 20,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    repair: RepairOption = "",
) -> None:
    """Write a shape with its spectrum, heat and parts to one HTML file that any browser opens.

    Needs the package eigenshape-studio.

    For instance: eigenshape report scan.ply -o scan.html
    """
    steps.require_output(output, (".html",), "A report")
    side = steps.parse_side(view, up)
    writer = studio_module("report")
    surface = steps.load_mesh(mesh, repair)
    with progress_bar("report") as progress:
        writer.write_report(
            surface, output, name=mesh.name, n_modes=n_modes, **side, progress=progress
        )
    print_written(output)
