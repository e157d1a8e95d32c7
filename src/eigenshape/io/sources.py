"""Files of shapes as they were read: their bytes, and errors that name them."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from eigenshape._errors import FileFormatError, InvalidShapeError
from eigenshape._files import as_path, read_regular
from eigenshape.io.formats.registry import suffix_of


@dataclass(frozen=True, eq=False)
class SourceFile:
    """A file as it was read, of which a file of the same format is made again."""

    path: Path
    suffix: str
    data: bytes = field(repr=False)


def open_file(path: str | Path, file_format: str | None, known: tuple[str, ...]) -> SourceFile:
    """Read the bytes of a file of one of the known suffixes."""
    path = as_path(path)
    suffix = suffix_of(path, file_format, known)
    return SourceFile(path, suffix, read_regular(path))


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
