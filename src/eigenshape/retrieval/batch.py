"""Describe many shapes in worker processes that may die, and keep what they find."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, as_completed
from contextlib import closing
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path

from pebble import ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.retrieval.index import Record, ShapeIndex

Describe = Callable[[Path], Sequence[ShapeDescriptor]]
Told = Callable[[int, int, str, str | None], None]


@dataclass(frozen=True)
class Workers:
    """How many processes describe side by side, and after how many seconds a file is given up."""

    count: int = 2
    timeout: float = 300.0

    def __post_init__(self) -> None:
        whole_number(self.count, "count", 1)
        positive_values([self.timeout], "timeout")


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


@dataclass(frozen=True)
class _Described:
    digest: str
    descriptors: tuple[ShapeDescriptor, ...]


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
    is skipped, one whose content has changed is replaced in one step.

    Parameters
    ----------
    index : ShapeIndex
    items : sequence of Item
    describe : callable
        From a path to descriptors of each of `recipes`; importable by name, since it runs in fresh processes.
    recipes : sequence of Recipe
        What `describe` follows.
    workers : Workers
    told : callable, optional
        Called as told(n_done, n_items, name, error or None) after each file.

    Returns
    -------
    BatchReport
        In the order of `items`, whichever was done first.

    Raises
    ------
    InvalidParameterError
        If two items have one name.
    StoreError
        If the index cannot be written.
    """
    _require_names(items)
    tell = told or _silent
    known = {record.name: record for record in index.records()}
    todo = [item for item in items if not _is_known(item, known.get(item.name), recipes)]
    added, failed = set(), {}
    n_done = len(items) - len(todo)
    if n_done:
        tell(n_done, len(items), "already in the index", None)
    with closing(_described(todo, describe, recipes, workers)) as outcomes:  # closed at once, also after Ctrl-C
        for item, outcome in outcomes:
            n_done += 1
            reason = outcome if isinstance(outcome, str) else _keep(index, item, outcome)
            if reason is None:
                added.add(item.name)
            else:
                failed[item.name] = reason
            tell(n_done, len(items), item.name, reason)
    names = [item.name for item in items]
    return BatchReport(
        added=tuple(name for name in names if name in added),
        skipped=tuple(name for name in names if name not in added and name not in failed),
        failed=tuple((name, failed[name]) for name in names if name in failed),
    )


def _require_names(items: Sequence[Item]) -> None:
    paths: dict[str, Path] = {}
    for item in items:
        if item.name in paths:
            raise InvalidParameterError(
                f"Items must have different names; {item.name!r} is both {paths[item.name]} and {item.path}."
            )
        paths[item.name] = item.path


def _described(
    todo: Sequence[Item], describe: Describe, recipes: Sequence[Recipe], workers: Workers
) -> Generator[tuple[Item, _Described | str], None, None]:
    """Yield each item with what was found or, as text, the reason why nothing was, as they come."""
    context = multiprocessing.get_context("spawn")
    count = max(min(workers.count, len(todo)), 1)
    with ProcessPool(max_workers=count, initializer=_start_worker, context=context) as pool:
        try:
            futures = {
                pool.schedule(_work, args=[describe, item.path, tuple(recipes)], timeout=workers.timeout): item
                for item in todo
            }
            for future in as_completed(futures):
                yield futures[future], _outcome(future, workers)
        except BaseException:
            pool.stop()
            raise


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's affair, which stops its workers itself
    threading.Thread(target=_die_with_parent, daemon=True).start()
    threadpool_limits(1)


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # killed, it can stop nobody, and nobody waits for the answer


def _work(describe: Describe, path: Path, recipes: tuple[Recipe, ...]) -> _Described | str:
    """Describe a file in a worker; only what surely survives the way back is returned."""
    try:
        digest = content_digest(path)  # before it is read: a file that changes meanwhile is done again next time
        descriptors = tuple(describe(path))
        _require_described(descriptors, recipes)
    except Exception as err:  # noqa: BLE001  an error that cannot be pickled would take the whole pool with it
        return str(err) if isinstance(err, EigenshapeError | OSError) else f"{type(err).__name__}: {err}"
    return _Described(digest, descriptors)


def _require_described(descriptors: tuple[ShapeDescriptor, ...], recipes: tuple[Recipe, ...]) -> None:
    for found in descriptors:
        if not isinstance(found, ShapeDescriptor):
            raise InvalidParameterError(f"A describer must return descriptors; it returned {type(found).__name__}.")
    there = {found.recipe for found in descriptors}
    for recipe in recipes:
        if recipe not in there:
            raise InvalidParameterError(f"A describer must follow every recipe; {recipe.name!r} has no descriptor.")


def _outcome(future: "Future[_Described | str]", workers: Workers) -> _Described | str:
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, TimeoutError):
        return f"it took more than {workers.timeout:g} s"
    if isinstance(error, ProcessExpired):
        return f"it ended its process with exit code {error.exitcode}"
    return f"{type(error).__name__}: {error}"


def _keep(index: ShapeIndex, item: Item, found: _Described) -> str | None:
    """Add a shape; the reason, where the index does not take it."""
    known = {"label": item.label, "source": str(item.path), "digest": found.digest}
    try:
        index.add(item.name, found.descriptors, **known, replace=True)
    except InvalidParameterError as err:
        return str(err)
    return None


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _is_known(item: Item, record: Record | None, recipes: Sequence[Recipe]) -> bool:
    if record is None or not set(recipes) <= set(record.recipes):
        return False
    try:
        return content_digest(item.path) == record.digest
    except OSError:  # a worker will say so
        return False


def _silent(n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Tell nobody."""
