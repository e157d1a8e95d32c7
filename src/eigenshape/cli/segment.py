"""eigenshape segment: the parts of a shape."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import (
    PARTS,
    JsonOption,
    MeshArgument,
    RepairOption,
    UpOption,
    ViewOption,
    require_level,
    require_one_rule,
)
from eigenshape.features.contrast import PART_CONTRAST, contrast_at
from eigenshape.retrieval.heat.recipe import PRESETS

METHODS = (PARTS, *PRESETS)
COLUMNS = {
    "part": "part",
    "feature point": "vertex",
    "area": "area_share",
    "faces": "faces",
    "splits from": "splits_from",
    "persistence": "persistence",
}


def segment(
    mesh: MeshArgument,
    *,
    method: Annotated[
        str,
        typer.Option(
            help=(
                f"{PARTS} finds limbs, head and torso: regions between which little heat flows. "
                f"{' and '.join(PRESETS)} cut around the maxima of heat, as `features` does."
            )
        ),
    ] = PARTS,
    n_parts: Annotated[
        int | None, typer.Option("-n", "--n-parts", min=1, help="Largest number of parts.")
    ] = None,
    persistence: Annotated[
        float | None,
        typer.Option(
            help=(
                f"Keep parts of at least this persistence. For --method {PARTS} it lies from 0 to 1 "
                f"and is {PART_CONTRAST} by default; otherwise it is in units of heat."
            )
        ),
    ] = None,
    level: Annotated[
        float | None,
        typer.Option(
            help=f"From coarse to fine, for --method {PARTS}: 0 is the default, 1 halves the least "
            "persistence of a part, -1 doubles it."
        ),
    ] = None,
    largest_gap: Annotated[
        bool,
        typer.Option(
            "--largest-gap", help="Keep the parts before the largest drop of persistence."
        ),
    ] = False,
    smooth: Annotated[
        bool | None,
        typer.Option(
            "--smooth/--no-smooth",
            help=f"Move the boundaries of parts to short cuts along creases. By default only for "
            f"--method {PARTS}.",
        ),
    ] = None,
    repair: RepairOption = "",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the mesh with its parts as colors and labels (PLY) or as materials (GLB or "
            "OBJ), or the number of the part of each face, one a line (SEG or TXT).",
        ),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the parts (PNG, SVG or PDF).")] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Cut a mesh into its parts: limbs, head, torso."""
    if method not in METHODS:
        raise InvalidParameterError(f"--method takes {', '.join(METHODS)}; it is {method!r}.")
    if level is not None:
        require_level(level, method, n_parts, persistence, largest_gap=largest_gap)
        persistence = contrast_at(level)
    require_one_rule(n_parts, persistence, largest_gap=largest_gap)
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_label_path(output)
    surface = steps.load_mesh(mesh, repair)
    with progress_bar("parts") as progress:
        tree, usual, smooth_parts = steps.find_tree(surface, method, progress)
    rule = {"n_regions": n_parts, "persistence": persistence, "largest_gap": largest_gap}
    chosen = n_parts is not None or persistence is not None or largest_gap
    parts = es.segment(tree, **(rule if chosen else usual))
    if smooth if smooth is not None else method == PARTS:
        parts = smooth_parts(parts)
    rows = steps.segment_rows(surface, tree, parts)
    if as_json:
        print_json(
            {"path": str(mesh), "method": method, "parts": rows, "face_labels": parts.labels}
        )
    else:
        steps.print_rows("Parts", COLUMNS, rows)
    if output:
        steps.save_labels(
            mesh, surface, parts.labels, es.plot.part_colors(surface, parts.labels), output
        )
    if picture:
        figure = es.plot.figure_segments(surface, parts.labels, parts.features.vertices, **side)
        steps.save_picture(figure, picture)
