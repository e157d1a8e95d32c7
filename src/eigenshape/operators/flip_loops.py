"""Kernels over the sides of an intrinsic triangulation.

The sides of triangle f are 3f, 3f + 1, 3f + 2, in order around it. Side h starts at the vertex
`tails[h]`, has length `lengths[h]`, and is glued to side `twins[h]` of another triangle or the
same.
"""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from eigenshape._kernels import Out, kernel


def areas(lengths: Float64[np.ndarray, " h"]) -> Float64[np.ndarray, " f"]:
    """Return the area of each triangle, by Heron's formula in Kahan's order."""
    found = np.empty(len(lengths) // 3)
    fill_areas(lengths, found)
    return found


def cotangents(lengths: Float64[np.ndarray, " h"]) -> Float64[np.ndarray, " h"]:
    """Return the cotangent of the angle opposite to each side."""
    found = np.empty_like(lengths)
    fill_cotangents(lengths, found)
    return found


@kernel("n_faces")
def fill_areas(
    lengths: Float64[np.ndarray, " n_sides"], found: Out[Float64[np.ndarray, " n_faces"]]
) -> None:
    """Fill the area of each triangle."""


@kernel("n_sides")
def fill_cotangents(
    lengths: Float64[np.ndarray, " n_sides"], found: Out[Float64[np.ndarray, " n_sides"]]
) -> None:
    """Fill the cotangent of the angle opposite to each side."""


@kernel("n_sides")
def flip_edges(
    tails: Out[Int64[np.ndarray, " n_sides"]],
    twins: Out[Int64[np.ndarray, " n_sides"]],
    lengths: Out[Float64[np.ndarray, " n_sides"]],
    tolerance: float,
    most: int,
    queue: Out[Int64[np.ndarray, " n_sides"]],
    is_waiting: Out[Bool[np.ndarray, " n_sides"]],
) -> int:
    """Flip edges in place until all are Delaunay; return the number of flips.

    Edges are flipped in the order in which they are found. Returns -1 after more than `most` flips.
    `queue` and `is_waiting` are scratch.
    """
