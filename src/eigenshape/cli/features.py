"""eigenshape features and condense: points and parts that persist, and regions of similar heat, of many shapes."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    batch_reporter,
    err,
    escape_text,
    out,
    print_failures,
    print_json,
    print_table,
    print_written,
    progress_bar,
)
from eigenshape.cli.inputs import (
    SEAMS,
    HeatMethod,
    Memory,
    Timeout,
    Workers,
    numbers_of,
    repair_names,
    require_one_rule,
)

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
    repair: str = SEAMS,
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Find the feature points of a mesh and the parts around them, most persistent first.

    Above 100,000 vertices heat is approximate, and its error is printed.

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
    side = steps.picture_side(view, up, picture, shapes=[mesh])
    steps.require_mesh_path(output, "colors")
    recipe = steps.PRESETS[method]
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


def condense(
    sources: list[Path],
    *,
    times: str,
    output: Path,
    n_modes: Annotated[int, typer.Option(min=1)] = 200,
    tolerance: float = 0.05,
    repair: str = "auto",
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
    as_json: bool = False,
) -> None:
    """Average heat signatures over regions of similar heat, and write a table of the regions of all shapes.

    Each row is a region: its shape, area, center, number of vertices, and the mean logarithm of
    the heat at each time. These are the condensed features of neurons, by which connectomics tells
    spines, shafts and cell bodies apart. Above 100,000 vertices heat is approximate. The exit code
    is 3 if some files failed.

    For instance: eigenshape condense neurons --times 1e6,1e7,1e8 -o neurons.parquet

    Parameters
    ----------
    times
        Diffusion times in length², separated by commas, in the unit of the files. The root of a
        time is about the size of what is told apart.
    output
        Write the table (.csv, .parquet; the latter needs pyarrow).
    n_modes
        Number of eigenpairs. A warning says if they are too few for the shortest time.
    tolerance
        Largest share of the variance of a shape that the means may lose. More regions keep more.
    """
    clock = numbers_of(times)
    if not clock:
        raise InvalidParameterError(
            f"--times takes numbers separated by commas, such as 1e6,1e7; it is {times!r}."
        )
    steps.require_table(output)
    work = partial(steps.condense_file, clock, n_modes, tolerance, repair_names(repair))
    items = es.io.find_items(sources)
    tables, failed = {}, {}
    with (
        steps.worker_processes(workers, timeout, memory, scheduler) as processes,
        progress_bar("condense") as progress,
        closing(steps.run_in_workers(work, items, processes)) as outcomes,
    ):
        report = batch_reporter(progress, "failed")
        for n_done, (item, outcome) in enumerate(outcomes, start=1):
            if outcome.value is None:
                failed[item.name] = str(outcome.error)
            else:
                tables[item.name] = outcome.value
            report(n_done, len(items), item.name, outcome.error)
    shapes = [(item.name, tables[item.name]) for item in items if item.name in tables]
    for name, table in shapes:
        for sentence in table.notes:
            err.print(f"[yellow]{escape_text(name)}:[/] {escape_text(sentence)}")
    if shapes:
        steps.write_table(output, steps.join_tables(shapes))
    facts = [
        {"shape": name, "n_regions": table.n_regions, "lost": table.lost, "heat_error": table.error}
        for name, table in shapes
    ]
    if as_json:
        print_json({"output": output, "shapes": facts, "failures": failed})
    else:
        rows = [
            [
                name,
                f"{table.n_regions:,}",
                f"{table.lost:.1%}",
                f"{table.error:.1g}",
            ]
            for name, table in shapes
        ]
        print_table("Condensed", ["shape", "regions", "variance lost", "error of heat"], rows)
        print_failures(failed.items())
        if shapes:
            print_written(output)
    if failed:
        raise typer.Exit(SOME_FAILED)
