"""Spectra kept in a folder, each under a name that its operator and what was asked of it give."""

import hashlib
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import astuple
from importlib.metadata import version
from pathlib import Path

import numpy as np

from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.archive import FORMAT
from eigenshape.spectral.spectrum import Spectrum


def content_key(laplacian: Laplacian, request: tuple[str | float, ...]) -> str:
    """Return the SHA-256 of W and B to the last bit, the kernel, the request, the archive's format and our version."""
    kernel = astuple(laplacian.kernel) if laplacian.kernel else None
    digest = hashlib.sha256(
        repr((FORMAT, version("eigenshape"), kernel, request, laplacian.n_points)).encode()
    )
    for matrix in (laplacian.stiffness, laplacian.mass):
        for part, kind in (
            (matrix.indptr, np.int64),
            (matrix.indices, np.int64),
            (matrix.data, np.float64),
        ):
            array = np.ascontiguousarray(part, dtype=kind)
            digest.update(len(array).to_bytes(8, "little"))
            digest.update(array.data)
    return digest.hexdigest()


def remembered(folder: str | Path, key: str, compute: Callable[[], Spectrum]) -> Spectrum:
    """Load the spectrum of a key from a folder, or compute it and keep it there; nothing is ever deleted.

    Raises
    ------
    InvalidParameterError
        If the folder cannot be made or written to; that is found out before anything is computed.

    Warns
    -----
    UserWarning
        If the file of that key is damaged, or is of another key; it is computed again and replaced. If the spectrum
        cannot be kept, as on a full disk; it is returned all the same.
    """
    path = Path(folder) / f"{key}.npz"
    if path.exists():
        try:
            return Spectrum.load(path, key=key)
        except FileFormatError as error:
            warnings.warn(
                f"A spectrum in the cache cannot be used and is computed again: {error}",
                stacklevel=3,
            )
    _require_writable(Path(folder))
    spectrum = compute()
    try:
        spectrum.save(path, key=key)
    except (OSError, FileFormatError) as error:
        warnings.warn(
            f"A spectrum was computed and could not be kept in the cache: {error}", stacklevel=3
        )
    return spectrum


def _require_writable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InvalidParameterError(
            f"cache must be a folder that can be written to; {folder}: {error}."
        ) from error
