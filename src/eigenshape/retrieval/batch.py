"""Describe many shapes in worker processes that may die, and keep what they find."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from eigenshape._errors import EigenshapeError
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.retrieval.index import Record, ShapeIndex

Describe = Callable[[Path], Sequence[ShapeDescriptor]]
Told = Callable[[int, int, str, str | None], None]


@dataclass(frozen=True)
class Workers:
    """How many processes describe side by side, and after how many seconds a file is given up."""

    count: int = 2
    timeout: float = 300.0


@dataclass(frozen=True)
class Item:
    """A file to describe, the name it goes by, and its class where that is known."""

    name: str
    path: Path
    label: str | None = None


@dataclass(frozen=True)
class BatchReport:
    """What a batch did.

    Attributes
    ----------
    added, skipped : tuple of str
        Names that were described now, and that the index had.
    failed : tuple of (str, str)
        Name and reason of each shape that could not be taken.
    """

    added: tuple[str, ...]
    skipped: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]


def build_index(
    index: ShapeIndex,
    items: Sequence[Item],
    describe: Describe,
    *,
    recipes: Sequence[Recipe] = (SCALE_FREE,),
    workers: Workers = Workers(),
    told: Told | None = None,
) -> BatchReport:
    """Describe files side by side and add each to an index as soon as it is done.

    A file that raises, hangs or kills its process is reported, and the others go on. This process alone writes: after
    Ctrl-C or a kill the same call does only what is left. A file that the index has with the same content and recipes
    is skipped, one whose content has changed is replaced.

    Parameters
    ----------
    index : ShapeIndex
    items : sequence of Item
    describe : callable
        From a path to one descriptor for each of `recipes`; importable by name, since it runs in fresh processes.
    recipes : sequence of Recipe
        What `describe` follows.
    workers : Workers
    told : callable, optional
        Called as told(n_done, n_items, name, error or None) after each file.

    Returns
    -------
    BatchReport
        In the order of `items`, whichever was done first.
    """
    tell = told or _silent
    known = {record.name: record for record in index.records()}
    todo = [item for item in items if not _is_known(item, known.get(item.name), recipes)]
    added, failed = set(), {}
    n_done = len(items) - len(todo)
    if n_done:
        tell(n_done, len(items), "already in the index", None)
    for item, outcome in _described(todo, describe, workers):
        n_done += 1
        if isinstance(outcome, str):
            failed[item.name] = outcome
        else:
            _keep(index, item, outcome, known.get(item.name))
            added.add(item.name)
        tell(n_done, len(items), item.name, failed.get(item.name))
    names = [item.name for item in items]
    return BatchReport(
        added=tuple(name for name in names if name in added),
        skipped=tuple(name for name in names if name not in added and name not in failed),
        failed=tuple((name, failed[name]) for name in names if name in failed),
    )


def _described(todo: Sequence[Item], describe: Describe, workers: Workers) -> Iterator[tuple[Item, Any]]:
    """Yield each item with its descriptors or, as text, the reason why there are none, as they come."""
    context = multiprocessing.get_context("spawn")
    with ProcessPool(max_workers=workers.count, initializer=_start_worker, context=context) as pool:
        try:
            futures = {pool.schedule(describe, args=[item.path], timeout=workers.timeout): item for item in todo}
            for future in as_completed(futures):
                yield futures[future], _outcome(future, workers)
        except BaseException:
            pool.stop()
            raise


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's affair, which stops its workers itself
    threadpool_limits(1)


def _outcome(future: "Future[Any]", workers: Workers) -> Any:
    error = future.exception()
    if error is None:
        return list(future.result())
    if isinstance(error, TimeoutError):
        return f"it took more than {workers.timeout:g} s"
    if isinstance(error, ProcessExpired):
        return f"it ended its process with exit code {error.exitcode}"
    return str(error) if isinstance(error, EigenshapeError | OSError) else f"{type(error).__name__}: {error}"


def _keep(index: ShapeIndex, item: Item, descriptors: Sequence[ShapeDescriptor], old: Record | None) -> None:
    digest = content_digest(item.path)
    if old is not None and old.digest != digest:
        index.remove(item.name)
    index.add(item.name, descriptors, label=item.label, source=str(item.path), digest=digest)


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _is_known(item: Item, record: Record | None, recipes: Sequence[Recipe]) -> bool:
    if record is None or not set(recipes) <= set(record.recipes) or not item.path.is_file():
        return False
    return content_digest(item.path) == record.digest


def _silent(n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Tell nobody."""
