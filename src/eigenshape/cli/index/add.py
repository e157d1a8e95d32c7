"""eigenshape index add: describe folders of meshes and store the descriptions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import SOME_FAILED, err, escape_text, out, print_json
from eigenshape.cli.inputs import (
    PATCHES,
    IndexRepairOption,
    JsonOption,
    MethodOption,
    repair_names,
    require_method,
)

NewIndexArgument = Annotated[
    Path, typer.Argument(help="Folder of the index. It is created if it does not exist.")
]
SourcesArgument = Annotated[
    list[Path], typer.Argument(help="Files of meshes or points, or folders to search for them.")
]
ViewsOption = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=50,
        help=(
            "Number of sides from which closed shapes are also described, so that partial scans "
            "find them. By default 6 with patches, 4 with the other methods."
        ),
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Number of processes that describe shapes at the same time. By default one for each "
        "core.",
    ),
]
TimeoutOption = Annotated[
    float, typer.Option(min=1, help="Seconds after which a file is named as failed.")
]
MemoryOption = Annotated[
    float | None,
    typer.Option(
        min=0.1,
        help="Gigabytes that a process may use; a file that needs more is named as failed. By "
        "default each process has an equal share of the machine's memory.",
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Describe on a cluster: the address of a Dask scheduler, such as "
        "tcp://10.0.0.5:8786. Needs pip install 'eigenshape[cluster]' on all machines, and files "
        "that all of them see.",
    ),
]


def add(
    index: NewIndexArgument,
    sources: SourcesArgument,
    *,
    labels: Annotated[
        Path | None,
        typer.Option(
            help="Table of comma-separated values with a column name, and columns label, tags "
            "(separated by semicolons) and any others, which become attributes. Without it, the "
            "class of a shape is the name of its folder."
        ),
    ] = None,
    part: Annotated[
        str | None,
        typer.Option(
            metavar="I/N",
            help="Index only part I of N, so that N jobs share the work, each with an index of its "
            "own; `eigenshape index merge` makes one index of them.",
        ),
    ] = None,
    codebook: Annotated[
        Path | None,
        typer.Option(
            help="Codebook for a new index: a file that `eigenshape index learn` wrote, or another "
            "index. By default it is learned from the shapes if there are 40 or more, and with "
            "--part it is the one that comes with eigenshape.",
        ),
    ] = None,
    prune: Annotated[
        bool,
        typer.Option(
            "--prune", help="Remove shapes whose files lay in the given folders and are gone."
        ),
    ] = False,
    method: MethodOption = PATCHES,
    views: ViewsOption = None,
    frames: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=50,
            help="Number of sides from which closed shapes are also described as a depth camera "
            "sees them, for an index that is asked with single frames; 6 are a good choice.",
        ),
    ] = None,
    repair: IndexRepairOption = "auto",
    workers: WorkersOption = None,
    timeout: TimeoutOption = 300.0,
    memory: MemoryOption = None,
    scheduler: SchedulerOption = None,
    as_json: JsonOption = False,
) -> None:
    """Describe shapes and add them to an index; a file that fails is named, and the others are still added.

    A shape is named by its path below the given folder; its class is the folder that holds it.
    Shapes that the index has already are skipped, also if their folder has moved. After Ctrl-C or a
    crash, the same command continues where it stopped. Point clouds and frames of a depth camera
    (.pcd) become a surface first. The exit code is 3 if some files failed.
    """
    require_method(method)
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
        facts = {"index": str(index), "shapes": len(shelf), **vars(report)}
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
