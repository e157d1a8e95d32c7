"""Kernel of `holes`: the cheapest triangulation of a closed chain of points."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from eigenshape._kernels import Out, kernel


@kernel("n")
def fill_chains(
    points: Float64[np.ndarray, "n 3"],
    taken: Bool[np.ndarray, "n n"],
    costs: Out[Float64[np.ndarray, "n n"]],
    middles: Out[Int64[np.ndarray, "n n"]],
) -> None:
    """Fill the least cost of triangles between the points i to j, for each two of them.

    Entry (i, j) of `middles` is the third corner of the triangle at the side from i to j. The cost
    of what has no triangulation is infinite.

    This is dynamic programming over the chains i..j (Barequet and Sharir 1995). No side is drawn
    that is marked in `taken`.
    """
