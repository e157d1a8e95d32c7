"""Compiled loops: numba's njit, which keeps its results wherever this machine lets it."""

import gc
import hashlib
import multiprocessing
import os
import pickle
import stat
import sys
import tempfile
import warnings
import weakref
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import event
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserWideCacheLocator,
)

from eigenshape._version import __version__

# What must be the same for a compiled loop to be loaded. The key of a loop adds the CPU and its
# features, and the stamp of its source adds the time and size of that file.
MADE_BY = f"{sys.version} {numba.__version__} {llvmlite.__version__} {np.__version__} {__version__}"
DIGEST_BYTES = 16

_LOOPS: weakref.WeakSet[Any] = (
    weakref.WeakSet()
)  # all that `njit` has made, apart from loops of other packages


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
    # Nothing calls our loops from C, and without the wrapper for it they compile 5 % faster.
    dispatcher = numba.njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
    _LOOPS.add(dispatcher)
    try:
        dispatcher._cache = _LoopCache(dispatcher.py_func)
    except RuntimeError:  # no locator found a folder
        _warn_once(
            "Compiled loops must be kept in a folder that can be written to; there is none, so each "
            "process compiles them anew, some seconds each time."
        )
    return dispatcher


class _CompilationListener(event.Listener):  # type: ignore[misc]
    """What happens while a loop of ours compiles, which one that is loaded from the disk never does.

    The garbage collector pauses: it would go through the thousands of objects that the compiler
    keeps again and again, for an eighth of all its time. numba compiles one function at a time,
    under a lock; those that one calls are compiled within it.
    """

    def __init__(self) -> None:
        self.depth = 0
        self.collects = False
        self.noticed = False

    def on_start(self, event: Any) -> None:
        """Pause the garbage collector, and print what takes so long; once, and only to a terminal."""
        if not _is_ours(event):
            return
        self.depth += 1
        if self.depth > 1:
            return
        self.collects = gc.isenabled()
        gc.disable()
        if not self.noticed:
            self.noticed = True
            # To a terminal, and only from the process that the user started
            if (
                multiprocessing.parent_process() is None
                and sys.stderr is not None
                and sys.stderr.isatty()
            ):
                sys.stderr.write(
                    "eigenshape compiles its loops the first time that they run; this takes some seconds.\n"
                )
                sys.stderr.flush()

    def on_end(self, event: Any) -> None:
        """Let the garbage collector run again."""
        if not _is_ours(event):
            return
        self.depth -= 1
        if not self.depth and self.collects:
            gc.enable()


def _is_ours(event: Any) -> bool:
    return event.data["dispatcher"] in _LOOPS


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


class _CheckedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """The index and the compiled code of one loop, each behind a checksum of it and of `MADE_BY`.

    numba unpickles and runs what it finds: a cut index ends in a traceback, and one flipped bit in
    compiled code in a segmentation fault. Here a file that does not agree with its checksum counts
    as absent, so that the loop is compiled again and the file is replaced.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep compiled code with the source and the types that it was made for.

        Two processes that compile one loop for different types can give both results one name.
        """
        super().save(key, (self._source_stamp, key, data))

    def load(self, key: Any) -> Any:
        stamp, kept_key, data = super().load(key) or (None, None, None)
        return data if (stamp, kept_key) == (self._source_stamp, key) else None

    def _load_index(self) -> dict[Any, str]:
        stamp, names = self._read(self._index_path) or (None, {})
        return names if stamp == self._source_stamp else {}

    def _save_index(self, names: dict[Any, str]) -> None:
        with self._open_for_write(self._index_path) as file:
            file.write(self._dump((self._source_stamp, names)))

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _dump(self, value: Any) -> bytes:
        content = super()._dump(value)
        return _digest(content) + content

    def _read(self, path: str) -> Any:
        """Return what was kept in a file, or None if it is missing, damaged or of other versions."""
        try:
            kept = Path(path).read_bytes()
        except OSError:
            return None
        digest, content = kept[:DIGEST_BYTES], kept[DIGEST_BYTES:]
        return pickle.loads(content) if digest == _digest(content) else None


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(MADE_BY.encode() + content, digest_size=DIGEST_BYTES).digest()


class _LoopCache(FunctionCache):  # type: ignore[misc]
    _impl_class = _LoopCacheFiles

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = _CheckedFiles(
            self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp()
        )

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a result; on a full disk it is used all the same, and compiled again next time."""
        try:
            super().save_overload(signature, result)
        except OSError as error:
            reason = error.strerror or type(error).__name__
            _warn_once(f"Compiled loops must be kept in a folder with space left; {reason}.")


def cache_folder() -> Path | None:
    """Return the folder that holds all compiled loops which were loaded; None if none are kept."""
    caches = (getattr(loop, "_cache", None) for loop in _LOOPS)
    paths = [cache.cache_path for cache in caches if isinstance(cache, _LoopCache)]
    return Path(os.path.commonpath(paths)) if paths else None


def temporary_folder() -> Path:
    """Return where this user's compiled loops lie when nowhere else is a place for them."""
    user = os.getuid() if hasattr(os, "getuid") else "loops"
    return Path(tempfile.gettempdir()) / f"eigenshape-{user}"


def make_private(folder: Path) -> None:
    """Make a folder that nobody else may write to: what is kept there is unpickled, which can run any code.

    Raise PermissionError if the folder is there and is a link, belongs to somebody else, or is open
    to others.
    """
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    mine = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    if not (stat.S_ISDIR(found.st_mode) and mine):
        raise PermissionError(
            f"A folder of compiled loops must belong to its user alone; {folder} does not."
        )


event.register("numba:compile", _CompilationListener())
