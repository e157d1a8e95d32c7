"""One BLAS thread inside a computation, also if several Python threads compute."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

import scipy.linalg  # noqa: F401  SciPy's BLAS must be loaded before libraries are looked for
from threadpoolctl import ThreadpoolController


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
