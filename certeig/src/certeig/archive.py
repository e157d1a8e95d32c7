"""Spectra on disk, and what a file must hold to be one."""

import typing
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from certeig.certificate import Certificate
from certeig.kit.archive import open_archive, require_finite_floats, take_arrays, write_arrays
from certeig.kit.errors import FileFormatError

# Version of the file format; a file of another version is refused.
FORMAT = 2
ARRAYS = ("eigenvalues", "eigenvectors", "residuals")
# Negative eigenvalues down to minus this share of the largest are accepted in files, as
# `Certificate.resolution` takes them for 0.
ARCHIVE_ROUNDING = 1e-6


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
