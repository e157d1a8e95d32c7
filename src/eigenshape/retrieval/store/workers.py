"""Worker processes that may die: what each file gave, or why it gave nothing."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Generic, TypeVar

from pebble import ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import EigenshapeError

T = TypeVar("T")
NO_WORKERS = (
    "Worker processes import the script that starts them, and must come to its end; all of them ended before they took "
    'a file. Put what the script does, from its first call of eigenshape on, under `if __name__ == "__main__":`.'
)


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

    Raises
    ------
    EigenshapeError
        If no worker can start, as in a script that has no main guard.
    """
    _require_main_guard()
    context = multiprocessing.get_context("spawn")
    count = max(min(workers.count, len(items)), 1)
    pool = ProcessPool(max_workers=count, initializer=_start_worker, context=context)
    try:
        with _sigint_deferred():
            _ = pool.active  # starts the processes, and the threads that replace those that die
        futures = {
            pool.schedule(_work, args=[work, item.path], timeout=workers.timeout): item
            for item in items
        }
        for number, future in enumerate(as_completed(futures)):
            if number == 0:
                _require_started(future)
            yield futures[future], _outcome(future, workers)
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()


@contextmanager
def _sigint_deferred() -> Iterator[None]:
    """Start processes and threads with Ctrl-C blocked, and raise what came meanwhile at the end of the block.

    Processes and threads inherit the mask of blocked signals, so that Ctrl-C never reaches a worker: the parent stops
    its workers. A worker whose parent stops halfway through starting it would print a traceback.
    """
    resource_tracker.ensure_running()  # Python's helper of processes, whose start would unblock Ctrl-C
    with _mask_of_sigint(), _handler_of_sigint():
        yield


@contextmanager
def _mask_of_sigint() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _handler_of_sigint() -> Iterator[None]:
    """Keep Ctrl-C until the end of the block: a thread of BLAS may take it though this thread blocks it."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupted = threading.Event()
    signal.signal(signal.SIGINT, lambda _number, _frame: interrupted.set())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if interrupted.is_set():
            signal.raise_signal(signal.SIGINT)


def _require_main_guard() -> None:
    """End a worker that is still importing the script that started it, and would start workers in turn.

    Quietly: the process that waits for it says why.
    """
    if getattr(
        multiprocessing.current_process(), "_inheriting", False
    ):  # as multiprocessing itself tells
        raise SystemExit(1)


def _require_started(first: "Future[Outcome[T]]") -> None:
    if isinstance(first.exception(), BrokenProcessPool):
        raise EigenshapeError(NO_WORKERS) from first.exception()


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it could not be blocked
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
