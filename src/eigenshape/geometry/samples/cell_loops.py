"""Kernel of `shape_quadrature`: Voronoi cells in the plane."""

import numpy as np
from jaxtyping import Float64

from certeig.kit.kernels import Out, kernel


@kernel("n_sets", "n_points")
def cell_areas(
    places: Float64[np.ndarray, "n_sets n_points 2"],
    areas: Out[Float64[np.ndarray, " n_sets"]],
    scratch: Out[Float64[np.ndarray, "2 2*n_points+4 2"]],
) -> None:
    """Fill the area of the origin's Voronoi cell within the convex hull, for each point set.

    Each set has k points, sorted by x, then y; the origin is one of them. The hull is cut by one
    bisector after the other. `scratch` holds two polygons.
    """
