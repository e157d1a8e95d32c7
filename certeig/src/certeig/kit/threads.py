"""Threads: how many a computation may use, and one BLAS thread inside each of them."""

import itertools
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from threading import Lock, local
from typing import Any, Generic, TypeVar

import scipy.linalg  # noqa: F401  SciPy's BLAS must be loaded before libraries are looked for
from threadpoolctl import ThreadpoolController

from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer

VARIABLES = "CERTEIG_NUM_THREADS", "EIGENSHAPE_NUM_THREADS"  # the first that is set counts

A = TypeVar("A")
R = TypeVar("R")


def set_threads(n: Integer | None) -> int:
    """Set how many threads a computation may use.

    Results do not depend on the number, to the last digit: the work is divided in the same way for
    any. The environment variable EIGENSHAPE_NUM_THREADS, or CERTEIG_NUM_THREADS, sets it at the
    start. Batches of files, as of `eigenshape index add`, use processes in place of threads, with
    one thread each.

    Parameters
    ----------
    n : int or None
        At least 1. None for as many as the process has cores, which is the default, or as the
        environment variable says.

    Returns
    -------
    int
        The number that is used from now on.

    Raises
    ------
    InvalidParameterError
        If n is less than 1, or None and the environment variable is no whole number above 0.

    Examples
    --------
    >>> import certeig
    >>> certeig.set_threads(2)
    2
    >>> certeig.set_threads(None) >= 1
    True
    """
    chosen = None if n is None else whole_number(n, "n", 1)
    _NUMBER.chosen = chosen
    return thread_count()


def thread_count() -> int:
    """Return how many threads a computation may use; see `set_threads`."""
    if _NUMBER.chosen is not None:
        return _NUMBER.chosen
    variable = next((name for name in VARIABLES if os.environ.get(name, "").strip()), None)
    if variable is None:
        return usable_cores()
    text = os.environ[variable].strip()
    if not text.isdecimal() or int(text) < 1:
        raise InvalidParameterError(
            f"{variable} must be a whole number of at least 1; it is {text!r}. Unset it to use all "
            "cores."
        )
    return int(text)


def usable_cores() -> int:
    """Return how many cores this process may use, which in a container are fewer than there are."""
    if hasattr(os, "sched_getaffinity"):  # on Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_threads() -> int:
    """Return how many threads `map_in_threads` would use here: one inside of a call of it."""
    return 1 if getattr(_INSIDE, "working", False) else thread_count()


def map_in_threads(function: Callable[[A], R], items: Iterable[A]) -> list[R]:
    """Return what a function returns of each item, computed side by side, in the order of the items.

    The caller works, too, and so does as much of one team as is free: calls from several threads
    share it. Inside of it, other calls work one after the other. The first error is raised after
    all calls that have begun. Starting the team costs a tenth of a millisecond.
    """
    waiting = list(items)
    n = min(free_threads(), len(waiting))
    if n <= 1:
        return [function(item) for item in waiting]
    work = _SharedWork(function, waiting)
    with one_blas_thread():
        helpers = [_TEAM.executor(n - 1).submit(work.take_part) for _ in range(n - 1)]
        try:
            work.take_part()
        except BaseException:  # Ctrl-C: what waits is not begun
            work.stop()
            raise
        finally:
            # Those of the team who have not come yet are not needed any more.
            wait(helper for helper in helpers if not helper.cancel())
    return work.results()


def share_units(size: int, unit: int, n: int) -> list[tuple[int, int]]:
    """Divide a range from 0 to `size` into n equal shares of whole units, or fewer where there are fewer.

    What is computed of a unit must not depend on the share that it is in.
    """
    n_units = -(-size // unit)
    n = max(min(n, n_units), 1)
    ends = [min(unit * (n_units * number // n), size) for number in range(n + 1)]
    return list(pairwise(ends))


class SpareMemory(Generic[R]):
    """Memory that threads take and give back, made when none is spare."""

    def __init__(self, make: Callable[[], R]) -> None:
        self._make = make
        self._spare: list[R] = []  # to pop and to append is one step each

    @contextmanager
    def lend(self) -> Iterator[R]:
        """Lend memory for the length of the block."""
        try:
            memory = self._spare.pop()
        except IndexError:
            memory = self._make()
        yield memory
        self._spare.append(memory)

    def release(self) -> None:
        """Give back to the system what is spare."""
        self._spare.clear()


class _SharedWork(Generic[A, R]):
    """Items that several threads take one after the other until none is left."""

    def __init__(self, function: Callable[[A], R], items: list[A]) -> None:
        self._function, self._items = function, items
        self._next = itertools.count()  # `next` of it is one step that no other thread interrupts
        self._end = len(items)
        self._found: dict[int, R] = {}
        self._errors: dict[int, Exception] = {}

    def take_part(self) -> None:
        """Compute items until none is left or one has failed."""
        _INSIDE.working = True
        try:
            while (number := next(self._next)) < self._end:
                try:
                    self._found[number] = self._function(self._items[number])
                except Exception as error:  # noqa: BLE001 - whatever it is, the caller raises it
                    self._errors[number] = error
                    self.stop()
        finally:
            _INSIDE.working = False

    def stop(self) -> None:
        """Let no more items begin."""
        self._end = 0

    def results(self) -> list[R]:
        """Return the results in the order of the items, or raise the error of the first that failed."""
        if self._errors:
            raise self._errors[min(self._errors)]
        return [self._found[number] for number in range(len(self._items))]


class _Team:
    """The threads that work for `map_in_threads` beside its callers."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Start anew, as a process must to which a fork has brought no thread but one."""
        self._lock = Lock()
        self._executor: ThreadPoolExecutor | None = None
        self._size = 0

    def executor(self, size: int) -> ThreadPoolExecutor:
        """Return an executor of at least this many threads."""
        with self._lock:
            if self._executor is None or self._size < size:
                # Threads of a smaller team end when they have nothing left to do.
                self._executor = ThreadPoolExecutor(size, initializer=_limit_own_blas)
                self._size = size
            return self._executor


def _limit_own_blas() -> None:
    """Set libraries that have a number for each thread to one."""
    _set_threads([(library, 1) for library in _blas_libraries() if _is_per_thread(library)])


class _Number:
    """The number of threads that `set_threads` chose."""

    chosen: int | None = None


_NUMBER = _Number()
_TEAM = _Team()
_INSIDE = local()  # whether a thread works for `map_in_threads`
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_TEAM.forget)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread inside the block or, as a decorator, inside the function.

    - With several threads the last digits of sums would depend on the number of threads.
    - On busy cores several threads made an eigensolve take 10 to 40 times longer.
    - OpenBLAS has hung when four Python threads called it with three threads of its own.
    """
    own = _LIMIT.begin()
    try:
        yield
    finally:
        _LIMIT.end(own)


class _Limit:
    """Keeps each BLAS library at one thread while any computation is running.

    Most libraries have one number of threads for the whole process. If each computation saved and
    restored it, the first of two to end would give the other several threads, and the second would
    leave the process with one thread. So the first to begin saves the number, and the last to end
    restores it. With OpenMP each Python thread has its own number.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._n_inside = 0
        self._before: list[tuple[Any, int]] = []

    def begin(self) -> list[tuple[Any, int]]:
        """Begin a computation; return the libraries with a number per thread, and these numbers."""
        with self._lock:
            numbers = [(library, library.get_num_threads()) for library in _blas_libraries()]
            own = [pair for pair in numbers if _is_per_thread(pair[0])]
            shared = [pair for pair in numbers if not _is_per_thread(pair[0])]
            if self._n_inside == 0:
                self._before = shared
            self._n_inside += 1
            _set_threads([(library, 1) for library, _ in numbers])
        return own

    def end(self, own: list[tuple[Any, int]]) -> None:
        """End a computation, given what `begin` returned."""
        with self._lock:
            self._n_inside -= 1
            _set_threads(own)
            if self._n_inside == 0:
                _set_threads(self._before)


_LIMIT = _Limit()


@cache
def _blas_libraries() -> list[Any]:
    """Find the BLAS libraries of NumPy and SciPy.

    This takes 7 ms, and setting their threads 0.06 ms, so the result is cached.
    """
    return ThreadpoolController().select(user_api="blas").lib_controllers


def _is_per_thread(library: Any) -> bool:
    return getattr(library, "threading_layer", None) == "openmp"


def _set_threads(numbers: list[tuple[Any, int]]) -> None:
    for library, number in numbers:
        # From threadpoolctl 3.8 on, the first thread that sets the number of OpenBLAS owns it, and
        # values set by other threads are silently ignored unless the ownership is released.
        release = getattr(library, "clear_controlling_thread", lambda **_: None)
        release(force=True)
        library.set_num_threads(number)
        release(force=True)
