"""eigenshape label: the labels of one mesh or several, copied to another."""

from __future__ import annotations

from pathlib import Path

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import SOME_FAILED, escape_text, out, print_json, progress_bar

COLUMNS = {
    "part": "part",
    "label": "label",
    "name": "name",
    "confidence": "confidence",
    "area": "area_share",
    "clearest vertex": "vertex",
}


def label(
    mesh: Path,
    *,
    like: list[Path] | None = None,
    labels: list[Path] | None = None,
    library: Path | None = None,
    repair: str = "auto",
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Copy the labels of one mesh or several to another: label a horse, and get a labeled camel.

    Left and right may be exchanged. All meshes are repaired. A mesh of the library that still cannot
    be described is left out by name, and the exit code is 3.

    Parameters
    ----------
    like
        Mesh whose faces have labels; may be given several times.
    labels
        Labels of the faces of --like, once for each: a text file with one whole number a line,
        the JSON of `segment --json`, or the PLY of `segment -o`. By default the file with the
        name of the mesh that ends in .seg, .txt or .json, or the labels in the mesh (PLY).
    library
        Folder of meshes with such files beside them. Its file names.txt, if there is one, has the
        name of label 0 in the first line, of label 1 in the second, and so on.
    output
        Write the labels of the mesh, as colors and labels (PLY), as materials (GLB or OBJ), or
        one number for each face, one a line (SEG or TXT).
    picture
        Draw the best matching labeled mesh and this one (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture, shapes=[mesh])
    steps.require_mesh_path(output, "labels")
    examples, left_out = steps.read_examples(like or [], labels or [], library, repair)
    names = es.io.read_label_names(library) if library else []
    target = steps.load_surface(mesh, repair)
    with progress_bar("label") as progress:
        found = es.transfer_labels(list(examples.values()), target, progress=progress)
    rows = []
    area_shares = steps.area_shares(target, found.parts)
    for number, part_label in enumerate(found.part_labels.tolist()):
        vertex = int(found.part_vertices[number])
        row = {
            "part": number,
            "label": part_label,
            "name": names[part_label] if 0 <= part_label < len(names) else "",
            "confidence": float(found.part_confidence[number]),
            "area_share": area_shares[number],
            "vertex": vertex,
            "position": target.vertices[vertex].tolist(),
        }
        rows.append(row)
    if as_json:
        print_json(
            {
                "path": mesh,
                "like": dict(zip(examples, found.weights.tolist(), strict=True)),
                "mirrored": dict(zip(examples, found.mirrored, strict=True)),
                "left_out": left_out,
                "parts": rows,
                "face_labels": found.labels,
                "face_confidence": found.confidence,
            }
        )
    else:
        columns = {key: value for key, value in COLUMNS.items() if names or key != "name"}
        steps.print_rows("Labels", columns, rows)
        images = [name for name, is_image in zip(examples, found.mirrored, strict=True) if is_image]
        if images:
            out.print(escape_text(f"mirror images of this shape: {', '.join(images)}"))
    if output:
        # A label has the same color whichever labels of the examples occur on the mesh.
        every = sorted({each for shape in examples.values() for each in shape.labels.tolist()})
        numbers = {each: number for number, each in enumerate(every)}
        colors = es.plot.part_colors(target, [numbers[each] for each in found.labels.tolist()])
        steps.save_labels(mesh, target, found.labels, colors, output)
    if picture:
        best = list(examples.values())[int(found.weights.argmax())]
        figure = es.plot.figure_label_transfer(best, target, found, names=names, **side)
        steps.save_picture(figure, picture)
    if left_out:
        raise typer.Exit(SOME_FAILED)
