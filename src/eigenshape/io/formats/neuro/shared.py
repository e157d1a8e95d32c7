"""What the formats of brains share: nibabel, if it is installed, and numbers of 32 bits."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape._extras import import_extra
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.masks import hemisphere_of

Arrays = dict[str, np.ndarray]
GZIP = b"\x1f\x8b"  # first bytes
# Bytes that a packed volume may always unpack to: labels of a head, 256 voxels a side in 32 bits,
# are 64 MiB, and pack 200 times.
VOLUME_SIZE = 2**28
UNNAMED = "values"  # name of a function that has none in its file
NO_PARCEL = "???"  # name of the label 0 in files of Connectome Workbench

# Names of files that name a hemisphere: lh.aparc.annot, sub-01_hemi-L.label.gii, S1.L.aparc.label.gii
SIDES = {
    side: re.compile(rf"^{hemisphere}\.|hemi-{letter}\b|hemi-{letter}_|[._]{letter}\.")
    for side, hemisphere, letter in (("left", "lh", "L"), ("right", "rh", "R"))
}


def side_of_file(mesh: TriangleMesh, name: str, structure: str = "") -> str:
    """Return the hemisphere that a file of a surface names, "left", "right" or neither.

    Raise FileFormatError if the surface lies on the other side.
    """
    found = hemisphere_of(mesh)
    for side, pattern in SIDES.items():
        if side in structure.lower() if structure else pattern.search(name):
            if found not in (side, ""):
                raise FileFormatError(
                    f"A file must be of the hemisphere of the surface; it is of the {side} one "
                    f"({structure or name}), and the surface lies on the {found}, x "
                    f"{'<' if found == 'left' else '>'} 0."
                )
            return side
    return ""


def require_nibabel(module: str) -> Any:
    """Return a module of nibabel."""
    return import_extra(module, "'eigenshape[neuro]'")


def narrow(name: str, values: np.ndarray) -> np.ndarray:
    """Return numbers in 32 bits, which these formats hold; floats are rounded.

    Raise FileFormatError if a number is too large.
    """
    kind = np.float32 if values.dtype.kind == "f" else np.int32
    with np.errstate(over="ignore"):
        short = np.ascontiguousarray(values.astype(kind))
    lost = (short != values) if kind is np.int32 else np.isinf(short) & np.isfinite(values)
    bad = np.argwhere(lost)
    if len(bad):
        place = tuple(bad[0].tolist())
        raise FileFormatError(
            f"Numbers must fit into 32 bits; that of {name!r} at vertex {place[0]} is {values[place]}."
        )
    return short


def one_table(of_vertices: Arrays, what: str) -> np.ndarray:
    """Return the one function that a file without names can hold."""
    if len(of_vertices) != 1:
        raise FileFormatError(
            f"{what} holds one function, without a name; there are {len(of_vertices)}. "
            "Write each to a file of its own."
        )
    (item,) = of_vertices.items()
    return narrow(*item)


def count_vertices(shape: Sequence[int]) -> int:
    """Return the number of vertices of functions that are stored as a volume, or 0 for a volume.

    They lie along its first axis. FreeSurfer factors a number that is too large for a header, as in
    163842 = 27307 x 1 x 6, where the first axis is the fastest.
    """
    n, height, depth = shape
    return n * depth if height == 1 and (depth == 1 or depth < n) else 0


def shared_keys(what: str, keys: np.ndarray, names: Sequence[str], values: np.ndarray) -> list[str]:
    """Say which parcels are empty because an earlier one has their key, such as a color."""
    firsts = find_keys(keys, keys)
    is_twin = (firsts != np.arange(len(keys))) & np.isin(keys, values)
    return [
        f"parcels are told apart by their {what}, and those of {names[first]!r} and {names[twin]!r} "
        f"are equal: the vertices of both are in {names[first]!r}"
        for twin, first in enumerate(firsts.tolist())
        if is_twin[twin]
    ]


def find_keys(keys: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the place of each value among the keys, or -1."""
    if not len(keys):
        return np.full(len(values), -1)
    order = np.argsort(keys, kind="stable")
    found = order[np.searchsorted(keys, values, sorter=order).clip(0, len(keys) - 1)]
    return np.where(keys[found] == values, found, -1)
