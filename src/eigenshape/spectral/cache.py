"""Spectra kept in a folder, each under a hash of its operator and of what was requested."""

import hashlib
import warnings
from dataclasses import astuple
from importlib.metadata import version
from pathlib import Path

import numpy as np

from certeig.archive import FORMAT
from certeig.kit.errors import FileFormatError
from eigenshape.operators.laplacian import Laplacian
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


def load_kept(folder: str | Path, key: str) -> Spectrum | None:
    """Load the spectrum of a key from a folder; None if the folder has none that can be used.

    Warns
    -----
    UserWarning
        If the file of that key is damaged, or is of another key.
    """
    path = _place(folder, key)
    if path.exists():
        try:
            return Spectrum.load(path, key=key)
        except FileFormatError as error:
            warnings.warn(
                f"A spectrum in the cache cannot be used and is computed again: {error}",
                stacklevel=3,
            )
    return None


def keep(spectrum: Spectrum, folder: str | Path, key: str) -> None:
    """Write a spectrum to a folder under its key, in place of what stands there; nothing else is ever deleted.

    Warns
    -----
    UserWarning
        If the spectrum cannot be written, as on a full disk.
    """
    try:
        spectrum.save(_place(folder, key), key=key)
    except (OSError, FileFormatError) as error:
        warnings.warn(
            f"A spectrum was computed and could not be kept in the cache: {error}", stacklevel=3
        )


def _place(folder: str | Path, key: str) -> Path:
    return Path(folder) / f"{key}.npz"
