"""eigenshape segment: the parts of a shape."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import (
    JsonOption,
    MeshArgument,
    RepairOption,
    load_mesh,
    print_json,
    progress_bar,
    save_picture,
)
from eigenshape.cli.parts import part_rows, print_rows, require_paths, save_colors
from eigenshape.features import segmentation
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.parts import PART_CONTRAST, facing_outward, find_parts
from eigenshape.features.segmentation import Segmentation, Tree, merge_targets
from eigenshape.figures.fields import figure_segments, part_colors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.describe import describe_mesh
from eigenshape.retrieval.descriptor import PRESETS
from eigenshape.spectral.outcome import Progress

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
            help=f"{PARTS}: rooms between which heat flows badly; {', '.join(PRESETS)}: regions of that recipe's heat."
        ),
    ] = PARTS,
    n_regions: Annotated[int | None, typer.Option("-n", "--n-regions", help="Number of parts at most.")] = None,
    persistence: Annotated[
        float | None,
        typer.Option(help=f"Keep what persists so long: a share, {PART_CONTRAST} by default; of a recipe, heat."),
    ] = None,
    largest_gap: Annotated[bool, typer.Option("--largest-gap", help="Cut where persistence falls most.")] = False,
    smooth: Annotated[
        bool | None,
        typer.Option("--smooth/--no-smooth", help=f"Move boundaries to the least cut; by default for {PARTS}."),
    ] = None,
    repair: RepairOption = "",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the mesh with the parts as colours (PLY).")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the parts (PNG, SVG or PDF).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Cut a mesh into its parts: limbs, head, torso."""
    if method not in METHODS:
        raise InvalidParameterError(f"--method takes {', '.join(METHODS)}; it was given {method!r}.")
    require_paths(picture, output)
    surface = load_mesh(mesh, repair)
    with progress_bar("parts") as progress:
        tree = _tree(surface, method, progress)
    rule = {"n_regions": n_regions, "persistence": persistence, "largest_gap": largest_gap}
    told = n_regions is not None or persistence is not None or largest_gap
    parts = segmentation.segment(tree, **(rule if told else _usual(method)))
    if smooth if smooth is not None else method == PARTS:
        parts = smooth_boundaries(facing_outward(surface), parts)
    rows = _rows(surface, tree, parts)
    if as_json:
        print_json({"path": str(mesh), "method": method, "parts": rows, "face_labels": parts.labels})
    else:
        print_rows("Parts", COLUMNS, rows)
    if output:
        save_colors(surface, part_colors(surface, parts.labels), output)
    if picture:
        save_picture(figure_segments(surface, parts.labels, parts.features.vertices), picture)


def _tree(surface: TriangleMesh, method: str, progress: Progress) -> Tree:
    if method == PARTS:
        return find_parts(surface, progress=progress).tree
    return describe_mesh(surface, PRESETS[method], progress=progress).tree


def _usual(method: str) -> dict[str, Any]:
    return {"persistence": PART_CONTRAST} if method == PARTS else {"n_regions": PRESETS[method].n_features}


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
