"""NIfTI files: a number for each voxel, and where the voxels lie.

Read: volumes of three axes; one number for each vertex, as n x 1 x 1.
Kept: the map from voxels to space.
Named: nothing.
Refused: several frames as a volume; a map that is not finite.
"""

import math

import numpy as np
from jaxtyping import Float, Shaped

from certeig.kit.errors import FileFormatError
from eigenshape._errors import MissingExtraError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import (
    UNNAMED,
    Arrays,
    require_axes,
    require_nibabel,
    volume_function,
)

# Sizes of headers, which files begin with, and classes of nibabel
HEADERS = {348: "Nifti1Image", 540: "Nifti2Image"}


def parse_volume(data: bytes) -> tuple[Shaped[np.ndarray, "a b c"], Float[np.ndarray, "4 4"]]:
    """Return the numbers of a volume, and the map from voxels to space.

    Raise FileFormatError if the file does not hold what it declares, or has several frames.
    """
    values, to_space = _parse(data, is_volume=True)
    return np.ascontiguousarray(values.reshape(values.shape[:3])), to_space


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the one function that is stored as a volume, or its frames as columns, and none on faces.

    Raise FileFormatError if the file does not hold what it declares, or holds a volume.
    """
    values, _ = _parse(data, is_volume=False)
    return {UNNAMED: volume_function(values)}, {}


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str) -> bytes:
    """Raise an error, since functions in such files are only read."""
    raise FileFormatError(f"Functions in {suffix} are only read. Write .mgh or .func.gii.")


def _parse(data: bytes, *, is_volume: bool) -> tuple[np.ndarray, Float[np.ndarray, "4 4"]]:
    """Return the numbers in the shape of the file, and the map from voxels to space."""
    try:
        values, to_space = _load(data, is_volume=is_volume)
    except (FileFormatError, MissingExtraError):
        raise
    except Exception as err:  # nibabel and what it calls each raise their own
        cause = " ".join(str(err).split())
        raise FileFormatError(
            f"A NIfTI file must hold a volume; {type(err).__name__}: {cause}"
        ) from err
    if values.dtype.kind not in "buif" or not np.isfinite(to_space).all():
        raise FileFormatError(
            "A volume must hold one number for each voxel, and a place for each that is finite; it holds "
            f"{values.dtype}, and the map is {to_space.tolist()}."
        )
    return values.astype(values.dtype.newbyteorder("="), copy=False), to_space


def _load(data: bytes, *, is_volume: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return what nibabel reads, once the header has told that the file is whole, and its size."""
    nibabel = require_nibabel("nibabel")
    length = int.from_bytes(data[:4], "little")
    if length not in HEADERS:
        length = int.from_bytes(data[:4], "big")
    if length not in HEADERS or len(data) < length:
        raise FileFormatError(
            "A NIfTI file must begin with its header, of 348 or 540 bytes; it begins with "
            f"{data[:4].hex(' ')}, and has {len(data)} bytes."
        )
    kind = getattr(nibabel, HEADERS[length])
    header = kind.header_class(data[:length], check=False)
    # nibabel returns the number of vertices that FreeSurfer stores elsewhere if 16 bits are too few.
    axes, bits = list(header.get_data_shape()), int(header["bitpix"])
    require_axes("A NIfTI file", axes, is_volume=is_volume)
    size = math.prod(axes) * bits // 8
    if not 0 < size <= len(data):
        raise FileFormatError(
            f"A NIfTI file must hold what it declares; {size} bytes do not fit into its {len(data)}."
        )
    image = kind.from_bytes(data)
    return np.asanyarray(image.dataobj), np.asarray(image.affine, dtype=np.float64)
