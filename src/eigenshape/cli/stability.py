"""eigenshape stability: two shapes, the distance of their spectra, and which heat times can be trusted."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import literal
from eigenshape.cli import steps
from eigenshape.cli.console import (
    err,
    escape_text,
    out,
    print_json,
    print_table,
    progress_bar,
    result_facts,
)
from eigenshape.stability.plan import StabilityPlan

Normalization = Literal["none", "area", "diameter"]
USUAL = StabilityPlan()
OTHER_UNIT = 2.0  # ratio of lengths from which two units are likely; inch and cm differ by 2.54


def stability(
    one: Path,
    two: Path,
    *,
    k: int | None = None,
    t: list[float] | None = None,
    n_samples: int = USUAL.n_samples,
    seed: int = USUAL.seed,
    map_file: Path | None = None,
    normalize: Normalization = "none",
    brackets: bool = False,
    dim: int = 2,
    repair: str = "none",
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Compare two shapes: how close they are, how their spectra change, which heat times to trust.

    Meshes with the same faces correspond vertex by vertex. Others correspond by --map, or by random
    points that are matched by their distances in space.

    For instance: eigenshape stability clean.ply noisy.ply --picture report.png

    Parameters
    ----------
    one, two
        The shapes, in files of any kind that `info` takes.
    k
        Number of eigenvalues to compare. By default 20, or all if there are fewer.
    t
        Heat time, in length²; may be given several times. By default four are chosen.
    n_samples
        Number of random points on each shape.
    seed
        Seed of the random points.
    map_file
        Text file with one line for each vertex of the first shape: the number of its partner in
        the second shape, from 0.
    normalize
        Center both shapes and scale them to area 1 or to diameter 1 before they are compared.
    brackets
        Also compute guaranteed lower and upper bounds of each eigenvalue, to prove that the
        shapes differ.
    picture
        Draw the report (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture)
    partners = None if map_file is None else steps.read_map(map_file)
    shapes: list[Any] = []
    for path in (one, two):
        shape: Any = steps.load_shape(path, repair, dim)
        if normalize != "none":
            if not isinstance(shape, es.TriangleMesh):
                raise InvalidParameterError(
                    f"--normalize is for triangle meshes; the shape is {shape!r}."
                )
            shape = es.geometry.normalize_mesh(shape, normalize)
        shapes.append(shape)
    first, second = shapes
    if all(isinstance(shape, es.TriangleMesh) for shape in shapes):
        factor = (es.geometry.surface_area(second) / es.geometry.surface_area(first)) ** 0.5
        if not 1 / OTHER_UNIT < factor < OTHER_UNIT:
            err.print(
                f"[yellow]note:[/] lengths of {escape_text(two.name)} are {factor:.4g} times as large "
                "(root of the ratio of areas); if only the unit differs, add --normalize area"
            )
    plan = StabilityPlan(
        k=k, n_samples=n_samples, times=tuple(t or ()), seed=seed, brackets=brackets
    )
    with progress_bar("stability") as progress:
        report = es.compare_shapes(first, second, plan, partners=partners, progress=progress)
    if as_json:
        closeness = {"delta_of_the_map": report.closeness.delta if report.closeness else None}
        # Without what there is for each point
        facts = result_facts(report, "closeness", "distances") | closeness
        print_json({"one": one, "two": two, "normalize": normalize, **facts})
    else:
        _print(report)
    if picture:
        titles = (literal(one.stem), literal(two.stem))
        figure = es.plot.figure_stability(report, first, second, titles=titles, **side)
        steps.save_picture(figure, picture)


def _print(report: es.stability.StabilityReport) -> None:
    """Print the eigenvalues of both shapes and their changes at each heat time."""
    compared = report.spectra
    proved = compared.proved_changes
    rows = []
    for number, is_zero in enumerate(compared.zero):
        values = (0.0, 0.0) if is_zero else (compared.one[number], compared.two[number])
        texts = [*(f"{value:.6g}" for value in values), f"{compared.relative[number]:.2%}"]
        rows.append([str(number), *texts, "yes" if proved[number] else "no"])
    print_table("Eigenvalues, in 1/length²", ["i", "first", "second", "change", "proved"], rows)
    heat = []
    for change in report.changes:
        numbers = (change.t, change.change, change.floor, change.weyl)
        texts = [f"{number:.3g}" for number in numbers]
        heat.append([*texts, "yes" if change.admissible else "no"])
    title = f"Largest change of {len(rows)} eigenvalues of graph Laplacians, over the last, at heat time t (length²)"
    print_table(title, ["t", "shapes", "samples", "Weyl's bound", "admissible"], heat)
    out.print(report.explain())
