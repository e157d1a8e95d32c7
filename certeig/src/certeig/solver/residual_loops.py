"""Kernel of `pencil`: the sums in Rayleigh quotients and residuals, in one pass."""

import numpy as np
from jaxtyping import Float64, Int32, Int64

from certeig.kit.kernels import Out, kernel

Pointers = Int64[np.ndarray, "n+1"]
Sums = Float64[np.ndarray, "3 k"]


@kernel("n", "k")
def add_sums(
    stiffness: tuple[Pointers, Int32[np.ndarray, " e"], Float64[np.ndarray, " e"]],
    mass: tuple[Pointers, Int32[np.ndarray, " f"], Float64[np.ndarray, " f"]],
    vectors: Float64[np.ndarray, "n k"],
    values: Float64[np.ndarray, " k"],
    weights: Float64[np.ndarray, " n"],
    with_residuals: bool,
    images: Out[Float64[np.ndarray, "2 k"]],
    part: Out[Sums],
    sums: Out[Sums],
) -> None:
    """Add φᵀWφ, φᵀBφ and Σ (Wφ - λBφ)² / weights of each column to the rows of `sums`; W and B are symmetric.

    W and B are given by int64 pointers, int32 indices and entries; `values` are the λ. Without residuals
    the values are not used and the last row of `sums` does not change. `images` (2, k) and `part`
    (3, k), filled with 0, are scratch. One loop serves both uses.
    """
