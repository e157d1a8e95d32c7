"""eigenshape index: describe folders of meshes and store the descriptions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json
from eigenshape.cli.inputs import (
    PATCHES,
    JsonOption,
    MethodOption,
    RepairOption,
    repair_names,
    require_method,
)

SOME_FAILED = 3  # exit code where some shapes could not be indexed

NewIndexArgument = Annotated[
    Path, typer.Argument(help="Folder of the index. It is created if it does not exist.")
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
    int, typer.Option(min=1, help="Number of processes that describe shapes at the same time.")
]


def index(
    index: NewIndexArgument,
    sources: Annotated[
        list[Path], typer.Argument(help="Mesh files, or folders to search for them.")
    ],
    *,
    method: MethodOption = PATCHES,
    views: ViewsOption = None,
    repair: RepairOption = "",
    workers: WorkersOption = 2,
    timeout: Annotated[
        float, typer.Option(min=1, help="Seconds after which a file is named as failed.")
    ] = 300.0,
    as_json: JsonOption = False,
) -> None:
    """Describe meshes and add them to an index; a file that fails is named, and the others are still added.

    A shape is named by its path below the given folder; its class is the folder that holds it. After Ctrl-C or a
    crash, the same command continues where it stopped.
    """
    require_method(method)
    repairs = repair_names(repair)
    items = steps.find_items(sources)
    processes = es.retrieval.Workers(workers, timeout)
    shelf = es.ShapeIndex.open_or_create(index)
    recipe = steps.index_recipe(shelf, method, items, repairs, processes)
    report = steps.describe_all(shelf, items, recipe, processes, repairs=repairs, n_views=views)
    if as_json:
        print_json({"index": str(index), "shapes": len(shelf), **vars(report)})
    else:
        _print(shelf, report)
    if report.failed:
        raise typer.Exit(SOME_FAILED)


def _print(shelf: es.ShapeIndex, report: es.retrieval.BatchReport) -> None:
    out.print(
        f"{len(report.added)} described, {len(report.skipped)} indexed already, {len(report.failed)} failed; "
        f"the index holds {len(shelf)} shapes."
    )
    for name, reason in report.failed:
        out.print(f"  [yellow]{escape_text(name)}[/]: {escape_text(reason)}")
    for one, two in _doubles(shelf, report):
        out.print(f"  [yellow]{escape_text(two)}[/]: the same file content as {escape_text(one)}")


def _doubles(shelf: es.ShapeIndex, report: es.retrieval.BatchReport) -> list[tuple[str, str]]:
    """Pair each shape that was added with one of another name and the same content, if there is one.

    A folder and one of its own folders name the same files differently, so both are indexed.
    """
    added = set(report.added)
    records = sorted(shelf.records(), key=lambda record: record.name in added)
    first: dict[str, str] = {}
    pairs = []
    for record in records:
        if record.digest is None:
            continue
        known = first.setdefault(record.digest, record.name)
        if known != record.name and record.name in added:
            pairs.append((known, record.name))
    return pairs
