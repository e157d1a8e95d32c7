"""About the largest eigenvalue of a symmetric matrix, from products with it."""

from collections.abc import Callable

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

Column = Float[np.ndarray, " n"]

# Steps of Lanczos: enough for a bound that is a few per cent too high.
LANCZOS_STEPS = 12
# Length of a residual, beside columns of length 1, below which the space is invariant.
INVARIANT = 1e-10


def largest_ritz_value(multiply: Callable[[Column], Column], n: int) -> tuple[float, float, float]:
    """Return the largest Ritz value of twelve steps of Lanczos, the length of the last residual, and a share of it.

    The Ritz value plus the length is seldom below the largest eigenvalue (Zhou and others 2006).
    The share is that of the last column in the Ritz vector: share times length is its residual.
    """
    column = np.random.default_rng(0).standard_normal(n)
    column /= np.linalg.norm(column)
    before, rest, diagonal, beside = np.zeros_like(column), 0.0, [], []
    for _ in range(LANCZOS_STEPS):
        image = multiply(column) - rest * before
        diagonal.append(float(column @ image))
        image -= diagonal[-1] * column
        rest = float(np.linalg.norm(image))
        beside.append(rest)
        if rest < INVARIANT:
            break
        before, column = column, image / rest
    values, vectors = sl.eigh_tridiagonal(diagonal, beside[:-1])
    return float(values[-1]), rest, abs(float(vectors[-1, -1]))
