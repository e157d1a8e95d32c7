"""eigenshape stability: two shapes, the distance of their spectra, and which heat times can be trusted."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import out, print_json, print_table, progress_bar
from eigenshape.cli.inputs import (
    DimOption,
    DropMissingOption,
    JsonOption,
    RepairOption,
    ShapeArgument,
    load_shape,
)
from eigenshape.cli.outputs import require_picture, save_picture
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_area, normalize_diameter
from eigenshape.io.labels import read_map
from eigenshape.plot.figure import literal
from eigenshape.plot.stability import figure_stability
from eigenshape.stability.report import USUAL_K, StabilityPlan, StabilityReport, compare_shapes

USUAL = StabilityPlan()
Scale = Literal["none", "area", "diameter"]
SCALES: dict[str, Callable[[TriangleMesh], TriangleMesh]] = {
    "area": normalize_area,
    "diameter": normalize_diameter,
}


def stability(
    one: ShapeArgument,
    two: ShapeArgument,
    *,
    k: Annotated[
        int | None,
        typer.Option(
            "-k",
            help=f"Number of eigenvalues to compare. By default {USUAL_K}, or all if there are fewer.",
        ),
    ] = None,
    t: Annotated[
        list[float] | None,
        typer.Option(
            "--t",
            help="Heat time, in length²; may be given several times. By default four are chosen.",
        ),
    ] = None,
    n_samples: Annotated[
        int, typer.Option("-n", "--n-samples", help="Number of random points on each shape.")
    ] = USUAL.n_samples,
    seed: Annotated[int, typer.Option(help="Seed of the random points.")] = USUAL.seed,
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map",
            help=(
                "Text file with one line for each vertex of the first shape: the number of its "
                "partner in the second shape, from 0."
            ),
        ),
    ] = None,
    scale: Annotated[
        Scale,
        typer.Option(
            help="Center both shapes and scale them to area 1 or to diameter 1 before they are compared."
        ),
    ] = "none",
    brackets: Annotated[
        bool,
        typer.Option(
            "--brackets",
            help="Compute guaranteed bounds of each eigenvalue, to prove that the shapes differ.",
        ),
    ] = False,
    dim: DimOption = 2,
    drop_missing: DropMissingOption = False,
    repair: RepairOption = "",
    picture: Annotated[Path | None, typer.Option(help="Draw the report (PNG, SVG or PDF).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare two shapes: how close they lie, what changes in their spectra, and which heat times to trust.

    Meshes with the same faces correspond vertex by vertex. Others correspond by --map, or by random points that are
    matched by their distances in space.

    For instance: eigenshape stability clean.ply noisy.ply --picture report.png
    """
    require_picture(picture)
    partners = read_map(map_file) if map_file else None
    first, second = (
        _scaled(load_shape(path, repair, dim, drop_missing=drop_missing), scale)
        for path in (one, two)
    )
    plan = StabilityPlan(
        k=k, n_samples=n_samples, times=tuple(t or ()), seed=seed, brackets=brackets
    )
    with progress_bar("stability") as progress:
        report = compare_shapes(first, second, plan, partners=partners, progress=progress)
    if as_json:
        print_json({"one": str(one), "two": str(two), "scale": scale, **_facts(report)})
    else:
        _print(report)
    if picture:
        save_picture(
            figure_stability(report, first, second, titles=(literal(one.stem), literal(two.stem))),
            picture,
        )


def _scaled(shape: Shape, scale: str) -> Shape:
    if scale == "none":
        return shape
    if not isinstance(shape, TriangleMesh):
        raise InvalidParameterError(f"--scale is for triangle meshes; the shape is {shape!r}.")
    return SCALES[scale](shape)


def _facts(report: StabilityReport) -> dict[str, Any]:
    compared, angles = report.spectra, report.angles
    return {
        "spectra": {
            **asdict(compared),
            "proved": compared.proved_changes,
            "hausdorff": compared.hausdorff,
            "index_distance": compared.index_distance,
            "mean_relative": compared.mean_relative,
            "median_relative": compared.median_relative,
        },
        "distance": report.distance,
        "matching_distance": report.matching_distance,
        "sampling_distance": report.sampling_distance,
        "delta": report.delta,
        "delta_of_the_map": report.closeness.delta if report.closeness else None,
        "times": {
            **asdict(report.times),
            "empty": report.times.empty,
            "low_reason": report.times.low_reason,
        },
        "changes": [
            {**asdict(change), "significant": change.significant} for change in report.changes
        ],
        "eigenspaces": asdict(angles),
        "n_samples": report.n_samples,
        "explanation": report.explain(),
    }


def _print(report: StabilityReport) -> None:
    compared = report.spectra
    pairs = np.where(compared.zero[:, None], 0.0, np.column_stack([compared.one, compared.two]))
    rows = [
        [str(number), f"{one:.6g}", f"{two:.6g}", f"{change:.2%}", "yes" if proved else "no"]
        for number, ((one, two), change, proved) in enumerate(
            zip(pairs, compared.relative, compared.proved_changes, strict=True)
        )
    ]
    print_table("Eigenvalues, in 1/length²", ["i", "first", "second", "change", "proved"], rows)
    heat = [
        [
            f"{row.t:.3g}",
            f"{row.change:.3g}",
            f"{row.floor:.3g}",
            f"{row.weyl:.3g}",
            "yes" if row.admissible else "no",
        ]
        for row in report.changes
    ]
    title = f"Largest change of {len(rows)} eigenvalues of graph Laplacians, over the last, at heat time t (length²)"
    print_table(title, ["t", "shapes", "samples", "Weyl's bound", "admissible"], heat)
    out.print(report.explain())
