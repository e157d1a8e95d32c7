"""Files opened with care and replaced whole."""

import os
import stat
import tempfile
from pathlib import Path

from eigenshape._errors import FileFormatError


def read_regular(path: Path) -> bytes:
    """Read a whole file, refusing what is not one: a folder, a pipe or a device could hang or never end.

    Raises
    ------
    FileNotFoundError, PermissionError
        As the system says.
    FileFormatError
        If the path is no regular file, or is empty.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        kind = os.fstat(descriptor).st_mode
        if not stat.S_ISREG(kind):
            raise FileFormatError(f"{path} must be a regular file; it is {_named(kind)}.")
        data = file.read()
    if not data:
        raise FileFormatError(f"{path} must hold a mesh; it is empty.")
    return data


def _named(mode: int) -> str:
    kinds = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
    return kinds.get(stat.S_IFMT(mode), "something else")


def replace_file(path: Path, data: bytes) -> None:
    """Write a file beside its place and move it there, so that nobody ever sees half of it."""
    handle, beside = tempfile.mkstemp(dir=path.parent or Path(), prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(beside).chmod(0o666 & ~_umask())
        Path(beside).replace(path)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
