"""Kernel of `distance_to_limb`."""

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel


@kernel("n_points", "n_ends")
def nearest_pieces(
    points: Float64[np.ndarray, "n_points 3"],
    ends: Float64[np.ndarray, "n_ends 4"],
    box: Float64[np.ndarray, "2 3"],
    reach: float,
    apart: Out[Float64[np.ndarray, " n_points"]],
    close: Out[Int64[np.ndarray, " n_points"]],
    arms: Out[Float64[np.ndarray, "n_points 3"]],
    radii: Out[Float64[np.ndarray, " n_points"]],
    pieces: Out[Float64[np.ndarray, " n_points"]],
    shares: Out[Float64[np.ndarray, " n_points"]],
) -> int:
    """Find the points closer than `reach` to the box of a limb, and the piece nearest to each.

    Pieces lie between two ends, each a center and a radius; the nearest has the nearest skin if
    cross-sections were round. Write how far all points are apart from the box and which are close;
    for these the arm from the axis to the point, the radius there, the number of the piece and the
    share of the way along it. Return how many are close.
    """
