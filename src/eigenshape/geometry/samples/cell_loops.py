"""Kernel of `shape_quadrature`: Voronoi cells in the plane."""

import numpy as np
from jaxtyping import Float64

from eigenshape._kernels import Out, kernel


@kernel("n", "k")
def cell_areas(
    places: Float64[np.ndarray, "n k 2"],
    areas: Out[Float64[np.ndarray, " n"]],
    scratch: Out[Float64[np.ndarray, "2 2*k+4 2"]],
) -> None:
    """Fill the area of the origin's Voronoi cell within the convex hull, for each point set.

    Each set has k points, sorted by x, then y; the origin is one of them. The hull is cut by one
    bisector after the other. `scratch` holds two polygons.
    """
