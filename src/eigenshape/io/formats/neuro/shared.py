"""What the formats of brains share: nibabel, if it is installed, and numbers of 32 bits."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape._arrays import find_keys
from eigenshape._extras import import_extra
from eigenshape.features.parcellation import Parcellation

Arrays = dict[str, np.ndarray]
UNNAMED = "values"  # name of a function that has none in its file
NO_PARCEL = "???"  # name of the label 0 in files of Connectome Workbench


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


def require_axes(what: str, axes: list[int], *, is_volume: bool) -> None:
    """Raise an error if axes are not those of one volume, or of functions on vertices.

    Vertices lie along the first axis. FreeSurfer factors a number of them that is too large for a
    header, as in 163842 = 27307 x 1 x 6, where the first axis is the fastest. Frames follow.
    """
    if is_volume:
        rule = "a volume must have three axes and one frame"
        fits = len(axes) >= 3 and max(axes[3:], default=1) == 1
    else:
        rule = "functions on vertices must be n x 1 x 1, or that and frames"
        width, height, depth = [*axes, 1, 1, 1][:3]
        fits = height == 1 and (depth == 1 or depth < width)
    if not fits or min(axes) < 1:
        raise FileFormatError(
            f"{what} of {rule}; it has {axes}. es.io.read_volume reads volumes, es.io.read_fields "
            "functions."
        )


def volume_function(values: np.ndarray) -> np.ndarray:
    """Return the function on vertices that is stored as a volume, with a column for each frame."""
    table = values.reshape(-1, math.prod(values.shape[3:]), order="F")
    return table[:, 0] if table.shape[1] == 1 else np.ascontiguousarray(table)


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


def label_table(parcellation: Parcellation) -> dict[int, tuple[str, tuple[float, ...]]]:
    """Return names and colors by label; parcel i has the label i + 1, since 0 is for none."""
    colors = [(0.0,) * 4, *map(tuple, parcellation.colors.tolist())]
    return dict(enumerate(zip((NO_PARCEL, *parcellation.names), colors, strict=True)))


def find_labels(what: str, keys: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the place of the label of each vertex among the keys, or -1 for 0 where no key is 0."""
    found = find_keys(keys, labels)
    odd = np.flatnonzero((found < 0) & (labels != 0))
    if odd.size:
        raise FileFormatError(
            f"{what} must stand in its table; that of vertex {odd[0]} is {labels[odd[0]]:g} "
            f"({odd.size} such)."
        )
    return found


def drop_nameless(places: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the places of vertices among the labels with a name, or -1, and these names."""
    is_named = np.array([name != NO_PARCEL for name in names], dtype=bool)
    numbers = np.append(np.where(is_named, np.cumsum(is_named) - 1, -1), -1)
    return numbers[places], tuple(name for name in names if name != NO_PARCEL)
