"""Operator bundles on disk: NumPy's .npz, no pickle, checked by the checksums of its parts."""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from eigenshape._arrays import freeze
from eigenshape._errors import FileFormatError
from eigenshape._files import replacing, require_regular
from eigenshape.sparse.frozen import freeze_sparse
from eigenshape.spectral.archive import require_uncompressed

# Version of the file format; a file of another version is refused.
FORMAT = 1
DENSE = ("frames", "mass", "eigenvalues", "eigenvectors")
SPARSE = ("stiffness", "gradient_x", "gradient_y")
PARTS = ("data", "indices", "indptr")


def write_bundle(path: Path, fields: Mapping[str, Any]) -> None:
    """Write the arrays of a bundle; the file is written completely or not at all."""
    arrays = {name: fields[name] for name in DENSE}
    for name in SPARSE:
        arrays |= {f"{name}_{part}": getattr(fields[name], part) for part in PARTS}
    head = np.array(json.dumps({"eigenshape_bundle": FORMAT}))
    with replacing(path) as file:
        np.savez(file, **{**arrays, "head": head})


def read_bundle(path: Path) -> dict[str, Any]:
    """Read the arrays of a bundle.

    Raise FileFormatError if the file is not a bundle, is damaged or of another version, or its
    arrays do not fit together or are not finite.
    """
    require_regular(path)
    try:
        with path.open("rb") as file:
            require_uncompressed(path, file, "a bundle")
            with np.load(file, allow_pickle=False) as archive:
                _require_format(path, json.loads(str(archive["head"]))["eigenshape_bundle"])
                fields: dict[str, Any] = {name: archive[name] for name in DENSE}
                n = len(fields["mass"])
                for name in SPARSE:
                    parts = tuple(archive[f"{name}_{part}"] for part in PARTS)
                    fields[name] = sp.csr_array(parts, shape=(n, n))
                    fields[name].check_format()
    except FileFormatError:
        raise
    except (KeyError, TypeError, ValueError, EOFError, MemoryError, zipfile.BadZipFile) as error:
        raise FileFormatError(
            f"{path} must hold a bundle that eigenshape saved; {error}."
        ) from error
    k = fields["eigenvalues"].size
    shapes = {"frames": (n, 3, 3), "mass": (n,), "eigenvalues": (k,), "eigenvectors": (n, k)}
    for name, part in fields.items():
        numbers = part.data if name in SPARSE else part
        if part.shape != shapes.get(name, (n, n)):
            raise FileFormatError(
                f"{path} must hold arrays that fit together; {name} has shape {part.shape} for "
                f"{n} points and {k} eigenvalues."
            )
        if numbers.dtype != np.float64 or not np.isfinite(numbers).all():
            raise FileFormatError(
                f"{path} must hold finite float64 numbers as {name}; there are others."
            )
    return {
        name: freeze(part) if name in DENSE else freeze_sparse(part)
        for name, part in fields.items()
    }


def _require_format(path: Path, found: object) -> None:
    if found != FORMAT:
        raise FileFormatError(
            f"{path} must hold a bundle in format {FORMAT}; it is in format {found!r}."
        )
