"""Kernels of `patches`: descriptors of the geodesic discs around a point, by rings."""

import numpy as np
from jaxtyping import Float32, Float64, Int64

from eigenshape._kernels import Out, kernel

RINGS = 4  # rings of equal width in a disc
TURN_BINS = 8  # bins of the cosine to the disc's normal, 0 to 1
HEIGHT_BINS = 6  # bins of the height above the point, in radii, -1 to 1
# The two histograms, the logarithm of the area, and the ratio of distances
RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2
NUMBERS = RINGS * RING_NUMBERS
BUCKETS = 512  # of distances, before they are sorted

Points = Float64[np.ndarray, "n 3"]
Values = Float64[np.ndarray, " n"]
Places = Int64[np.ndarray, " n"]
Starts = Int64[np.ndarray, " 513"]
Rings = Float64[np.ndarray, " 4"]


@kernel("n", "r")
def describe_discs_of(
    distances: Values,
    center: Float64[np.ndarray, " 3"],
    surface: tuple[Points, Points, Values],
    radii: Float64[np.ndarray, " r"],
    scratch: tuple[Out[Places], Out[Starts], Out[Rings], Out[Rings]],
    found: Out[Float32[np.ndarray, "r 64"]],
    libm: tuple[int],
) -> None:
    """Write the NUMBERS of the discs around one point, a row for each of the ascending radii.

    `surface` holds the points, normals and areas of all vertices. `scratch` holds vertices, as many
    as there are, BUCKETS + 1 starts, and twice RINGS numbers.

    `libm` holds the address of log.
    """


@kernel("n")
def sort_by_distance(
    distances: Values, reach: float, order: Out[Places], starts: Out[Starts]
) -> int:
    """Write the vertices within reach by distance, equals by index, and return their number.

    Vertices are put into buckets of equal width first. Then few are out of place, and insertion
    takes a fifth of the time of a sort of all.
    """
