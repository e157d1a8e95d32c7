"""Reading regular files only, and replacing files atomically."""

import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import file_digest
from pathlib import Path
from typing import BinaryIO

from certeig.kit.arguments import describe_value
from certeig.kit.errors import FileFormatError, InvalidParameterError

LONGEST_LINE = 2**22  # bytes: a polygon of 200,000 corners in an OBJ file


def as_path(value: object, name: str = "path") -> Path:
    """Return a path that the system can open.

    Raise InvalidParameterError if it is no text or holds a NUL.
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str):
        raise InvalidParameterError(
            f"{name} must be a str or a pathlib.Path; the value is {describe_value(value)}."
        )
    if "\0" in text:
        raise InvalidParameterError(
            f"{name} must not hold the character NUL; {text!r} does, at place {text.index(chr(0))}."
        )
    return Path(text)


def require_writable(cache: str | Path) -> None:
    """Make a folder if there is none, and raise an error if files cannot be written to it.

    Raises an InvalidParameterError with what the system says.
    """
    folder = Path(cache)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InvalidParameterError(
            f"cache must be a folder that can be written to; {folder}: {error.strerror}. Choose another one."
        ) from error


def require_lines(data: bytes) -> None:
    """Raise an error for a line that no real file has, before memory is taken to split it."""
    start = 0
    while len(data) - start > LONGEST_LINE:
        ends = (data.rfind(end, start, start + LONGEST_LINE) for end in (b"\n", b"\r"))
        last = max(ends)
        if last < 0:
            end = data.find(b"\n", start)
            length = (len(data) if end < 0 else end) - start
            number = data.count(b"\n", 0, start) + 1
            raise FileFormatError(
                f"A line of text must have at most {LONGEST_LINE} bytes; line "
                f"{number} has {length}. Save the file again, with line breaks."
            )
        start = last + 1


def read_regular(path: Path, what: str = "a mesh") -> bytes:
    """Read a whole regular file.

    Reading a pipe or a device could block or never end, so other files raise an error.

    Raise FileFormatError if the file is not a regular one or is empty.
    """
    require_regular(path)
    data = path.read_bytes()
    if not data:
        raise FileFormatError(f"{path} must hold {what}; it is empty.")
    return data


def require_regular(path: Path) -> None:
    """Raise an error if a path is not a regular file."""
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode):
        kinds = {
            stat.S_IFDIR: "a folder. Name a file",
            stat.S_IFIFO: "a pipe",
            stat.S_IFCHR: "a device",
            stat.S_IFBLK: "a device",
        }
        kind = kinds.get(stat.S_IFMT(mode), "something else")
        raise FileFormatError(f"{path} must be a file; it is {kind}.")


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces `path` when the block ends without an error.

    So no reader ever sees half of the file.

    Raise FileFormatError if `path` exists and is not a regular file.
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
    """Write bytes to a file atomically, as `replacing` does."""
    with replacing(path) as file:
        file.write(data)


def remove_leftovers(folder: Path, name: str = "") -> None:
    """Delete temporary files of processes that were killed, whose names begin with `name`."""
    for path in folder.glob(f"{name}.*.tmp*"):
        if re.fullmatch(r"\.[0-9a-f]{16}\.tmp(-\w+)?", path.name.removeprefix(name)):
            path.unlink(missing_ok=True)


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
