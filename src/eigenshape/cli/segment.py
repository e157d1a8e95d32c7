"""eigenshape segment: the parts of a shape."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated, Literal

import typer

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import SEAMS, HeatMethod, require_one_rule
from eigenshape.features.contrast import contrast_at

COLUMNS = {
    "part": "part",
    "feature point": "vertex",
    "area": "area_share",
    "faces": "faces",
    "splits from": "splits_from",
    "persistence": "persistence",
}


def segment(
    mesh: Path,
    *,
    method: Literal["parts", HeatMethod] = "parts",
    n_parts: Annotated[int | None, typer.Option(min=1)] = None,
    persistence: float | None = None,
    level: float | None = None,
    largest_gap: bool = False,
    smooth: Annotated[bool | None, typer.Option("--smooth/--no-smooth")] = None,
    repair: str = SEAMS,
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Cut a mesh into its parts: limbs, head, torso.

    Parameters
    ----------
    method
        parts finds limbs, head and torso: regions between which little heat flows. scale-free and
        thesis cut around the maxima of heat, as `features` does.
    n_parts
        Largest number of parts.
    persistence
        Keep parts of at least this persistence. For --method parts it lies from 0 to 1 and is 0.3
        by default; otherwise it is in units of heat.
    level
        From coarse to fine, for --method parts: 0 is the default, 1 halves the least persistence
        of a part, -1 doubles it.
    largest_gap
        Keep the parts before the largest drop of persistence.
    smooth
        Move the boundaries of parts to short cuts along creases. By default only for --method
        parts.
    output
        Write the parts of the mesh, as colors and labels (PLY), as materials (GLB or OBJ), or one
        number for each face, one a line (SEG or TXT).
    picture
        Draw the parts (PNG, SVG or PDF).
    """
    require_one_rule(
        {
            "--n-parts": n_parts is not None,
            "--persistence": persistence is not None,
            "--largest-gap": largest_gap,
            "--level": level is not None,
        }
    )
    if level is not None:
        if method != "parts":
            raise InvalidParameterError(
                f"--level is for --method parts; the method is {method}. Use --n-parts."
            )
        if not isfinite(level):
            raise InvalidParameterError(f"--level must be finite; it is {level}.")
        persistence = contrast_at(level)
    side = steps.picture_side(view, up, picture, shapes=[mesh])
    steps.require_mesh_path(output, "labels")
    surface = steps.load_surface(mesh, repair)
    with progress_bar("parts") as progress:
        tree, usual, smooth_parts = steps.find_tree(surface, method, progress)
    rule = {"n_regions": n_parts, "persistence": persistence, "largest_gap": largest_gap}
    is_given = n_parts is not None or persistence is not None or largest_gap
    parts = es.segment(tree, **(rule if is_given else usual))
    if smooth if smooth is not None else method == "parts":
        parts = smooth_parts(parts)
    rows = []
    into = es.features.merge_targets(tree)
    for number, row in enumerate(steps.part_rows(surface, parts)):
        n_faces = int((parts.labels == number).sum())
        splits_from = int(into[number]) if into[number] >= 0 else None
        rows.append({"part": number, **row, "faces": n_faces, "splits_from": splits_from})
    if as_json:
        print_json({"path": mesh, "method": method, "parts": rows, "face_labels": parts.labels})
    else:
        steps.print_rows("Parts", COLUMNS, rows)
    if output:
        colors = es.plot.part_colors(surface, parts.labels)
        steps.save_labels(mesh, surface, parts.labels, colors, output)
    if picture:
        figure = es.plot.figure_segments(surface, parts.labels, parts.features.vertices, **side)
        steps.save_picture(figure, picture)
