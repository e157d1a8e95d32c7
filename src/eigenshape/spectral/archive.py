"""Spectra on disk: NumPy's .npz, no pickle, whole or not at all."""

import json
import typing
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from eigenshape._errors import FileFormatError
from eigenshape._files import as_path, replacing, require_regular
from eigenshape.spectral.certificate import Certificate

# Version of the file format; a file of another version is refused.
FORMAT = 2
ARRAYS = ("eigenvalues", "eigenvectors", "residuals")
MASS = ("data", "indices", "indptr")
# Negative eigenvalues down to minus this share of the largest are accepted in files, as
# `Certificate.resolution` takes them for 0.
ARCHIVE_ROUNDING = 1e-6


def write_archive(
    path: str | Path,
    arrays: dict[str, np.ndarray],
    mass: sp.csr_array,
    certificate: Certificate,
    key: str | None,
) -> None:
    """Write what a spectrum holds, and the key of what it was computed from."""
    parts: dict[str, Any] = {f"mass_{name}": getattr(mass, name) for name in MASS}
    head = json.dumps(
        {"eigenshape_spectrum": FORMAT, "key": key, "certificate": asdict(certificate)}
    )
    with replacing(as_path(path)) as file:
        np.savez(file, **{**parts, **arrays, "head": np.array(head)})


def read_archive(path: str | Path, key: str | None) -> dict[str, Any]:
    """Return what a spectrum is made from.

    Raises
    ------
    FileFormatError
        If the file is no spectrum, is cut off, its parts do not fit one another or hold what no
        spectrum holds, or it has another key than the given one.
    """
    require_regular(as_path(path))
    try:
        with as_path(path).open("rb") as file:
            require_uncompressed(path, file, "a spectrum")
            with np.load(file, allow_pickle=False) as archive:
                certificate = _certificate(path, json.loads(str(archive["head"])), key)
                arrays = {name: archive[name] for name in ARRAYS}
                parts = tuple(archive[f"mass_{name}"] for name in MASS)
        n = len(arrays["eigenvectors"])
        mass = sp.csr_array(parts, shape=(n, n))
        mass.check_format()
    except FileFormatError:
        raise
    except (KeyError, TypeError, ValueError, EOFError, MemoryError, zipfile.BadZipFile) as error:
        raise FileFormatError(
            f"{path} must hold a spectrum that eigenshape saved; {error}."
        ) from error
    _require_sound(path, {**arrays, "mass": mass.data}, certificate)
    return {**arrays, "mass": mass, "certificate": certificate}


def require_uncompressed(path: str | Path, file: typing.BinaryIO, what: str) -> None:
    """Refuse compressed parts: what we write has none, and a few bytes of them could fill the memory."""
    for part in zipfile.ZipFile(file).infolist():
        if part.compress_type != zipfile.ZIP_STORED:
            raise FileFormatError(
                f"{path} must hold {what} that eigenshape saved; its part {part.filename} is compressed."
            )
    file.seek(0)


def _certificate(path: str | Path, head: dict[str, Any], key: str | None) -> Certificate:
    if head["eigenshape_spectrum"] != FORMAT:
        raise FileFormatError(
            f"{path} must hold a spectrum in format {FORMAT}; it is in format {head['eigenshape_spectrum']}."
        )
    if key is not None and head["key"] != key:
        raise FileFormatError(
            f"{path} must hold the spectrum of the key {key}; its key is {head['key']}."
        )
    facts = head["certificate"]
    facts = {"n_deflated": 0, "fallbacks": (), **facts}  # which older files do not hold
    facts |= {name: tuple(facts[name]) for name in ("gap", "clusters", "fallbacks")}
    for name, kind in typing.get_type_hints(Certificate).items():
        if not _is_of(facts[name], kind):
            raise FileFormatError(
                f"{path} must hold a certificate whose {name} is {kind}; it is {facts[name]!r}."
            )
    return Certificate(**facts)


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


def _require_sound(
    path: str | Path, arrays: dict[str, np.ndarray], certificate: Certificate
) -> None:
    for name, array in arrays.items():
        if array.dtype != np.float64 or not np.isfinite(array).all():
            raise FileFormatError(
                f"{path} must hold finite float64 numbers as {name}; there are others."
            )
    n, k = len(arrays["eigenvectors"]), arrays["eigenvalues"].size
    shapes = {name: arrays[name].shape for name in ARRAYS}
    if (
        shapes != {"eigenvalues": (k,), "eigenvectors": (n, k), "residuals": (k,)}
        or certificate.n_pairs != k
    ):
        raise FileFormatError(
            f"{path} must hold arrays that fit one another; their shapes are {shapes}, and {certificate.n_pairs} pairs "
            f"are certified."
        )
    values = arrays["eigenvalues"]
    falling = np.flatnonzero(np.diff(values) < 0)
    if falling.size:
        at = int(falling[0]) + 1
        raise FileFormatError(
            f"{path} must hold ascending eigenvalues; number {at} is {values[at]} after {values[at - 1]}."
        )
    if k and values[0] < -max(certificate.resolution, ARCHIVE_ROUNDING * values[-1]):
        raise FileFormatError(
            f"{path} must hold eigenvalues of at least 0; number 0 is {values[0]}."
        )
    if (arrays["residuals"] < 0).any():
        at = int(np.argmax(arrays["residuals"] < 0))
        raise FileFormatError(
            f"{path} must hold residuals of at least 0; number {at} is {arrays['residuals'][at]}."
        )
