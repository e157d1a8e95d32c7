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
    print_table,
    progress_bar,
    require_color_path,
    said,
)
from eigenshape.features import segmentation
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.parts import PART_CONTRAST, facing_outward, find_parts
from eigenshape.features.segmentation import Segmentation, Tree, merge_targets
from eigenshape.figures.fields import figure_segments, part_colors
from eigenshape.figures.save import require_picture_path, save_figure
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import write_mesh
from eigenshape.retrieval.describe import describe_mesh
from eigenshape.retrieval.descriptor import PRESETS
from eigenshape.spectral.outcome import Progress

PARTS = "parts"
METHODS = (PARTS, *PRESETS)


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
    if picture:
        require_picture_path(picture)
    if output:
        require_color_path(output)
    surface = load_mesh(mesh, repair)
    with progress_bar("parts") as progress:
        tree = _tree(surface, method, progress)
    rule = {"n_regions": n_regions, "persistence": persistence, "largest_gap": largest_gap}
    told = n_regions is not None or persistence is not None or largest_gap
    parts = segmentation.segment(tree, **(rule if told else _usual(method)))
    if smooth if smooth is not None else method == PARTS:
        parts = smooth_boundaries(facing_outward(surface), parts)
    _report(mesh, method, surface, tree, parts, as_json)
    if output:
        write_mesh(surface, output, colors=part_colors(surface, parts.labels))
        said(output)
    if picture:
        save_figure(figure_segments(surface, parts.labels, parts.features.vertices), picture)
        said(picture)


def _tree(surface: TriangleMesh, method: str, progress: Progress) -> Tree:
    if method == PARTS:
        return find_parts(surface, progress=progress).tree
    return describe_mesh(surface, PRESETS[method], progress=progress).tree


def _usual(method: str) -> dict[str, Any]:
    return {"persistence": PART_CONTRAST} if method == PARTS else {"n_regions": PRESETS[method].n_features}


def _report(path: Path, method: str, surface: TriangleMesh, tree: Tree, parts: Segmentation, as_json: bool) -> None:
    rows = _rows(surface, tree, parts)
    if as_json:
        print_json({"path": str(path), "method": method, "parts": rows, "face_labels": parts.labels})
        return
    cells = [
        [
            str(row["part"]),
            str(row["vertex"]),
            f"{100 * row['area_share']:.1f} %",
            str(row["faces"]),
            "none" if row["splits_from"] is None else str(row["splits_from"]),
            "never merges" if np.isinf(row["persistence"]) else f"{row['persistence']:.4g}",
        ]
        for row in rows
    ]
    print_table("Parts", ["part", "feature point", "area", "faces", "splits from", "persistence"], cells)


def _rows(surface: TriangleMesh, tree: Tree, parts: Segmentation) -> list[dict[str, Any]]:
    areas = np.bincount(parts.labels, weights=face_areas(surface))
    counts = np.bincount(parts.labels)
    into = merge_targets(tree)
    return [
        {
            "part": number,
            "vertex": int(vertex),
            "position": surface.vertices[vertex].tolist(),
            "area_share": float(areas[number] / areas.sum()),
            "faces": int(counts[number]),
            "splits_from": int(into[number]) if into[number] >= 0 else None,
            "persistence": float(parts.features.persistence[number]),
        }
        for number, vertex in enumerate(parts.features.vertices)
    ]
