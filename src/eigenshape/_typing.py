"""Annotations that `help` shows by their names, where it would show unions or protocols."""

from os import PathLike
from pathlib import Path
from typing import Protocol, runtime_checkable

from typing_extensions import TypeAliasType


@runtime_checkable
class BinaryFile(Protocol):
    """A file that is open for reading bytes, as `open(path, "rb")` and `io.BytesIO` return."""

    def read(self) -> bytes:
        """Return the rest of the file."""


FileLike = TypeAliasType("FileLike", str | Path | bytes | BinaryFile)


@runtime_checkable
class Stored(Protocol):
    """A `ShapeIndex`, which stands for its folder."""

    @property
    def folder(self) -> Path:
        """Return where it is kept."""


IndexLike = TypeAliasType("IndexLike", str | PathLike[str] | Stored)
