"""eigenshape stability: two shapes, the distance of their spectra, and which heat times can be trusted."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._text import literal
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.inputs import (
    DimOption,
    JsonOption,
    RepairOption,
    Scale,
    ShapeArgument,
    UpOption,
    ViewOption,
)
from eigenshape.stability.plan import USUAL_K, StabilityPlan

USUAL = StabilityPlan()


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
    repair: RepairOption = "",
    picture: Annotated[Path | None, typer.Option(help="Draw the report (PNG, SVG or PDF).")] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Compare two shapes: how close they are, how their spectra change, which heat times to trust.

    Meshes with the same faces correspond vertex by vertex. Others correspond by --map, or by random
    points that are matched by their distances in space.

    For instance: eigenshape stability clean.ply noisy.ply --picture report.png
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    partners = steps.read_partners(map_file)
    first, second = (
        steps.scale_shape(steps.load_shape(path, repair, dim), scale) for path in (one, two)
    )
    plan = StabilityPlan(
        k=k, n_samples=n_samples, times=tuple(t or ()), seed=seed, brackets=brackets
    )
    with progress_bar("stability") as progress:
        report = es.compare_shapes(first, second, plan, partners=partners, progress=progress)
    if as_json:
        print_json(
            {"one": str(one), "two": str(two), "scale": scale, **steps.stability_facts(report)}
        )
    else:
        steps.print_stability(report)
    if picture:
        steps.save_picture(
            es.plot.figure_stability(
                report, first, second, titles=(literal(one.stem), literal(two.stem)), **side
            ),
            picture,
        )
