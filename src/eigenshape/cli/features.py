"""eigenshape features: the points and parts of a shape that persist."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import err, out, print_json, progress_bar
from eigenshape.cli.inputs import (
    HeatMethodOption,
    JsonOption,
    MeshArgument,
    RepairOption,
    UpOption,
    ViewOption,
    require_one_rule,
)
from eigenshape.retrieval.heat.recipe import SCALE_FREE

COLUMNS = {
    "feature": "feature",
    "vertex": "vertex",
    "position": "position",
    "heat": "heat",
    "persistence": "persistence",
    "area": "area_share",
}


def features(
    mesh: MeshArgument,
    *,
    n_parts: Annotated[
        int, typer.Option("-n", "--n-parts", min=1, help="Largest number of parts.")
    ] = 15,
    persistence: Annotated[
        float | None,
        typer.Option(
            help="Keep the features of at least this persistence, in units of heat, instead of a number of them."
        ),
    ] = None,
    largest_gap: Annotated[
        bool,
        typer.Option(
            "--largest-gap",
            help="Keep the features before the largest drop of persistence, instead of a number of them.",
        ),
    ] = False,
    method: HeatMethodOption = SCALE_FREE.name,
    accuracy: Annotated[
        float | None,
        typer.Option(
            help=(
                "Compute heat approximately, to this relative error, from 0.0001 (slow) to 0.1. By "
                "default exactly up to 100,000 vertices, and to 0.01 above."
            )
        ),
    ] = None,
    repair: RepairOption = "",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Write the mesh, colored by its heat (PLY)."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw parts and feature points (PNG, SVG or PDF).")
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Find the feature points of a mesh and the parts around them, most persistent first.

    Above 100,000 vertices, or with --accuracy, heat is approximate, and its error is printed.
    """
    recipe = steps.heat_recipe(method)
    require_one_rule(None, persistence, largest_gap=largest_gap)
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_colored_path(output)
    surface = steps.load_surface(mesh, repair)
    with progress_bar("features") as progress:
        shape = steps.find_features(surface, recipe, accuracy, progress)
    if shape.error is not None:
        err.print(
            f"{surface.n_vertices:,} vertices: heat is approximate, with a relative error of about "
            f"{100 * shape.error:.2g} %"
        )
    n_fragments = steps.count_fragments(shape)
    by_number = n_parts + n_fragments if persistence is None and not largest_gap else None
    parts = es.segment(
        shape.tree, n_regions=by_number, persistence=persistence, largest_gap=largest_gap
    )
    if n_fragments:
        err.print(
            f"{n_fragments} fragments, each with less than 1 % of the area, are one part each, without a feature point"
        )
    rows = [
        row | {"heat": float(parts.features.values[i])}
        for i, row in enumerate(steps.part_rows(shape.mesh, parts))
    ]
    loose = set(shape.fragments.tolist())
    if as_json:
        found = {
            "path": str(mesh),
            "recipe": recipe.name,
            "features": rows,
            "heat_error": shape.error,
        }
        print_json(found | {"face_labels": parts.labels})
    else:
        features_alone = [
            row | {"feature": i} for i, row in enumerate(rows) if row["vertex"] not in loose
        ]
        steps.print_rows("Feature points", COLUMNS, features_alone)
        time = recipe.feature_scale * recipe.time_unit
        unit = "the area" if recipe.unit == "area" else "the square of the longest side of the box"
        out.print(f"heat at time t = {time:g} of {unit}, in 1/length²")
    if picture:
        figure = es.plot.figure_segments(surface, parts.labels, parts.features.vertices, **side)
        steps.save_picture(figure, picture)
    if output:
        steps.save_heat(surface, shape.heat, output)
