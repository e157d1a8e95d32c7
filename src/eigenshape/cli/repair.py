"""eigenshape repair: a mesh repaired, or converted, and written."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import err, escape_text, print_json, print_table
from eigenshape.cli.inputs import CellsOption, JsonOption, MeshArgument, repair_names
from eigenshape.geometry.repair_names import MESH_REPAIRS

USUAL = "auto"
ROWS = (
    "vertices", "faces", "components", "boundary_loops", "closed", "faces_without_area", "duplicate_faces",
    "loose_vertices", "coinciding_vertices", "non_manifold_edges", "turned_over_edges",
)  # fmt: skip


def repair(
    mesh: MeshArgument,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="Mesh to write: OFF, OBJ, PLY, STL, GLB, VTU, VTK or NPZ."
        ),
    ],
    names: Annotated[
        str,
        typer.Option(
            "--repair",
            metavar="NAMES",
            help=(
                f"Repairs to apply in this order, separated by commas: {', '.join(MESH_REPAIRS)}. "
                "'' only converts the file."
            ),
        ),
    ] = USUAL,
    cells: CellsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Repair a mesh and write it, and report what was done. All else that the file holds stays, or is named.

    For instance: eigenshape repair scan.ply --repair auto -o clean.ply
    """
    steps.require_mesh_path(output)
    chosen = repair_names(names)
    before = es.read_mesh(mesh, cells=cells)
    done = es.repair(before, chosen)
    for line in done.report:
        err.print(f"[yellow]repair:[/] {escape_text(line)}")
    facts = {"before": steps.mesh_facts(before), "after": steps.mesh_facts(done.mesh)}
    steps.save_like(mesh, done.mesh, output)
    if as_json:
        print_json({"path": str(mesh), "output": str(output), "report": list(done.report), **facts})
        return
    rows = [
        [name.replace("_", " "), *(_format(fact[name]) for fact in facts.values())] for name in ROWS
    ]
    print_table("Repaired", ["", *facts], rows)


def _format(value: bool | int) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}"
