"""Files read with care and replaced whole."""

import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from eigenshape._errors import FileFormatError


def read_regular(path: Path, what: str = "a mesh") -> bytes:
    """Read a whole file, refusing what is not one: a folder, a pipe or a device could hang or never end.

    Raises
    ------
    FileNotFoundError, PermissionError
        As the system says.
    FileFormatError
        If the path is no regular file, or is empty.
    """
    require_regular(path)
    data = path.read_bytes()
    if not data:
        raise FileFormatError(f"{path} must hold {what}; it is empty.")
    return data


def require_regular(path: Path) -> None:
    """Refuse a path that is there and is no regular file.

    Raises
    ------
    FileNotFoundError, PermissionError
        As the system says.
    FileFormatError
        With what it is instead.
    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode):
        kinds = {
            stat.S_IFDIR: "a folder",
            stat.S_IFIFO: "a pipe",
            stat.S_IFCHR: "a device",
            stat.S_IFBLK: "a device",
        }
        kind = kinds.get(stat.S_IFMT(mode), "something else")
        raise FileFormatError(f"{path} must be a regular file; it is {kind}.")


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a file beside its place and move it there in the end, so that nobody ever sees half of it.

    Raises
    ------
    OSError
        If the system cannot write there.
    FileFormatError
        If something that is no regular file stands there.
    """
    replaced = path.exists()
    if replaced:
        require_regular(path)
    beside = path.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        with beside.open("xb") as file:
            yield file
        if replaced:
            shutil.copymode(path, beside)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def replace_file(path: Path, data: bytes) -> None:
    """Write these bytes to a file, as `replacing` does."""
    with replacing(path) as file:
        file.write(data)
