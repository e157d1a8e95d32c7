"""eigenshape index add: describe folders of meshes and store the descriptions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import SOME_FAILED, err, escape_text, out, print_json, result_facts
from eigenshape.cli.inputs import Method, repair_names

# Of the verbs that describe shapes in processes
Workers = Annotated[int | None, typer.Option(min=1)]
Timeout = Annotated[float, typer.Option(min=1)]
Memory = Annotated[float | None, typer.Option(min=0.1)]
Sides = Annotated[int | None, typer.Option(min=0, max=50)]


def add(
    index: Path,
    sources: list[Path],
    *,
    labels: Path | None = None,
    part: str | None = None,
    codebook: Path | None = None,
    prune: bool = False,
    method: Method = "patches",
    views: Sides = None,
    frames: Sides = None,
    repair: str = "auto",
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
    as_json: bool = False,
) -> None:
    """Describe shapes and add them to an index; a file that fails is named, and the others are still added.

    A shape is named by its path below the given folder; its class is the folder that holds it.
    Shapes that the index has already are skipped, also if their folder has moved. After Ctrl-C or a
    crash, the same command continues where it stopped. Point clouds and frames of a depth camera
    (.pcd) become a surface first. The exit code is 3 if some files failed.

    Parameters
    ----------
    index
        Folder of the index. It is created if it does not exist.
    labels
        Table of comma-separated values with a column name, and columns label, tags (separated by
        semicolons) and any others, which become attributes. Without it, the class of a shape is the
        name of its folder.
    part : I/N
        Index only part I of N, such as 3/64, so that N jobs share the work, each with an index of
        its own; `eigenshape index merge` makes one index of them.
    codebook
        Codebook for a new index: a file that `eigenshape index learn` wrote, or another index. By
        default it is learned from the shapes if there are 40 or more, and with --part it is the one
        that comes with eigenshape.
    prune
        Remove shapes whose files lay in the given folders and are gone.
    method
        How shapes are described; patches is best for partial scans.
    views
        Number of sides from which closed shapes are also described, so that partial scans find
        them. By default 6 with patches, 4 with the other methods.
    frames
        Number of sides from which closed shapes are also described as a depth camera sees them, for
        an index that is asked with single frames; 6 are a good choice.
    """
    repairs = repair_names(repair)
    items = es.io.find_items(sources, labels=labels, part=steps.parse_part(part))
    shelf = es.ShapeIndex.open_or_create(index)
    recipe = steps.index_recipe(shelf, method, codebook, in_parts=part is not None, n_frames=frames)
    with steps.worker_processes(workers, timeout, memory, scheduler) as processes:
        if recipe is None and frames:
            learned = steps.learn_codebook(items, processes, repairs, shelf)
            recipe = es.retrieval.PatchRecipe(learned, n_frames=frames)
        report = steps.describe_all(shelf, items, recipe, processes, repairs=repairs, n_views=views)
    pruned = steps.prune(shelf, sources) if prune else []
    doubles = steps.find_doubles(shelf, report.added)
    if as_json:
        facts = {"index": index, "shapes": len(shelf), **result_facts(report)}
        print_json(facts | {"pruned": pruned, "doubles": doubles})
    else:
        _print(shelf, report, pruned, doubles)
    if report.failed:
        raise typer.Exit(SOME_FAILED)


def _print(
    shelf: es.ShapeIndex,
    report: es.retrieval.BatchReport,
    pruned: list[str],
    doubles: list[tuple[str, str]],
) -> None:
    for name, done in report.repaired:
        err.print(f"[yellow]repaired:[/] {escape_text(name)}: {escape_text('; '.join(done))}")
    counts = f"{len(report.added)} described, {len(report.skipped)} indexed already"
    if pruned:
        counts += f", {len(pruned)} removed"
    out.print(f"{counts}, {len(report.failed)} failed; the index holds {len(shelf)} shapes.")
    # On a terminal each file was named when it failed.
    for name, reason in () if out.is_terminal and err.is_terminal else report.failed:
        out.print(f"  [yellow]{escape_text(name)}[/]: {escape_text(reason)}")
    for one, two in doubles:
        out.print(f"  [yellow]{escape_text(two)}[/]: the same file content as {escape_text(one)}")
