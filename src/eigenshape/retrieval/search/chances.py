"""What a score means: how many unrelated shapes would score as well."""

import numpy as np
from jaxtyping import Float

# Share of pairs of shapes of different classes that score at most so much, of 17,904 pairs of
# experiments/ch5_retrieval (tuning half, default codebook, two draws). Checked by taking the shares
# of one half of the classes for the other: 1.6 % for 1 %, 4.5 % for 5 %, 1.1 % for 0.5 %, and 0.7 %
# for 0.1 %, since some classes are alike, as horses and dogs. Below 0.25 this extrapolates.
SCORES = (0.0, 0.254, 0.276, 0.286, 0.32, 0.348, 0.381, 0.424, 0.474, 0.577, 0.87, 0.964, 1.0)
SHARES = (1e-6, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.9, 1.0)
N_BEST = 30  # scores that are looked at, as many as are verified
# Unrelated shapes to be expected, for each one found, above which nothing is taken to be alike. On
# the tuning half it is said of 76 % of queries whose class is not there, and of 25 % of those whose
# class is: it is meant as a warning.
MOST_EXPECTED = 0.2


def chances(scores: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """Return for each score the share of unrelated shapes that would score as well or better."""
    return np.asarray(np.exp(np.interp(scores, SCORES, np.log(SHARES))))


def nothing_alike(scores: Float[np.ndarray, " k"], n_shapes: int) -> bool:
    """Return whether unrelated shapes alone would explain the best scores of a query.

    Of n unrelated shapes n · chance score as well as the best k. If this is more than a fifth of k
    for each k, nothing stands out (Benjamini and Hochberg 1995).

    Parameters
    ----------
    scores : (k,) float
        The best scores of a query, in any order.
    n_shapes : int
        Number of shapes that they are the best of.
    """
    best = np.sort(scores)[:N_BEST]
    if not len(best):
        return True
    expected = n_shapes * chances(best) / np.arange(1, len(best) + 1)
    return bool(expected.min() > MOST_EXPECTED)
