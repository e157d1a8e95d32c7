"""Kernels over the sides of an intrinsic triangulation.

The sides of triangle f are 3f, 3f + 1, 3f + 2, in order around it. Side h starts at the vertex
`tails[h]`, has length `lengths[h]`, and is glued to side `twins[h]` of another triangle or the
same.
"""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel

Lengths = Float64[np.ndarray, " n"]
Sides = Int64[np.ndarray, " n"]


def areas(lengths: Lengths) -> Float64[np.ndarray, " f"]:
    """Return the areas of the triangles."""
    found = np.empty(len(lengths) // 3)
    fill_areas(lengths, found)
    return found


@kernel("f")
def fill_areas(lengths: Float64[np.ndarray, " f*3"], found: Out[Float64[np.ndarray, " f"]]) -> None:
    """Fill the areas of the triangles."""


def cotangents(lengths: Lengths) -> Lengths:
    """Return the cotangents of the angles opposite to the sides."""
    found = np.empty(len(lengths))
    fill_cotangents(lengths, found)
    return found


@kernel("n")
def fill_cotangents(lengths: Lengths, found: Out[Lengths]) -> None:
    """Fill the cotangents of the angles opposite to the sides."""


@kernel("n")
def flip_edges(
    tails: Out[Sides],
    twins: Out[Sides],
    lengths: Out[Lengths],
    tolerance: float,
    most: int,
    queue: Out[Sides],
    waiting: Out[Bool[np.ndarray, " n"]],
) -> int:
    """Flip edges in place until all are Delaunay; return the number of flips.

    Edges are flipped in the order in which they are found. Returns -1 after more than `most` flips.
    The last two arrays are scratch, and `waiting` comes filled with False.
    """
