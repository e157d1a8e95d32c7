"""Spectra on disk, as arrays in NumPy's .npz: no pickle, nothing compressed, whole or not at all."""

import json
import typing
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from certeig.certificate import Certificate
from certeig.kit.arrays import freeze
from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path, replacing, require_regular
from certeig.matrices import freeze_sparse

# Version of the file format; a file of another version is refused.
FORMAT = 2
ARRAYS = ("eigenvalues", "eigenvectors", "residuals")
PARTS = ("data", "indices", "indptr")  # of a sparse matrix
# Negative eigenvalues down to minus this share of the largest are accepted in files, as
# `Certificate.resolution` takes them for 0.
ARCHIVE_ROUNDING = 1e-6


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


def write_spectrum(
    path: str | Path, fields: Mapping[str, Any], key: str | None, maker: str
) -> None:
    """Write what a spectrum holds, and the key of what it was computed from."""
    certificate = asdict(fields["certificate"])
    head = {f"{maker}_spectrum": FORMAT, "key": key, "certificate": certificate}
    write_arrays(path, head, {name: fields[name] for name in ("mass", *ARRAYS)})


def read_spectrum(
    path: str | Path, key: str | None, kind: type[Certificate], maker: str, least: float
) -> dict[str, Any]:
    """Return what a spectrum is made from; its certificate is of a class that is given.

    `least` is the smallest eigenvalue that it may hold.

    Raise FileFormatError if the file is no spectrum, is cut off, its parts do not fit one another
    or hold what no spectrum holds, or it has another key than the given one.
    """
    with open_archive(path, "spectrum", FORMAT, maker) as (head, archive):
        certificate = _certificate(path, head, key, kind)
        fields = take_arrays(archive, ARRAYS, ["mass"], len(archive["eigenvectors"]))
    require_finite_floats(path, fields)
    shapes = {name: fields[name].shape for name in ARRAYS}
    n, k = len(fields["eigenvectors"]), fields["eigenvalues"].size
    if (
        shapes != {"eigenvalues": (k,), "eigenvectors": (n, k), "residuals": (k,)}
        or certificate.n_pairs != k
    ):
        raise FileFormatError(
            f"{path} must hold arrays that fit one another; their shapes are {shapes}, and {certificate.n_pairs} pairs "
            f"are certified."
        )
    values, residuals = fields["eigenvalues"], fields["residuals"]
    falling = np.flatnonzero(np.diff(values) < 0)
    if falling.size:
        at = int(falling[0]) + 1
        raise FileFormatError(
            f"{path} must hold ascending eigenvalues; number {at} is {values[at]} after {values[at - 1]}."
        )
    if k and values[0] < least - max(certificate.resolution, ARCHIVE_ROUNDING * values[-1]):
        raise FileFormatError(
            f"{path} must hold eigenvalues of at least {least:g}; number 0 is {values[0]}."
        )
    negative = np.flatnonzero(residuals < 0)
    if negative.size:
        raise FileFormatError(
            f"{path} must hold residuals of at least 0; number {negative[0]} is {residuals[negative[0]]}."
        )
    return {**fields, "certificate": certificate}


def _certificate(
    path: str | Path, head: dict[str, Any], key: str | None, kind: type[Certificate]
) -> Certificate:
    if key is not None and head["key"] != key:
        raise FileFormatError(
            f"{path} must hold the spectrum of the key {key}; its key is {head['key']}."
        )
    facts = head["certificate"]
    facts = {"n_deflated": 0, "fallbacks": (), **facts}  # which older files do not hold
    facts |= {name: tuple(facts[name]) for name in ("gap", "clusters", "fallbacks")}
    for name, wanted in typing.get_type_hints(kind).items():
        if not _is_of(facts[name], wanted):
            raise FileFormatError(
                f"{path} must hold a certificate whose {name} is {wanted}; it is {facts[name]!r}."
            )
    return kind(**facts)


def _is_of(value: object, kind: Any) -> bool:
    """Whether a value has the type of a certificate's attribute; a whole number is a float too, NaN is none."""
    if isinstance(value, tuple):
        entries = typing.get_args(kind)
        kinds = [entries[0]] * len(value) if entries[1:] == (...,) else entries
        return len(value) == len(kinds) and all(map(_is_of, value, kinds))
    kinds = typing.get_args(kind) or (kind,)
    if isinstance(value, bool) or (isinstance(value, float) and np.isnan(value)):
        return False
    return isinstance(value, kinds) or (float in kinds and isinstance(value, int))
