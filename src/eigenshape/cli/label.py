"""eigenshape label: the labels of one mesh, copied to the parts of another."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, load_mesh
from eigenshape.cli.outputs import require_picture, save_picture
from eigenshape.cli.parts import part_rows, print_rows, require_label_path, save_labels
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.labels import read_labels
from eigenshape.io.mesh_files import read_mesh
from eigenshape.plot.fields import part_colors
from eigenshape.plot.sheet import figure_label_transfer
from eigenshape.retrieval.label_transfer import LabelTransfer, transfer_labels

COLUMNS = {
    "part": "part",
    "label": "label",
    "confidence": "confidence",
    "feature point": "vertex",
    "area": "area_share",
    "like part": "like_part",
}


def label(
    mesh: MeshArgument,
    *,
    like: Annotated[Path, typer.Option("--like", help="Mesh whose faces have labels.")],
    labels: Annotated[
        Path,
        typer.Option(
            "--labels",
            help=(
                "Labels of the faces of --like: a text file with one whole number a line, the "
                "JSON of `segment --json`, or the PLY of `segment -o`."
            ),
        ),
    ],
    n_parts: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--n-parts",
            help="Largest number of parts to cut each mesh into. By default as many as are found.",
        ),
    ] = None,
    repair: RepairOption = "",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the mesh with its labels, also as colors (PLY), or the label of each face, "
            "one a line (SEG or TXT).",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw both meshes side by side (PNG, SVG or PDF).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Copy the labels of one mesh to the matching parts of another: label a horse, and get a labelled camel.

    Left and right may be exchanged. Repairs are applied to the mesh that gets the labels.
    """
    require_picture(picture)
    require_label_path(output)
    given = read_labels(labels)
    source, target = read_mesh(like), load_mesh(mesh, repair)
    with progress_bar("label") as progress:
        found = transfer_labels(source, given, target, n_parts=n_parts, progress=progress)
    rows = _rows(target, found)
    if as_json:
        print_json(
            {"path": str(mesh), "like": str(like), "parts": rows, "face_labels": found.labels}
        )
    else:
        print_rows("Labels", COLUMNS, rows)
    if output:
        colors = part_colors(target, np.searchsorted(np.unique(given), found.labels))
        save_labels(target, found.labels, colors, output)
    if picture:
        save_picture(figure_label_transfer(source, target, found), picture)


def _rows(target: TriangleMesh, found: LabelTransfer) -> list[dict[str, Any]]:
    return [
        {
            "part": number,
            **row,
            "label": int(found.part_labels[number]),
            "confidence": float(found.confidence[number]),
            "like_part": int(found.matches[number]),
        }
        for number, row in enumerate(part_rows(target, found.target))
    ]
