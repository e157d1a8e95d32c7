"""Kernel of `triangulate_polygons`. Points in the plane have coordinates of size 1."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel


@kernel("n_polygons", "n")
def clip_ears(
    outlines: Float64[np.ndarray, "n_polygons n 2"],
    rounding: float,
    triangles: Out[Int64[np.ndarray, "n_polygons n-2 3"]],
    is_simple: Out[Bool[np.ndarray, " n_polygons"]],
    neighbors: Out[Int64[np.ndarray, "2 n"]],
    shapes: Out[Float64[np.ndarray, " n"]],
) -> None:
    """Cut polygons of c corners into triangles, and say which of them do not cross themselves.

    Corners are cut off one by one (ear clipping, Meisters 1975): always that of the best-shaped
    triangle, and one on a line with its neighbors only where there is no other. Points nearer than
    `rounding` to a line lie on it. The triangles of a polygon that crosses itself may be
    incomplete. `neighbors` and `shapes` are scratch.
    """
