"""Run a function on files in worker processes, which may die."""

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
from eigenshape._text import html_repr

T = TypeVar("T")
NO_WORKERS = (
    "Worker processes import the script that starts them, and must reach its end; all of them "
    "ended before they took a file. Put what the script does, from its first call of eigenshape "
    'on, under `if __name__ == "__main__":`, and define the function that reads files above it.'
)


@dataclass(frozen=True)
class Workers:
    """How many processes describe files at the same time, and for how long each may take.

    Parameters
    ----------
    count : int
        Processes.
    timeout : float
        Seconds after which a file is given up.

    See Also
    --------
    build_index, train_codebook_from_files

    Examples
    --------
    >>> import eigenshape as es
    >>> es.retrieval.Workers(count=4)
    Workers(count=4, timeout=300.0)
    """

    count: int = 2
    timeout: float = 300.0

    _repr_html_ = html_repr

    def __post_init__(self) -> None:
        whole_number(self.count, "count", 1)
        positive_values([self.timeout], "timeout")


@dataclass(frozen=True)
class Item:
    """A file to describe, with the name and the class of its shape.

    Parameters
    ----------
    name : str
        Unique in the index.
    path : Path
    label : str, optional

    See Also
    --------
    build_index, train_codebook_from_files

    Examples
    --------
    >>> from pathlib import Path
    >>> import eigenshape as es
    >>> es.retrieval.Item("felix", Path("cats/felix.ply"), label="cat").name
    'felix'
    """

    name: str
    path: Path
    label: str | None = None

    _repr_html_ = html_repr


@dataclass(frozen=True)
class Outcome(Generic[T]):
    """The result of a function on one file, or the reason why there is none."""

    value: T | None = None
    error: str | None = None


def run_in_workers(
    work: Callable[[Path], T], items: Sequence[Item], workers: Workers
) -> Generator[tuple[Item, Outcome[T]], None, None]:
    """Yield each item with the outcome of `work` on its path, in the order in which they finish.

    A new process must be able to import `work` by name. Close the generator to stop all workers at
    once.

    Raises
    ------
    EigenshapeError
        If no worker can start, as in a script without a main guard.
    """
    _require_main_guard()
    context = multiprocessing.get_context("spawn")
    count = max(min(workers.count, len(items)), 1)
    pool = ProcessPool(max_workers=count, initializer=_start_worker, context=context)
    try:
        with _ctrl_c_deferred():
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
def _ctrl_c_deferred() -> Iterator[None]:
    """Start processes and threads with Ctrl-C blocked; if it was pressed, raise it at the end.

    Processes and threads inherit the mask of blocked signals, so Ctrl-C never reaches a worker:
    the parent stops its workers. A worker whose parent stops while starting it would print a
    traceback.
    """
    resource_tracker.ensure_running()  # its start, by multiprocessing, would unblock Ctrl-C
    with _ctrl_c_masked(), _ctrl_c_held():
        yield


@contextmanager
def _ctrl_c_masked() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Hold Ctrl-C until the end of the block: a BLAS thread may receive it if this one does not."""
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
    """End a worker that is still importing its script, and would start workers in turn.

    It ends without a message: the process that waits for it reports the reason.
    """
    # multiprocessing itself tells by this attribute.
    if getattr(multiprocessing.current_process(), "_inheriting", False):
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
        os._exit(1)  # a killed parent cannot stop its workers, and waits for no answer


def _work(work: Callable[[Path], T], path: Path) -> Outcome[T]:
    """Call `work` in a worker, and turn any error into text, which can always be pickled."""
    try:
        return Outcome(work(path))
    except Exception as err:  # noqa: BLE001  one that cannot be pickled would break the whole pool
        known = isinstance(err, EigenshapeError | OSError)
        return Outcome(error=str(err) if known else f"{type(err).__name__}: {err}")


def _outcome(future: "Future[Outcome[T]]", workers: Workers) -> Outcome[T]:
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, TimeoutError):
        return Outcome(error=f"it took more than {workers.timeout:g} s")
    if isinstance(error, ProcessExpired):
        return Outcome(error=f"it ended its process with exit code {error.exitcode}")
    return Outcome(error=f"{type(error).__name__}: {error}")
