"""Mesh files as they were read: from a path, bytes or an open file, packed by gzip or not."""

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.arrays import record
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, read_regular
from eigenshape._errors import InvalidShapeError
from eigenshape._typing import BinaryFile, FileLike
from eigenshape.io.formats.first_bytes import recognize, require_content
from eigenshape.io.formats.numbers import (
    ALWAYS,
    MOST_TIMES,
    VOLUME_SIZE,
    quote_line,
    require_reasonable,
)
from eigenshape.io.formats.registry import format_of, suffix_in, suffix_of

NOWHERE = Path(os.devnull, "nowhere")  # a folder that cannot exist
GZIP = b"\x1f\x8b"  # first bytes


@record
class SourceFile:
    """A file as it was read, of which a file of the same format is made again.

    Attributes
    ----------
    path : Path
        Of bytes and of open files, a name for messages.
    suffix : str
    data : bytes
        Unpacked, if the file was packed by gzip.
    folder : Path
        Where other parts of the file lie; for bytes and open files `NOWHERE`.
    scene : str or int, optional
        The name or number of the scene that is read, if the file may hold several.
    """

    path: Path
    suffix: str
    data: bytes = field(repr=False)
    folder: Path = NOWHERE
    scene: str | int | None = None

    @property
    def options(self) -> dict[str, Any]:
        """What parsers take besides the data: the folder, if parts of the file may lie there."""
        return {"folder": self.folder} if "beside" in format_of(self.suffix).traits else {}


def open_file(
    path: FileLike,
    file_format: str | None,
    known: tuple[str, ...],
    scene: str | int | None = None,
) -> SourceFile:
    """Read the bytes of a file of one of the known suffixes, and unpack them.

    Raise FileFormatError if the suffix is unknown, or the first bytes are those of another format.
    """
    if isinstance(path, bytes | BinaryFile):
        name, data = _read_open(path)
        data = unpack_gzip(data)
        place, folder = Path(name or "the bytes"), NOWHERE
        if file_format is None and not suffix_in(name):
            file_format = _format_of_bytes(data)
        suffix = suffix_of(place, file_format, known)
    else:
        place = as_path(path)
        folder = place.parent
        suffix = suffix_of(place, file_format, known)
        data = read_regular(place)
    with naming(place):
        is_volume = "volume" in format_of(suffix).traits
        data = unpack_gzip(data, VOLUME_SIZE if is_volume else ALWAYS)
        # MNI objects have the suffix of Wavefront files.
        found = recognize(data)
        if suffix == ".obj" and found and found.suffix == ".mniobj":
            suffix = found.suffix
        require_content(found, suffix)
    return SourceFile(place, suffix, data, folder, scene)


def _format_of_bytes(data: bytes) -> str:
    found = recognize(data)
    if found is None or not found.suffix:
        what = found.noun if found else quote_line((1, data[:20]))
        raise InvalidParameterError(
            f"file_format must be given with bytes that do not begin with the name of a format; they "
            f"begin with {what}. Pass for instance file_format='.obj'."
        )
    return found.suffix


def unpack_gzip(data: bytes, always: int = ALWAYS) -> bytes:
    """Unpack what gzip packed, in one or several members; other data stay as they are.

    Raise FileFormatError if the data are damaged, or no real file unpacks to so much.
    """
    if not data.startswith(GZIP):
        return data
    most = always + MOST_TIMES * len(data)
    unpacked = bytearray()
    left = data
    try:
        while left:
            unpacker = zlib.decompressobj(wbits=31)
            unpacked += unpacker.decompress(left, most + 1 - len(unpacked))
            require_reasonable(len(unpacked), len(data), always)
            if not unpacker.eof:
                raise FileFormatError("A packed file must be whole; it ends too early.")
            left = unpacker.unused_data.lstrip(b"\0")
    except zlib.error as err:
        raise FileFormatError(f"A packed file must be whole; it is damaged: {err}.") from err
    return bytes(unpacked)


def _read_open(file: bytes | BinaryFile) -> tuple[str, bytes]:
    """Return the name of an open file, if it has one, and what is left to be read."""
    data = file if isinstance(file, bytes) else file.read()
    if not isinstance(data, bytes):
        raise InvalidParameterError(
            f"A file must be opened for bytes, as by open(path, 'rb'); reading gives {type(data).__name__}."
        )
    if not data:
        raise FileFormatError("Bytes of a shape must hold one; there are none.")
    name = getattr(file, "name", "")
    return (name if isinstance(name, str) else ""), data


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the path before the message of an error. Overflow is found when the shape is checked."""
    try:
        with np.errstate(all="ignore"):
            yield
    except (FileFormatError, InvalidShapeError) as err:
        name = "" if str(err).startswith(str(path)) else f"{path}: "
        raise type(err)(f"{name}{err}") from err
    except MemoryError as err:
        raise FileFormatError(
            f"{path} must fit into memory; there is too little to read it."
        ) from err
