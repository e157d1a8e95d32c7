"""eigenshape features: the points and parts of a shape that persist."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import (
    JsonOption,
    MeshArgument,
    RepairOption,
    err,
    load_mesh,
    print_json,
    print_table,
    progress_bar,
    require_color_path,
    said,
)
from eigenshape.features.segmentation import Segmentation, segment
from eigenshape.figures.fields import figure_segments, value_colors
from eigenshape.figures.save import require_picture_path, save_figure
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import write_mesh
from eigenshape.retrieval.describe import DescribedShape, describe_mesh
from eigenshape.retrieval.describe_large import DescribedLargeShape, describe_large_mesh
from eigenshape.retrieval.descriptor import PRESETS, SCALE_FREE, Recipe
from eigenshape.spectral.large_signature import LARGE
from eigenshape.spectral.outcome import Progress


def preset(name: str) -> Recipe:
    """Look a recipe up by the name that a user typed."""
    if name not in PRESETS:
        raise InvalidParameterError(f"--preset takes {' or '.join(PRESETS)}; it was given {name!r}.")
    return PRESETS[name]


PresetOption = Annotated[str, typer.Option("--preset", help=f"How shapes are described: {' or '.join(PRESETS)}.")]


def features(
    mesh: MeshArgument,
    *,
    n_regions: Annotated[int, typer.Option("-n", "--n-regions", help="Number of regions at most.")] = 15,
    persistence: Annotated[
        float | None, typer.Option(help="Keep what persists at least so long, in units of heat; replaces the number.")
    ] = None,
    largest_gap: Annotated[
        bool, typer.Option("--largest-gap", help="Cut where persistence falls most; replaces the number.")
    ] = False,
    preset_name: PresetOption = SCALE_FREE.name,
    repair: RepairOption = "",
    picture: Annotated[Path | None, typer.Option(help="Draw parts and feature points (PNG, SVG or PDF).")] = None,
    ply: Annotated[Path | None, typer.Option(help="Write the mesh with the heat as colours (PLY).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the feature points of a mesh and the parts around them, most persistent first.

    Beyond 25,000 vertices heat is approximate, and its error is said.
    """
    recipe = preset(preset_name)
    if picture:
        require_picture_path(picture)
    if ply:
        require_color_path(ply)
    surface = load_mesh(mesh, repair)
    with progress_bar("features") as progress:
        shape = _described(surface, recipe, progress)
    error = shape.error if isinstance(shape, DescribedLargeShape) else None
    if error is not None:
        err.print(f"{surface.n_vertices:,} vertices: their heat is approximate, off by about {100 * error:.2g} %")
    by_number = n_regions if persistence is None and not largest_gap else None
    parts = segment(shape.tree, n_regions=by_number, persistence=persistence, largest_gap=largest_gap)
    rows = _rows(shape.mesh, parts)
    if as_json:
        found = {"path": str(mesh), "recipe": recipe.name, "features": rows, "heat_error": error}
        print_json(found | {"face_labels": parts.labels})
    else:
        _print(rows)
    if picture:
        save_figure(figure_segments(surface, parts.labels, parts.features.vertices), picture)
        said(picture)
    if ply:
        write_mesh(surface, ply, colors=value_colors(np.log(np.maximum(shape.heat, np.finfo(np.float64).tiny))))
        said(ply)


def _described(surface: TriangleMesh, recipe: Recipe, progress: Progress) -> DescribedShape | DescribedLargeShape:
    """Take a spectrum as far as the thesis does, and approximate heat beyond."""
    if surface.n_vertices <= LARGE:
        return describe_mesh(surface, recipe, progress=progress)
    return describe_large_mesh(surface, recipe, progress=progress)


def _rows(mesh: TriangleMesh, parts: Segmentation) -> list[dict[str, Any]]:
    areas = np.bincount(parts.labels, weights=face_areas(mesh))
    points = parts.features
    return [
        {
            "vertex": int(vertex),
            "position": mesh.vertices[vertex].tolist(),
            "heat": float(points.values[index]),
            "persistence": float(points.persistence[index]),
            "area_share": float(areas[index] / areas.sum()),
        }
        for index, vertex in enumerate(points.vertices)
    ]


def _print(rows: list[dict[str, Any]]) -> None:
    cells = [
        [
            str(index),
            str(row["vertex"]),
            "  ".join(f"{coordinate:.4g}" for coordinate in row["position"]),
            f"{row['heat']:.4g}",
            "never merges" if np.isinf(row["persistence"]) else f"{row['persistence']:.4g}",
            f"{100 * row['area_share']:.1f} %",
        ]
        for index, row in enumerate(rows)
    ]
    print_table("Feature points", ["feature", "vertex", "position", "heat", "persistence", "area"], cells)
