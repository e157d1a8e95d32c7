"""One BLAS thread inside a computation, whatever other threads of Python do."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

import scipy.linalg  # noqa: F401  SciPy's BLAS must be loaded before libraries are looked for
from threadpoolctl import ThreadpoolController


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS use one thread inside the block or, as a decorator, inside the function.

    Several BLAS threads cut sums where they like, so last digits would depend on how many there
    are; with busy cores they made an eigensolve take 10 to 40 times longer, and OpenBLAS has hung
    where four threads of Python called it with three threads of its own.
    """
    own = _LIMIT.begin()
    try:
        yield
    finally:
        _LIMIT.end(own)


class _Limit:
    """One thread in each BLAS library as long as any computation is under way.

    Most libraries have one number of threads for the whole process. If each computation saved and
    restored it by itself, the first of two to end would give the other its threads back, and the
    second would leave one thread behind for good. So the first to begin saves the number, and the
    last to end restores it. With OpenMP each thread of Python has a number of its own.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._n_inside = 0
        self._before: list[tuple[Any, int]] = []

    def begin(self) -> list[tuple[Any, int]]:
        """Return the libraries whose number is this thread's own, and their numbers as they were."""
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
        with self._lock:
            self._n_inside -= 1
            _set_threads(own)
            if self._n_inside == 0:
                _set_threads(self._before)


_LIMIT = _Limit()


@cache
def _blas_libraries() -> list[Any]:
    """Find the libraries of NumPy and SciPy; that takes 7 ms, setting their threads 0.06 ms."""
    return ThreadpoolController().select(user_api="blas").lib_controllers


def _is_per_thread(library: Any) -> bool:
    return getattr(library, "threading_layer", None) == "openmp"


def _set_threads(numbers: list[tuple[Any, int]]) -> None:
    for library, number in numbers:
        # From threadpoolctl 3.8 on, the first thread to set OpenBLAS's number owns it, and what
        # other threads set is ignored without a word.
        release = getattr(library, "clear_controlling_thread", lambda **_: None)
        release(force=True)
        library.set_num_threads(number)
        release(force=True)
