"""eigenshape label: the labels of one mesh, copied to the parts of another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, UpOption, ViewOption

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
            min=1,
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
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Copy the labels of one mesh to the matching parts of another: label a horse, and get a labeled camel.

    Left and right may be exchanged. Repairs are applied to the mesh that gets the labels.
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_label_path(output)
    source, given = steps.read_labeled_mesh(like, labels)
    target = steps.load_mesh(mesh, repair)
    with progress_bar("label") as progress:
        found = es.transfer_labels(source, given, target, n_parts=n_parts, progress=progress)
    rows = _rows(target, found)
    if as_json:
        print_json(
            {"path": str(mesh), "like": str(like), "parts": rows, "face_labels": found.labels}
        )
    else:
        steps.print_rows("Labels", COLUMNS, rows)
    if output:
        colors = steps.label_colors(target, found.labels, given)
        steps.save_labels(target, found.labels, colors, output)
    if picture:
        figure = es.plot.figure_label_transfer(source, target, found, **side)
        steps.save_picture(figure, picture)


def _rows(target: es.TriangleMesh, found: es.retrieval.LabelTransfer) -> list[dict[str, Any]]:
    return [
        {
            "part": number,
            **row,
            "label": int(found.part_labels[number]),
            "confidence": float(found.confidence[number]),
            "like_part": int(found.matches[number]),
        }
        for number, row in enumerate(steps.part_rows(target, found.target))
    ]
