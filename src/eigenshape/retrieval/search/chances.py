"""What scores mean: how many unrelated shapes would score as well, and which class is meant."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

# All figures are of experiments/ch5_retrieval, default codebook: chosen on the tuning half, and
# checked on the reporting half by its `answers.py`.

# Share of pairs of shapes of different classes that score at most so much, of 157,976 pairs. Below
# 0.29 this extrapolates.
SCORES = (0.0, 0.29, 0.305, 0.322, 0.355, 0.381, 0.414, 0.469, 0.541, 0.734, 0.861, 0.991, 1.35)
SHARES = (1e-6, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.9, 1.0)
# Best score above which a query has nothing alike: where the share of queries without their class
# that are missed equals that of right first matches that are warned of (12 % each), of closed and
# open queries together. The best of more shapes is better by chance: the threshold falls by a
# factor n^-0.1, which keeps the share of false alarms among 15 and 40 shapes.
LARGEST_SCORE = 0.35
AT_SHAPES, GROWTH = 100, 0.1
# Of the probability of a class, by maximum likelihood: a match of this score weighs as much as all
# classes that were not found, and the weight of a match and of a class is a power of it.
EVEN_SCORE, MATCH_POWER, CLASS_POWER = 0.474, 14.4, 0.58
N_VOTES = 5  # best matches whose labels count; ten were no better
LEAST_SCORE = 0.01  # so that powers stay finite


def chances(scores: float | Float[np.ndarray, " k"]) -> Float[np.ndarray, "*k"]:
    """Return for each score the share of unrelated shapes that would score as well or better."""
    return np.asarray(np.exp(np.interp(scores, SCORES, np.log(SHARES))))


def nothing_alike(scores: Float[np.ndarray, " k"], n_shapes: int) -> bool:
    """Return whether the best score of a query is no better than those of unrelated shapes.

    Parameters
    ----------
    scores : (k,) float
        The best scores of a query, in any order.
    n_shapes : int
        Number of shapes that they are the best of.
    """
    if not len(scores):
        return True
    return bool(scores.min() > LARGEST_SCORE * (AT_SHAPES / n_shapes) ** GROWTH)


def class_chances(scores: Sequence[float], labels: Sequence[str | None]) -> dict[str, float]:
    """Return the probability of each label among the best five matches, most probable first.

    A match of score s weighs (0.474 / s)^14.4, a label the sum of its matches to the power 0.58,
    and all others together 1. Matches without label do not count.
    """
    weights: dict[str, float] = {}
    for score, label in list(zip(scores, labels, strict=True))[:N_VOTES]:
        if label is not None:
            weight = (EVEN_SCORE / max(score, LEAST_SCORE)) ** MATCH_POWER
            weights[label] = weights.get(label, 0.0) + weight
    powers = {label: weight**CLASS_POWER for label, weight in weights.items()}
    total = 1.0 + sum(powers.values())
    ranked = sorted(powers.items(), key=lambda item: (-item[1], item[0]))
    return {label: power / total for label, power in ranked}
