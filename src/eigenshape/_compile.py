"""Compiled loops: numba's njit, which keeps its results wherever this machine lets it."""

import os
import stat
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserWideCacheLocator


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function without the GIL, and keep the result on disk if there is a folder for it.

    numba alone keeps results beside the source or in the user's home, and refuses to be imported
    where neither can be written to, as in many containers and on clusters. Here a private folder in
    the temporary folder serves next; where even that fails, nothing is kept, and a warning says so.

    Parameters
    ----------
    function : callable, optional
        Without it, a decorator with the options is returned.
    **options
        As those of `numba.njit`.
    """
    if function is None:
        return lambda wanted: njit(wanted, **options)
    dispatcher = numba.njit(nogil=True, **options)(function)
    try:
        dispatcher._cache = _LoopCache(dispatcher.py_func)
    except RuntimeError:  # no locator found a folder
        _warn_once(
            "Compiled loops must be kept in a folder that can be written to; there is none, so each "
            "process compiles them anew, some seconds each time."
        )
    return dispatcher


@cache
def _warn_once(what: str) -> None:
    warnings.warn(f"{what} Set NUMBA_CACHE_DIR to such a folder.", stacklevel=2)


class _PrivateFolder(UserWideCacheLocator):  # type: ignore[misc]
    """A folder of this user's in the temporary folder."""

    def get_cache_path(self) -> str:
        return str(temporary_folder() / Path(super().get_cache_path()).name)

    def ensure_cache_path(self) -> None:
        make_private(temporary_folder())
        super().ensure_cache_path()


class _LoopCacheFiles(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (*CompileResultCacheImpl._locator_classes, _PrivateFolder)


class _LoopCache(FunctionCache):  # type: ignore[misc]
    _impl_class = _LoopCacheFiles

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a result; on a full disk it is used all the same, and compiled again next time."""
        try:
            super().save_overload(signature, result)
        except OSError as error:
            reason = error.strerror or type(error).__name__
            _warn_once(f"Compiled loops must be kept in a folder with space left; {reason}.")


def temporary_folder() -> Path:
    """Return where this user's compiled loops lie when nowhere else is a place for them."""
    user = os.getuid() if hasattr(os, "getuid") else "loops"
    return Path(tempfile.gettempdir()) / f"eigenshape-{user}"


def make_private(folder: Path) -> None:
    """Make a folder that nobody else may write to: what is kept there is unpickled, which can run any code.

    Raises
    ------
    PermissionError
        If it is there already and is a link, or belongs to somebody else, or is open to others.
    """
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    mine = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    if not (stat.S_ISDIR(found.st_mode) and mine):
        raise PermissionError(
            f"A folder of compiled loops must belong to its user alone; {folder} does not."
        )
