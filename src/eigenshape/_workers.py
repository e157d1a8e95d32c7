"""Run a function on files in worker processes, which may die."""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Generic, TypeVar

from pebble import ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, whole_number
from certeig.kit.errors import CerteigError
from certeig.kit.memory import machine_memory
from certeig.kit.text import html_repr, repr_of_changes
from certeig.kit.threads import set_threads, thread_count

T = TypeVar("T")
P = TypeVar("P")
R = TypeVar("R")
NO_WORKERS = (
    "Worker processes import the script that starts them, and must reach its end; all of them "
    "ended before they took a file. Put what the script does, from its first call of eigenshape "
    'on, under `if __name__ == "__main__":`, and define the function that reads files above it.'
)


# Files of one task of an executor, at most. Each task starts a process of its own, which takes about
# two seconds to load the library: a twentieth of what it takes to describe so many files. Fewer files
# than this many tasks have a task each, so that they go to as many workers.
FILES_A_TASK, MOST_SMALL_TASKS = 32, 64
FILES_AHEAD = 4  # files for each worker that wait for it, or whose results wait for us
TASKS_AHEAD = 1024  # the same for all workers of an executor, in tasks: a task takes some 40 KB
SECONDS_BETWEEN_LOOKS = 1.0  # after which the process of a task looks whether its worker lives


@dataclass(frozen=True)
class Workers:
    """The processes that describe files: how many, and what each file may take.

    Parameters
    ----------
    count : int
        Processes, of one thread each. By default as many as there are cores (`thread_count`). With
        an executor, its own workers count instead.
    timeout : float
        Seconds after which a file is given up.
    memory : float, optional
        Bytes that a process may use; a file that needs more is given up. By default each process
        has an equal share of the memory of the machine. Not limited on macOS and Windows.
    executor : concurrent.futures.Executor, optional
        Runs the work in place of processes of this machine: a cluster's, for example. Each task
        describes 1 to 32 files in a process of its own, under the same limits, so a file that
        kills its process costs the executor no worker. Workers must see the same files and have
        the same eigenshape.

    Raises
    ------
    InvalidParameterError
        If a number is not positive.

    See Also
    --------
    build_index, train_codebook_from_files

    Examples
    --------
    >>> import eigenshape as es
    >>> es.retrieval.Workers(count=4).timeout
    300.0
    """

    count: int = field(default_factory=thread_count)
    timeout: float = 300.0
    memory: float | None = None
    executor: Executor | None = None

    __repr__ = repr_of_changes
    _repr_html_ = html_repr

    def __post_init__(self) -> None:
        require_type(self.executor, Executor | None, "executor")
        whole_number(self.count, "count", 1)
        positive_values([self.timeout], "timeout")
        if self.memory is not None:
            positive_values([self.memory], "memory")


@dataclass(frozen=True)
class Item:
    """A file to describe, with the name and the class of its shape.

    Parameters
    ----------
    name : str
        Unique in the index.
    path : Path
    label : str, optional
        Class of the shape.
    tags : tuple of str
    attributes : mapping of str to float or str
        Further facts, by which queries can be restricted.

    See Also
    --------
    find_items, build_index, train_codebook_from_files

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
    tags: tuple[str, ...] = ()
    attributes: Mapping[str, float | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_type(self.name, str, "name")

    __repr__ = repr_of_changes
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

    Raise CerteigError if no worker can start, as in a script without a main guard.
    """
    if workers.executor is not None:
        yield from _run_in_executor(work, items, workers.executor, workers)
        return
    pool = start_pool(workers, max(min(workers.count, len(items)), 1))

    def submit(item: Item) -> "Future[Outcome[T]]":
        try:
            return schedule_work(pool, work, item.path, workers)
        except RuntimeError as error:  # the pool has given up starting workers
            raise CerteigError(NO_WORKERS) from error

    try:
        n_ahead = FILES_AHEAD * workers.count
        for number, (item, future) in enumerate(_as_finished(submit, items, n_ahead, {})):
            if number == 0:
                _require_started(future)
            yield item, outcome_of(future, workers)
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()


def _as_finished(
    submit: Callable[[P], "Future[R]"],
    pieces: Iterable[P],
    n_ahead: int,
    futures: "dict[Future[R], P]",
) -> Iterator[tuple[P, "Future[R]"]]:
    """Yield pieces of work with their futures as these finish; `futures` holds those that are not.

    Only some pieces are submitted ahead: the results of a million would fill the memory.
    """
    left = iter(pieces)
    futures.update((submit(piece), piece) for piece in islice(left, n_ahead))
    while futures:
        for future in wait(futures, return_when=FIRST_COMPLETED).done:
            piece = futures.pop(future)
            futures.update((submit(following), following) for following in islice(left, 1))
            yield piece, future


def start_pool(
    workers: Workers, count: int, prepare: Callable[[], object] | None = None
) -> ProcessPool:
    """Start worker processes, and the threads that replace those that die.

    Parameters
    ----------
    workers : Workers
        Of which the memory counts.
    count : int
        Processes.
    prepare : callable, optional
        Called in each new process before its first work. It must not raise.
    """
    # A worker that is still importing its script would start workers in turn; multiprocessing itself
    # tells by this attribute. It ends without a message: the process that waits for it has the reason.
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)
    pool = ProcessPool(
        max_workers=count,
        initializer=_start_worker,
        initargs=[_memory_of_each(workers), prepare],
        context=multiprocessing.get_context("spawn"),
    )
    try:
        with _ctrl_c_deferred():
            _ = pool.active  # starts them
    except BaseException:
        pool.stop()
        pool.join()
        raise
    return pool


def schedule_work(
    pool: ProcessPool, work: Callable[[Path], T], path: Path, workers: Workers
) -> "Future[Outcome[T]]":
    """Call a function on a path in a worker; `outcome_of` tells what came of it."""
    return pool.schedule(_work, args=[work, path], timeout=workers.timeout)


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


def _require_started(first: "Future[Outcome[T]]") -> None:
    if isinstance(first.exception(), BrokenProcessPool):
        raise CerteigError(NO_WORKERS) from first.exception()


def _memory_of_each(workers: Workers) -> int | None:
    """Return the bytes that each process may use, or None where the system cannot tell or limit."""
    if workers.memory is not None:
        return int(workers.memory)
    if sys.platform != "linux":
        return None
    return int(machine_memory()) // workers.count


def _start_worker(memory: int | None, prepare: Callable[[], object] | None) -> None:
    if memory is not None and sys.platform == "linux":
        import resource  # noqa: PLC0415  there is none on Windows

        # Data and not addresses: a math library reserves far more of those than it ever uses.
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it could not be blocked
    threading.Thread(target=_die_with_parent, daemon=True).start()
    # A warning names its file; the line of our code that gave it tells a user nothing.
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    threadpool_limits(1)
    set_threads(1)
    if prepare is not None:
        prepare()


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # a killed parent cannot stop its workers, and waits for no answer


def _work(work: Callable[[Path], T], path: Path) -> Outcome[T]:
    """Call `work` in a worker, and turn any error into text, which can always be pickled."""
    try:
        return Outcome(work(path))
    except MemoryError:
        return Outcome(error="it needs more memory than a worker may use")
    except Exception as err:  # noqa: BLE001  one that cannot be pickled would break the whole pool
        known = isinstance(err, CerteigError | OSError)
        return Outcome(error=str(err) if known else f"{type(err).__name__}: {err}")


def outcome_of(future: "Future[Outcome[T]]", workers: Workers) -> Outcome[T]:
    """Return what a worker returned, or why it did not, when the future is done."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, TimeoutError):
        return Outcome(error=f"it took more than {workers.timeout:g} s")
    if isinstance(error, ProcessExpired):
        return Outcome(error=f"it ended its process with exit code {error.exitcode}")
    return Outcome(error=f"{type(error).__name__}: {error}")


def _run_in_executor(
    work: Callable[[Path], T], items: Sequence[Item], executor: Executor, workers: Workers
) -> Generator[tuple[Item, Outcome[T]], None, None]:
    """Yield items with their outcomes, from tasks of an executor."""
    each = replace(workers, count=1, executor=None)
    tasks: dict[Future[bytes], Sequence[Item]] = {}

    def submit(files: Sequence[Item]) -> "Future[bytes]":
        return executor.submit(run_apart, pickle.dumps((work, files, each)))

    n_files = min(max(len(items) // MOST_SMALL_TASKS, 1), FILES_A_TASK)
    pieces = (items[start : start + n_files] for start in range(0, len(items), n_files))
    try:
        for files, task in _as_finished(submit, pieces, TASKS_AHEAD, tasks):
            error = task.exception()
            if error is None:
                yield from pickle.loads(task.result())
                continue
            lost: Outcome[T] = Outcome(error=f"its task was lost: {type(error).__name__}: {error}")
            yield from ((item, lost) for item in files)
    finally:
        for task in tasks:
            task.cancel()


def run_apart(order: bytes) -> bytes:
    """Carry out the work of a task in a new process, and return its pickled outcomes.

    A worker of an executor may be forbidden to have children of multiprocessing, as those of Dask
    are, and must not be killed by a file.
    """
    command = [sys.executable, "-c", f"from {__name__} import main; main()"]
    # What this worker can import, the process can import too.
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        command, input=order, stdout=subprocess.PIPE, env=environment, check=False
    )
    if done.returncode:
        raise CerteigError(
            "A task must run in a process of its own; the process ended with exit code "
            f"{done.returncode}. See the log of the worker for its error. The function that reads "
            "files must be in a module that workers can import."
        )
    return done.stdout


def main() -> None:
    """Take an order from stdin, run it in a worker process, and write the outcomes to stdout."""
    threading.Thread(target=_die_with, args=[os.getppid()], daemon=True).start()
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a file's reader prints is no answer
    work, items, workers = pickle.load(sys.stdin.buffer)
    with answers:
        pickle.dump(list(run_in_workers(work, items, workers)), answers)


def _die_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(SECONDS_BETWEEN_LOOKS)
    os._exit(1)
