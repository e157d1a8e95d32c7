"""eigenshape label: the labels of one mesh or several, copied to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import SOME_FAILED, print_json, progress_bar
from eigenshape.cli.inputs import AutoRepairOption, JsonOption, MeshArgument, UpOption, ViewOption

COLUMNS = {
    "part": "part",
    "label": "label",
    "name": "name",
    "confidence": "confidence",
    "area": "area_share",
    "clearest vertex": "vertex",
}


def label(
    mesh: MeshArgument,
    *,
    like: Annotated[
        list[Path] | None,
        typer.Option("--like", help="Mesh whose faces have labels. May be given several times."),
    ] = None,
    labels: Annotated[
        list[Path] | None,
        typer.Option(
            "--labels",
            help=(
                "Labels of the faces of --like, once for each: a text file with one whole number a "
                "line, the JSON of `segment --json`, or the PLY of `segment -o`. By default the "
                "file with the name of the mesh that ends in .seg, .txt or .json, or the labels in "
                "the mesh (PLY)."
            ),
        ),
    ] = None,
    library: Annotated[
        Path | None,
        typer.Option(
            "--library",
            help="Folder of meshes with such files beside them. Its file names.txt, if there is "
            "one, has the name of label 0 in the first line, of label 1 in the second, and so on.",
        ),
    ] = None,
    repair: AutoRepairOption = "auto",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the mesh with its labels, also as colors (PLY), or with a material for each "
            "label (GLB or OBJ), or the label of each face, one a line (SEG or TXT).",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw the best matching labeled mesh and this one (PNG, SVG or PDF)."),
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Copy the labels of one mesh or several to another: label a horse, and get a labeled camel.

    Left and right may be exchanged. All meshes are repaired. A mesh of the library that still cannot
    be described is left out by name, and the exit code is 3.
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_label_path(output)
    examples, names, left_out = steps.read_examples(like or [], labels or [], library, repair)
    target = steps.load_surface(mesh, repair)
    with progress_bar("label") as progress:
        found = es.transfer_labels(list(examples.values()), target, progress=progress)
    rows = steps.label_rows(target, found, names)
    if as_json:
        print_json(
            {
                "path": str(mesh),
                "like": dict(zip(examples, found.weights.tolist(), strict=True)),
                "left_out": left_out,
                "parts": rows,
                "face_labels": found.labels,
                "face_confidence": found.confidence,
            }
        )
    else:
        columns = {key: value for key, value in COLUMNS.items() if names or key != "name"}
        steps.print_rows("Labels", columns, rows)
    if output:
        colors = steps.label_colors(target, found.labels, list(examples.values()))
        steps.save_labels(mesh, target, found.labels, colors, output)
    if picture:
        best = list(examples.values())[int(found.weights.argmax())]
        figure = es.plot.figure_label_transfer(best, target, found, names=names, **side)
        steps.save_picture(figure, picture)
    if left_out:
        raise typer.Exit(SOME_FAILED)
