"""Spectra on disk: NumPy's .npz, no pickle, whole or not at all."""

import json
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from eigenshape._errors import FileFormatError
from eigenshape._files import replacing
from eigenshape.spectral.certificate import Certificate

FORMAT = 1
ARRAYS = ("eigenvalues", "eigenvectors", "residuals")
MASS = ("data", "indices", "indptr")


def write_archive(
    path: str | Path, arrays: dict[str, np.ndarray], mass: sp.csr_array, certificate: Certificate
) -> None:
    """Write what a spectrum holds."""
    parts: dict[str, Any] = {f"mass_{name}": getattr(mass, name) for name in MASS}
    head = json.dumps({"eigenshape_spectrum": FORMAT, "certificate": asdict(certificate)})
    with replacing(Path(path)) as file:
        np.savez(file, **{**parts, **arrays, "head": np.array(head)})


def read_archive(path: str | Path) -> dict[str, Any]:
    """Return what a spectrum is made from.

    Raises
    ------
    FileFormatError
        If the file is no spectrum, is cut off, or its parts do not fit one another.
    """
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            facts = _facts(path, json.loads(str(archive["head"])))
            certificate = Certificate(**{**facts, "gap": tuple(facts["gap"]), "clusters": tuple(facts["clusters"])})
            arrays = {name: archive[name] for name in ARRAYS}
            parts = tuple(archive[f"mass_{name}"] for name in MASS)
        n = len(arrays["eigenvectors"])
        mass = sp.csr_array(parts, shape=(n, n))
        mass.check_format()
    except FileFormatError:
        raise
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise FileFormatError(f"{path} must hold a spectrum that eigenshape saved; {error}.") from error
    k = len(arrays["eigenvalues"])
    shapes = {name: array.shape for name, array in arrays.items()}
    if shapes != {"eigenvalues": (k,), "eigenvectors": (n, k), "residuals": (k,)} or certificate.n_pairs != k:
        raise FileFormatError(
            f"{path} must hold arrays that fit one another; their shapes are {shapes}, and {certificate.n_pairs} pairs "
            f"are certified."
        )
    return {**arrays, "mass": mass, "certificate": certificate}


def _facts(path: str | Path, head: dict[str, Any]) -> dict[str, Any]:
    if head["eigenshape_spectrum"] != FORMAT:
        raise FileFormatError(
            f"{path} must hold a spectrum in format {FORMAT}; it is in format {head['eigenshape_spectrum']}."
        )
    return head["certificate"]
