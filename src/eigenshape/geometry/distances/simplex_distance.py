"""Distances from points to flat simplices."""

from itertools import combinations

import numpy as np
from jaxtyping import Float


def squared_distances(
    points: Float[np.ndarray, "p d"], corners: Float[np.ndarray, "s corners d"]
) -> Float[np.ndarray, "p s"]:
    """Return the squared distance of each point to each simplex, in length².

    The nearest point of a simplex lies in the interior of one of its sides: the simplex itself, a
    facet, and so on down to a corner. There it is the foot of the perpendicular to the flat of that
    side. So the least distance over all sides that contain their foot is returned.
    """
    least = np.full((len(points), len(corners)), np.inf)
    numbers = range(corners.shape[1])
    for size in range(1, corners.shape[1] + 1):
        for side in combinations(numbers, size):
            np.minimum(least, _to_inside(points, corners[:, side]), out=least)
    return least


def _to_inside(
    points: Float[np.ndarray, "p d"], corners: Float[np.ndarray, "s corners d"]
) -> Float[np.ndarray, "p s"]:
    """Return squared distances to the flats of simplices; infinite if the foot is outside."""
    sides = corners[:, 1:] - corners[:, :1]
    ways = points[:, None] - corners[None, :, 0]
    weights = np.einsum("sda,psd->psa", np.linalg.pinv(sides), ways)
    inside = (weights >= 0).all(axis=2) & (weights.sum(axis=2) <= 1)
    left = ways - np.einsum("psa,sad->psd", weights, sides)
    return np.where(inside, np.einsum("psd,psd->ps", left, left), np.inf)
