"""eigenshape features: the points and parts of a shape that persist."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import err, out, print_json, progress_bar
from eigenshape.cli.inputs import HeatMethod, require_one_rule
from eigenshape.retrieval.heat.recipe import PRESETS

COLUMNS = {
    "feature": "feature",
    "vertex": "vertex",
    "position": "position",
    "heat": "heat",
    "persistence": "persistence",
    "area": "area_share",
}


def features(
    mesh: Path,
    *,
    n_parts: Annotated[int, typer.Option(min=1)] = 15,
    persistence: float | None = None,
    largest_gap: bool = False,
    method: HeatMethod = "scale-free",
    accuracy: float | None = None,
    repair: str = "none",
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Find the feature points of a mesh and the parts around them, most persistent first.

    Above 100,000 vertices, or with --accuracy, heat is approximate, and its error is printed.

    Parameters
    ----------
    n_parts
        Largest number of parts.
    persistence
        Keep the features of at least this persistence, in units of heat, instead of a number of
        them.
    largest_gap
        Keep the features before the largest drop of persistence, instead of a number of them.
    method
        How heat is measured: scale-free by the area, thesis by the bounding box, as published.
    accuracy
        Compute heat approximately, to this relative error, from 0.0001 (slow) to 0.1. By default
        exactly up to 100,000 vertices, and to 0.01 above.
    output
        Write the mesh, colored by its heat (PLY).
    picture
        Draw parts and feature points (PNG, SVG or PDF).
    """
    is_persistence = persistence is not None
    # --n-parts has a default, and the others replace it.
    require_one_rule(
        {"--n-parts": False, "--persistence": is_persistence, "--largest-gap": largest_gap}
    )
    side = steps.picture_side(view, up, picture)
    steps.require_mesh_path(output, colors=True)
    recipe = PRESETS[method]
    surface = steps.load_surface(mesh, repair)
    with progress_bar("features") as progress:
        shape = steps.find_features(surface, recipe, accuracy, progress)
    if shape.error is not None:
        err.print(
            f"{surface.n_vertices:,} vertices: heat is approximate, with a relative error of about "
            f"{100 * shape.error:.2g} %"
        )
    n_fragments = steps.count_fragments(shape)
    by_number = None if is_persistence or largest_gap else n_parts + n_fragments
    parts = es.segment(
        shape.tree, n_regions=by_number, persistence=persistence, largest_gap=largest_gap
    )
    if n_fragments:
        err.print(
            f"{n_fragments} fragments, each with less than 1 % of the area, are one part each, without a feature point"
        )
    rows = steps.part_rows(shape.mesh, parts)
    for number, row in enumerate(rows):
        row["heat"] = float(parts.features.values[number])
    if as_json:
        facts = {"path": mesh, "recipe": recipe.name, "features": rows, "heat_error": shape.error}
        print_json(facts | {"face_labels": parts.labels})
    else:
        loose = set(shape.fragments.tolist())
        numbered = [row | {"feature": number} for number, row in enumerate(rows)]
        with_points = [row for row in numbered if row["vertex"] not in loose]
        steps.print_rows("Feature points", COLUMNS, with_points)
        time = recipe.feature_scale * recipe.time_unit
        unit = "the area" if recipe.unit == "area" else "the square of the longest side of the box"
        out.print(f"heat at time t = {time:g} of {unit}, in 1/length²")
    if picture:
        figure = es.plot.figure_segments(surface, parts.labels, parts.features.vertices, **side)
        steps.save_picture(figure, picture)
    if output:
        steps.save_heat(surface, shape.heat, output)
