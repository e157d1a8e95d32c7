"""Kernels of `patches`: descriptors of the geodesic discs around points, by rings."""

import numpy as np
from jaxtyping import Float32, Float64, Int64

from certeig.kit.kernels import Out, kernel

RINGS = 4  # rings of equal width in a disc
TURN_BINS = 8  # bins of the cosine to the disc's normal, 0 to 1
HEIGHT_BINS = 6  # bins of the height above the point, in radii, -1 to 1
# The two histograms, the logarithm of the area, and the ratio of distances
RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2
AREA = TURN_BINS + HEIGHT_BINS  # the place of that logarithm


@kernel("n_centers", "n", "n_radii")
def fill_discs(
    rows: Float64[np.ndarray, "n_centers n"],
    centers: Int64[np.ndarray, " n_centers"],
    surface: tuple[
        Float64[np.ndarray, "n 3"], Float64[np.ndarray, "n 3"], Float64[np.ndarray, " n"]
    ],
    radii: Float64[np.ndarray, " n_radii"],
    order: Out[Int64[np.ndarray, " n"]],
    found: Out[Float32[np.ndarray, "n_centers n_radii 4 16"]],
    covered: Out[Float64[np.ndarray, "n_centers n_radii 4"]],
) -> None:
    """Write the numbers of the discs around vertices, for each of the ascending radii.

    `rows` holds the distances from each center; `surface` the points, normals and areas of all
    vertices. `covered` is filled with the share of a flat disc that each ring covers with those
    within it, from which the caller takes the logarithm. `order` is scratch.
    """


@kernel("n")
def sort_by_distance(
    distances: Float64[np.ndarray, " n"], reach: float, order: Out[Int64[np.ndarray, " n"]]
) -> int:
    """Write the vertices within reach by distance, equals by index, and return their number."""


@kernel("n")
def shorten_paths(lengths: Out[Float64[np.ndarray, "n n"]]) -> None:
    """Replace the lengths of direct ways by those of the shortest paths of them."""
