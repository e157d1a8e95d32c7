"""eigenshape index: describe folders of meshes and keep what they are known by."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import JsonOption, RepairOption, err, out, print_json, progress_bar, repair_names
from eigenshape.cli.features import PresetOption, preset
from eigenshape.geometry.repair import repair as repaired
from eigenshape.io.mesh_files import FORMATS, read_mesh
from eigenshape.retrieval.batch import BatchReport, Describe, Item, Workers, build_index
from eigenshape.retrieval.describe import N_VIEWS, describe_mesh, describe_views
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.store import DATABASE

SOME_FAILED = 3

DbOption = Annotated[Path, typer.Option("--db", help="Folder of the index.")]
ViewsOption = Annotated[
    int, typer.Option(min=0, max=50, help="Sides from which each closed shape is described as well, for partial scans.")
]
WorkersOption = Annotated[int, typer.Option(min=1, help="Processes that describe shapes side by side.")]


def index(
    sources: Annotated[list[Path], typer.Argument(help="Mesh files, or folders to search for them.")],
    *,
    db: DbOption,
    preset_name: PresetOption = SCALE_FREE.name,
    views: ViewsOption = N_VIEWS,
    repair: RepairOption = "",
    workers: WorkersOption = 2,
    timeout: Annotated[float, typer.Option(min=1, help="Seconds after which a file is given up.")] = 300.0,
    as_json: JsonOption = False,
) -> None:
    """Describe meshes and add them to an index; files that cannot be taken are named and the others go on.

    A shape's name is its path below the given folder, its class the folder that it lies in. After Ctrl-C or a crash
    the same command does what is left.
    """
    recipe, repairs = preset(preset_name), repair_names(repair)
    items = _items(sources)
    shelf = open_or_create(db)
    describe = partial(describe_file, recipe=recipe, repairs=repairs, n_views=views)
    report = describe_all(shelf, items, describe, recipe, Workers(workers, timeout))
    if as_json:
        print_json({"db": str(db), "shapes": len(shelf), **vars(report)})
    else:
        _print(shelf, report)
    if report.failed:
        raise typer.Exit(SOME_FAILED)


def open_or_create(folder: Path) -> ShapeIndex:
    """Open an index, or make one where there is none yet."""
    return ShapeIndex.open(folder) if (folder / DATABASE).exists() else ShapeIndex.create(folder)


def describe_all(
    shelf: ShapeIndex, items: Sequence[Item], describe: Describe, recipe: Recipe, workers: Workers
) -> BatchReport:
    """Build an index with a progress bar, naming what cannot be taken as it comes."""
    with progress_bar("index") as progress:

        def told(n_done: int, n_items: int, name: str, error: str | None) -> None:
            progress(n_done / n_items, f"{n_done} of {n_items}, {name}")
            if error is not None:
                err.print(f"[yellow]not taken:[/] {escape(name)}: {escape(error)}")

        return build_index(shelf, items, describe, recipes=(recipe,), workers=workers, told=told)


def describe_file(path: Path, *, recipe: Recipe, repairs: tuple[str, ...], n_views: int) -> list[ShapeDescriptor]:
    """Read a mesh, repair it as asked, and describe it, first whole and then as it is seen from some sides."""
    mesh = repaired(read_mesh(path), repairs).mesh
    return [describe_mesh(mesh, recipe).descriptor, *describe_views(mesh, recipe, n_views=n_views)]


def _items(sources: Sequence[Path]) -> list[Item]:
    items = [item for source in sources for item in _items_of(source)]
    double = next((name for name, count in Counter(item.name for item in items).items() if count > 1), None)
    if double is not None:
        raise InvalidParameterError(f"Names of shapes must differ; {double!r} comes twice. Give one common folder.")
    if not items:
        raise InvalidParameterError(f"There must be meshes ({', '.join(FORMATS)}) to index; {sources[0]} holds none.")
    return items


def _items_of(source: Path) -> Iterator[Item]:
    if not source.is_dir():
        yield Item(source.stem, source)
        return
    for path in sorted(source.rglob("*")):
        if path.suffix.lower() in FORMATS:
            below = path.relative_to(source)
            yield Item(str(below.with_suffix("")), path, below.parent.name or None)


def _print(shelf: ShapeIndex, report: BatchReport) -> None:
    out.print(
        f"{len(report.added)} described, {len(report.skipped)} known already, {len(report.failed)} not taken; "
        f"the index holds {len(shelf)} shapes."
    )
    for name, reason in report.failed:
        out.print(f"  [yellow]{escape(name)}[/]: {escape(reason)}")
