"""Finding the meshes of folders, and adding them to an index."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from eigenshape._errors import InvalidParameterError
from eigenshape._workers import Item, Workers
from eigenshape.cli.console import batch_reporter, progress_bar
from eigenshape.cli.steps.reading import read_repaired
from eigenshape.io.parsing import MESH_FORMATS
from eigenshape.retrieval.kinds import AnyRecipe
from eigenshape.retrieval.store.batch import BatchReport, build_index
from eigenshape.retrieval.store.index import ShapeIndex


def find_items(sources: Sequence[Path]) -> list[Item]:
    """Return the meshes of files and folders, each with its name and class.

    Raises
    ------
    InvalidParameterError
        If two have the same name, or there are none.
    """
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
