"""Kernel of `holes`: the cheapest triangulation of a closed chain of points."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel

Points = Float64[np.ndarray, "n 3"]
Sides = Bool[np.ndarray, "n n"]


def triangulate(points: Points, taken: Sides) -> Int64[np.ndarray, "t 3"]:
    """Return the cheapest triangulation of the polygon 0..n-1; it is empty if there is none.

    This is dynamic programming over the chains i..j (Barequet and Sharir 1995). No side is drawn
    that is marked in `taken`.
    """
    n = len(points)
    costs, middles = np.empty((n, n)), np.empty((n, n), dtype=np.int64)
    waiting, triangles = np.empty((n, 2), dtype=np.int64), np.empty((n - 2, 3), dtype=np.int64)
    is_closed = fill_polygon(points, taken, costs, middles, waiting, triangles)
    return triangles if is_closed else triangles[:0]


@kernel("n")
def fill_polygon(
    points: Points,
    taken: Sides,
    costs: Out[Float64[np.ndarray, "n n"]],
    middles: Out[Int64[np.ndarray, "n n"]],
    waiting: Out[Int64[np.ndarray, "n 2"]],
    triangles: Out[Int64[np.ndarray, "n-2 3"]],
) -> bool:
    """Fill the triangles of `triangulate`; return whether there are any. The three before are scratch."""
