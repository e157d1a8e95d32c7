"""eigenshape segment: the parts of a shape."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, load_mesh
from eigenshape.cli.outputs import require_picture, save_picture
from eigenshape.cli.parts import part_rows, print_rows, require_label_path, save_labels
from eigenshape.features import segmentation
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.parts import PART_CONTRAST, find_parts
from eigenshape.features.segmentation import Segmentation, Tree, merge_targets
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.plot.fields import figure_segments, part_colors
from eigenshape.retrieval.heat.descriptor import PRESETS
from eigenshape.retrieval.heat.features import find_heat_features

PARTS = "parts"
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
        int | None, typer.Option("-n", "--n-parts", help="Largest number of parts.")
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
            help="Write the mesh with its parts as colors and labels (PLY), or the number of the "
            "part of each face, one a line (SEG or TXT).",
        ),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the parts (PNG, SVG or PDF).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Cut a mesh into its parts: limbs, head, torso."""
    if method not in METHODS:
        raise InvalidParameterError(f"--method takes {', '.join(METHODS)}; it is {method!r}.")
    require_picture(picture)
    require_label_path(output)
    surface = load_mesh(mesh, repair)
    with progress_bar("parts") as progress:
        tree, usual = _tree(surface, method, progress)
    rule = {"n_regions": n_parts, "persistence": persistence, "largest_gap": largest_gap}
    chosen = n_parts is not None or persistence is not None or largest_gap
    parts = segmentation.segment(tree, **(rule if chosen else usual))
    if smooth if smooth is not None else method == PARTS:
        parts = smooth_boundaries(orient_closed_outward(surface), parts)
    rows = _rows(surface, tree, parts)
    if as_json:
        print_json(
            {"path": str(mesh), "method": method, "parts": rows, "face_labels": parts.labels}
        )
    else:
        print_rows("Parts", COLUMNS, rows)
    if output:
        save_labels(surface, parts.labels, part_colors(surface, parts.labels), output)
    if picture:
        save_picture(figure_segments(surface, parts.labels, parts.features.vertices), picture)


def _tree(surface: TriangleMesh, method: str, progress: Progress) -> tuple[Tree, dict[str, Any]]:
    """Return the tree of a method, and its default cut. Fragments are not counted as parts."""
    if method == PARTS:
        return find_parts(surface, progress=progress).tree, {"persistence": PART_CONTRAST}
    shape = find_heat_features(surface, PRESETS[method], progress=progress)
    n_fragments = int(np.isin(shape.tree.maxima, shape.fragments).sum())
    return shape.tree, {"n_regions": PRESETS[method].n_features + n_fragments}


def _rows(surface: TriangleMesh, tree: Tree, parts: Segmentation) -> list[dict[str, Any]]:
    faces, into = np.bincount(parts.labels), merge_targets(tree)
    return [
        {
            "part": number,
            **row,
            "faces": int(faces[number]),
            "splits_from": int(into[number]) if into[number] >= 0 else None,
        }
        for number, row in enumerate(part_rows(surface, parts))
    ]
