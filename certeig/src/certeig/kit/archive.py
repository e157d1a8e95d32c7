"""Named arrays on disk, in NumPy's .npz: no pickle, nothing compressed, whole or not at all."""

import json
import typing
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from certeig.kit.arrays import freeze
from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path, replacing, require_regular
from certeig.kit.matrices import freeze_sparse

PARTS = ("data", "indices", "indptr")  # of a sparse matrix


def write_arrays(path: str | Path, head: Mapping[str, Any], fields: Mapping[str, Any]) -> None:
    """Write arrays and sparse matrices by name, and a head as JSON, all uncompressed."""
    arrays: dict[str, Any] = {}
    for name, field in fields.items():
        if sp.issparse(field):
            arrays |= {f"{name}_{part}": getattr(field, part) for part in PARTS}
        else:
            arrays[name] = field
    with replacing(as_path(path)) as file:
        np.savez(file, **{**arrays, "head": np.array(json.dumps(head))})


@contextmanager
def open_archive(
    path: str | Path, kind: str, version: int, maker: str
) -> Iterator[tuple[Any, Any]]:
    """Give the head and the arrays of a file of `write_arrays`; whatever is wrong is one sort of error.

    `maker` is the package that saved it, whose name stands in the head.
    """
    require_regular(as_path(path))
    try:
        with as_path(path).open("rb") as file:
            _require_uncompressed(path, file, f"{kind} that {maker} saved")
            with np.load(file, allow_pickle=False) as archive:
                head = json.loads(str(archive["head"]))
                _require_format(path, kind, head[f"{maker}_{kind}"], version)
                yield head, archive
    except FileFormatError:
        raise
    except (KeyError, TypeError, ValueError, EOFError, MemoryError, zipfile.BadZipFile) as error:
        raise FileFormatError(f"{path} must hold a {kind} that {maker} saved; {error}.") from error


def _require_uncompressed(path: str | Path, file: typing.BinaryIO, what: str) -> None:
    # What we write is not compressed, and a few compressed bytes could fill the memory.
    for part in zipfile.ZipFile(file).infolist():
        if part.compress_type != zipfile.ZIP_STORED:
            raise FileFormatError(
                f"{path} must hold a {what}; its part {part.filename} is compressed."
            )
    file.seek(0)


def _require_format(path: str | Path, kind: str, found: object, version: int) -> None:
    if found != version:
        raise FileFormatError(
            f"{path} must hold a {kind} in format {version}; it is in format {found!r}."
        )


def take_arrays(
    archive: Any, dense: Sequence[str], sparse: Sequence[str], n: int
) -> dict[str, Any]:
    """Return arrays of an archive, and square matrices with n rows, that nobody can change."""
    fields = {name: freeze(archive[name]) for name in dense}
    for name in sparse:
        parts = tuple(archive[f"{name}_{part}"] for part in PARTS)
        matrix = sp.csr_array(parts, shape=(n, n))
        matrix.check_format()
        fields[name] = freeze_sparse(matrix)
    return fields


def require_finite_floats(path: str | Path, fields: Mapping[str, Any]) -> None:
    """Raise an error if an array or a matrix holds anything but finite numbers in double precision."""
    for name, field in fields.items():
        numbers = field.data if sp.issparse(field) else field
        if numbers.dtype != np.float64 or not np.isfinite(numbers).all():
            raise FileFormatError(
                f"{path} must hold finite float64 numbers as {name}; there are others."
            )
