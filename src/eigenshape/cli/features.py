"""eigenshape features: the points and parts of a shape that persist."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from eigenshape.cli.console import err, out, print_json, progress_bar
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, load_mesh
from eigenshape.cli.methods import HeatMethodOption, heat_recipe
from eigenshape.cli.outputs import require_picture, save_picture
from eigenshape.cli.parts import part_rows, print_rows, require_colored_path, save_colors
from eigenshape.features.segmentation import segment
from eigenshape.plot.fields import figure_segments, value_colors
from eigenshape.retrieval.heat.descriptor import SCALE_FREE
from eigenshape.retrieval.heat.features import find_heat_features
from eigenshape.spectral.signatures.approximate_heat import LARGE, USUAL_ACCURACY

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
    n_parts: Annotated[int, typer.Option("-n", "--n-parts", help="Largest number of parts.")] = 15,
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
    as_json: JsonOption = False,
) -> None:
    """Find the feature points of a mesh and the parts around them, most persistent first.

    Above 100,000 vertices, or with --accuracy, heat is approximate, and its error is printed.
    """
    recipe = heat_recipe(method)
    require_picture(picture)
    require_colored_path(output)
    surface = load_mesh(mesh, repair)
    with progress_bar("features") as progress:
        if accuracy is None and surface.n_vertices > LARGE:
            accuracy = USUAL_ACCURACY
        shape = find_heat_features(surface, recipe, accuracy=accuracy, progress=progress)
    if shape.error is not None:
        err.print(
            f"{surface.n_vertices:,} vertices: heat is approximate, with a relative error of about "
            f"{100 * shape.error:.2g} %"
        )
    n_fragments = int(np.isin(shape.tree.maxima, shape.fragments).sum())
    by_number = n_parts + n_fragments if persistence is None and not largest_gap else None
    parts = segment(
        shape.tree, n_regions=by_number, persistence=persistence, largest_gap=largest_gap
    )
    if n_fragments:
        err.print(
            f"{n_fragments} fragments, each with less than 1 % of the area, are one part each, without a feature point"
        )
    rows = [
        row | {"heat": float(parts.features.values[i])}
        for i, row in enumerate(part_rows(shape.mesh, parts))
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
        print_rows("Feature points", COLUMNS, features_alone)
        time = recipe.feature_scale * recipe.time_unit
        unit = "the area" if recipe.unit == "area" else "the square of the longest side of the box"
        out.print(f"heat at time t = {time:g} of {unit}, in 1/length²")
    if picture:
        save_picture(figure_segments(surface, parts.labels, parts.features.vertices), picture)
    if output:
        save_colors(
            surface, value_colors(np.log(np.maximum(shape.heat, np.finfo(np.float64).tiny))), output
        )
