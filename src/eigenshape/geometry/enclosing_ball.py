"""The smallest ball around some points."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import finite_rows, frozen
from eigenshape._errors import InvalidShapeError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.simplices import size_one

Points = Float[np.ndarray, "n d"]
Support = list[int]


@dataclass(frozen=True, eq=False)
class EnclosingBall:
    """A Euclidean ball in R^d.

    Attributes
    ----------
    center : (d,) float
        In length.
    radius : float
        In length.
    """

    center: Float[np.ndarray, " d"]
    radius: float


def enclosing_ball(points: ArrayLike) -> EnclosingBall:
    """Find the smallest ball that holds all points.

    It is the smallest ball of some d + 1 of them at most. Starting with one, the farthest point outside the ball joins
    those that hold it, and the largest of the balls of some of these replaces it, until no point is outside (an active
    set method; the ball grows with every step: Welzl 1991; Gärtner 1999). Exact up to rounding; time grows as 2^d.

    Parameters
    ----------
    points : (n, d) float
        At least one.

    Returns
    -------
    EnclosingBall

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    """
    rows = finite_rows(points, "points")
    if not rows.size:
        raise InvalidShapeError("A ball must have points to hold; there are none.")
    unit, scale = size_one(rows)
    middle = (unit.min(axis=0) + unit.max(axis=0)) / 2
    unit, inner = size_one(unit - middle)
    center = _center(unit)
    radius = np.sqrt(((unit - center) ** 2).sum(axis=1).max())
    return EnclosingBall(frozen(scale * (middle + inner * center)), float(scale * inner * radius))


def _center(points: Points) -> Float[np.ndarray, " d"]:
    support, center, value = [0], points[0], 0.0
    while True:
        far = int(((points - center) ** 2).sum(axis=1).argmax())
        if far in support:
            return center
        grown = max(
            (_held(points, some) for some in _with(far, support, points.shape[1])),
            key=lambda held: held[0],
        )
        if grown[0] <= value:  # what is left is rounding
            return center
        value, center, support = grown


def _with(far: int, support: Support, dim: int) -> list[Support]:
    """List the sets of at most d + 1 points that may hold a ball, and have the new one."""
    return [
        [*some, far]
        for size in range(min(dim, len(support)) + 1)
        for some in combinations(support, size)
    ]


def _held(points: Points, support: Support) -> tuple[float, Float[np.ndarray, " d"], Support]:
    """Return the squared radius of the ball that all points of a support touch, its centre, and the support.

    The radius comes from the centre's barycentric coordinates, Σ w |p - c|²: whatever coordinates ≥ 0 rounding has
    left, no ball around these points is smaller. With one below 0 fewer points hold the ball, and 0 is returned.
    """
    base, sides = points[support[-1]], points[support[:-1]] - points[support[-1]]
    offset, _, rank, _ = np.linalg.lstsq(2 * sides, (sides**2).sum(axis=1), rcond=None)
    inner = np.linalg.lstsq(sides.T, offset, rcond=None)[0]
    weights = np.append(inner, 1 - inner.sum())
    if rank < len(sides) or (weights < 0).any():
        return 0.0, base, support
    center = weights @ points[support]
    return float(weights @ ((points[support] - center) ** 2).sum(axis=1)), center, support
