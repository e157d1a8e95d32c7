"""eigenshape decimate: the same surface by fewer faces."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import eigenshape as es
from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json, print_repairs, print_written
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, repair_names
from eigenshape.geometry.decimation import place_on
from eigenshape.io.ply import parse_colors, parse_labels
from eigenshape.io.surfaces import read_surface


def decimate(
    mesh: MeshArgument,
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Mesh to write: OFF, OBJ, PLY, STL or GLB.")
    ],
    faces: Annotated[int | None, typer.Option(help="Number of faces to keep.")] = None,
    ratio: Annotated[
        float | None,
        typer.Option(help="Instead of --faces: the share of faces to keep, between 0 and 1."),
    ] = None,
    repair: RepairOption = "",
    as_json: JsonOption = False,
) -> None:
    """Write a mesh with fewer faces and the same topology, by collapsing edges.

    For instance: eigenshape decimate scan.ply --ratio 0.1 -o small.ply
    """
    steps.require_mesh_path(output)
    if (faces is None) == (ratio is None):
        raise InvalidParameterError(
            "The number of faces must be given by one of --faces and --ratio."
        )
    made = read_surface(mesh)
    repaired = es.repair(made.mesh, repair_names(repair))
    print_repairs(made.report + repaired.report)
    done = es.geometry.decimate(repaired.mesh, faces, ratio=ratio)
    carried = {}
    if mesh.suffix.lower() == output.suffix.lower() == ".ply":
        carried = _carried(mesh, place_on(made.mesh, done.mesh, done.report))
    es.write_mesh(done.mesh, output, **carried)
    if as_json:
        facts = {"n_vertices": done.mesh.n_vertices, "n_faces": done.mesh.n_faces}
        print_json({"path": str(mesh), "output": str(output), "report": done.report, **facts})
    else:
        for sentence in done.report:
            out.print(escape_text(sentence))
    print_written(output)


def _carried(path: Path, done: es.geometry.DecimatedMesh) -> dict[str, Any]:
    """Carry the colors of vertices and the labels of faces of a PLY file, as far as it has them."""
    data = path.read_bytes()
    carried: dict[str, Any] = {}
    colors = parse_colors(data)
    if colors is not None and len(colors) == done.original.n_vertices:
        carried["colors"] = np.rint(done.carry_values(colors.astype(float))).astype(np.uint8)
    with suppress(FileFormatError):  # faces without labels
        carried["face_labels"] = done.carry_labels(parse_labels(data))
    return carried
