"""Worker processes that may die: what each file gave, or why it gave nothing."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from pebble import ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import EigenshapeError

T = TypeVar("T")


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
class Outcome(Generic[T]):
    """What a file gave, or the reason why it gave nothing."""

    found: T | None = None
    reason: str | None = None


def in_workers(
    work: Callable[[Path], T], items: Sequence[Item], workers: Workers
) -> Generator[tuple[Item, Outcome[T]], None, None]:
    """Yield each item with what `work`, importable by name, made of its path, as they come.

    Close the generator to stop all workers at once.
    """
    context = multiprocessing.get_context("spawn")
    count = max(min(workers.count, len(items)), 1)
    with ProcessPool(max_workers=count, initializer=_start_worker, context=context) as pool:
        try:
            futures = {pool.schedule(_work, args=[work, item.path], timeout=workers.timeout): item for item in items}
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


def _work(work: Callable[[Path], T], path: Path) -> Outcome[T]:
    """Work in a worker; only what surely survives the way back is returned."""
    try:
        return Outcome(work(path))
    except Exception as err:  # noqa: BLE001  an error that cannot be pickled would take the whole pool with it
        known = isinstance(err, EigenshapeError | OSError)
        return Outcome(reason=str(err) if known else f"{type(err).__name__}: {err}")


def _outcome(future: "Future[Outcome[T]]", workers: Workers) -> Outcome[T]:
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, TimeoutError):
        return Outcome(reason=f"it took more than {workers.timeout:g} s")
    if isinstance(error, ProcessExpired):
        return Outcome(reason=f"it ended its process with exit code {error.exitcode}")
    return Outcome(reason=f"{type(error).__name__}: {error}")
