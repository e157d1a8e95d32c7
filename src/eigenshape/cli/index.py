"""eigenshape index: describe folders of meshes and store the descriptions."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import batch_reporter, out, print_json, progress_bar, shown
from eigenshape.cli.inputs import JsonOption, RepairOption, read_repaired, repair_names
from eigenshape.cli.methods import PATCHES, MethodOption, index_recipe, require_method
from eigenshape.io.parsing import MESH_FORMATS
from eigenshape.retrieval.kinds import AnyRecipe
from eigenshape.retrieval.store.batch import BatchReport, build_index
from eigenshape.retrieval.store.index import ShapeIndex
from eigenshape.retrieval.store.workers import Item, Workers

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
    items, repairs, processes = _items(sources), repair_names(repair), Workers(workers, timeout)
    shelf = ShapeIndex.open_or_create(index)
    recipe = index_recipe(shelf, method, items, repairs, processes)
    report = describe_all(shelf, items, recipe, processes, repairs=repairs, n_views=views)
    if as_json:
        print_json({"index": str(index), "shapes": len(shelf), **vars(report)})
    else:
        _print(shelf, report)
    if report.failed:
        raise typer.Exit(SOME_FAILED)


def describe_all(
    shelf: ShapeIndex,
    items: Sequence[Item],
    recipe: AnyRecipe,
    workers: Workers,
    *,
    repairs: tuple[str, ...] = (),
    n_views: int | None = None,
) -> BatchReport:
    """Build an index with a progress bar, naming each file that fails as soon as it does."""
    with progress_bar("index") as progress:
        return build_index(
            shelf,
            items,
            partial(read_repaired, names=repairs),
            recipes=(recipe,),
            n_views=n_views,
            workers=workers,
            callback=batch_reporter(progress),
        )


def _items(sources: Sequence[Path]) -> list[Item]:
    items = [item for source in sources for item in _items_of(source)]
    double = next(
        (name for name, count in Counter(item.name for item in items).items() if count > 1), None
    )
    if double is not None:
        raise InvalidParameterError(
            f"Names of shapes must differ; {double!r} comes twice. Give one folder that holds both."
        )
    if not items:
        raise InvalidParameterError(
            f"There must be meshes ({', '.join(MESH_FORMATS)}) to index; {sources[0]} holds none."
        )
    return items


def _items_of(source: Path) -> Iterator[Item]:
    if not source.is_dir():
        yield Item(source.stem, source)
        return
    for path in sorted(source.rglob("*")):
        if path.suffix.lower() in MESH_FORMATS:
            below = path.relative_to(source)
            yield Item(str(below.with_suffix("")), path, below.parent.name or None)


def _print(shelf: ShapeIndex, report: BatchReport) -> None:
    out.print(
        f"{len(report.added)} described, {len(report.skipped)} indexed already, {len(report.failed)} failed; "
        f"the index holds {len(shelf)} shapes."
    )
    for name, reason in report.failed:
        out.print(f"  [yellow]{shown(name)}[/]: {shown(reason)}")
    for one, two in _doubles(shelf, report):
        out.print(f"  [yellow]{shown(two)}[/]: the same file content as {shown(one)}")


def _doubles(shelf: ShapeIndex, report: BatchReport) -> list[tuple[str, str]]:
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
