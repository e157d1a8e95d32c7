"""eigenshape repair: a mesh repaired, or converted, and written."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, print_repairs, print_table, print_written
from eigenshape.cli.inputs import MESHES_TO_WRITE, CellsOption, JsonOption, MeshArgument
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS

USUAL = "auto"
ROWS = (
    "vertices", "faces", "points", "simplices", "components", "boundary_loops", "boundary_points", "closed",
    "faces_without_area", "without_volume", "duplicate_faces", "duplicates", "loose_vertices", "loose_points",
    "coinciding_vertices", "non_manifold_edges", "turned_over_edges",
)  # fmt: skip


def repair(
    mesh: MeshArgument,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help=f"Mesh to write: {MESHES_TO_WRITE}; for tetrahedra .vtu.",
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

    Hexahedra, wedges and pyramids are split into tetrahedra.

    For instance: eigenshape repair scan.ply --repair auto -o clean.ply
    """
    steps.require_mesh_path(output)
    before, done = steps.load_repaired(mesh, names, cells)
    if not isinstance(done.mesh, es.TriangleMesh):
        steps.require_output(output, (".vtu",), "A mesh of tetrahedra or segments")
    print_repairs(done.report)
    facts = {"before": steps.shape_facts(before), "after": steps.shape_facts(done.mesh)}
    if isinstance(done.mesh, es.TriangleMesh):
        steps.save_like(mesh, done.mesh, output)
    else:
        es.io.write_fields(done.mesh, output, {})
        print_written(output)
    if as_json:
        print_json({"path": str(mesh), "output": str(output), "report": list(done.report), **facts})
        return
    rows = [
        [name.replace("_", " "), *(_format(fact[name]) for fact in facts.values())]
        for name in ROWS
        if name in facts["before"]
    ]
    print_table("Repaired", ["", *facts], rows)


def _format(value: bool | int) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}"
