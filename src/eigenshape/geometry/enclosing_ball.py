"""The smallest ball around given points."""

from itertools import combinations

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one

Points = Float[np.ndarray, "n d"]
Support = list[int]


@record
class EnclosingBall(ReadOnly):
    """A ball in R^d, as found by `enclosing_ball`.

    Attributes
    ----------
    center : (d,) float
        Center of the ball, in length.
    radius : float
        Radius of the ball, in length.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.enclosing_ball([[0.0, 0.0], [2.0, 0.0], [1.0, 0.5]])
    EnclosingBall(center=array([1., 0.]), radius=1.0)
    """

    center: Float[np.ndarray, " d"]
    radius: float


def enclosing_ball(points: ArrayLike) -> EnclosingBall:
    """Find the smallest ball that contains all points.

    The result is exact up to rounding. The time grows as 2^d with the dimension.

    Parameters
    ----------
    points : (n, d) float
        At least one point, in any length unit.

    Returns
    -------
    EnclosingBall

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.

    Notes
    -----
    An active set method (Welzl 1991; Gärtner 1999). The smallest ball touches at most d + 1 of the
    points, its support. Starting from one point, the farthest point outside the ball joins the
    support, and the ball is replaced by the largest of the balls around subsets of the support. The
    ball grows with every step, until no point lies outside.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.geometry.enclosing_ball([[0, 0], [2, 0], [1, 0.5]])
    >>> ball.center.round(6).tolist(), round(ball.radius, 6)
    ([1.0, 0.0], 1.0)
    """
    rows = finite_rows(points, "points")
    if not rows.size:
        raise InvalidShapeError("An enclosing ball must contain points; there are none.")
    unit, scale = size_one(rows)
    middle = (unit.min(axis=0) + unit.max(axis=0)) / 2
    unit, inner = size_one(unit - middle)
    support, center, value = [0], unit[0], 0.0
    while (far := int(((unit - center) ** 2).sum(axis=1).argmax())) not in support:
        # The new ball touches the far point and at most d points of the old support.
        candidates = [
            _circumscribed_ball(unit, [*subset, far])
            for size in range(min(unit.shape[1], len(support)) + 1)
            for subset in combinations(support, size)
        ]
        grown = max(candidates, key=lambda ball: ball[0])
        if grown[0] <= value:  # the far point is outside by rounding only
            break
        value, center, support = grown
    radius = np.sqrt(((unit - center) ** 2).sum(axis=1).max())
    return EnclosingBall(scale * (middle + inner * center), float(scale * inner * radius))


def _circumscribed_ball(
    points: Points, support: Support
) -> tuple[float, Float[np.ndarray, " d"], Support]:
    """Return the squared radius of the ball that all support points touch, its center, the support.

    The radius comes from the barycentric coordinates w of the center, as Σ w |p - c|²: if all w are
    at least 0, no ball around these points is smaller, whatever the rounding of w. If one is
    negative, fewer points determine the ball, and the radius returned is 0.
    """
    base, sides = points[support[-1]], points[support[:-1]] - points[support[-1]]
    offset, _, rank, _ = np.linalg.lstsq(2 * sides, (sides**2).sum(axis=1), rcond=None)
    inner = np.linalg.lstsq(sides.T, offset, rcond=None)[0]
    weights = np.append(inner, 1 - inner.sum())
    if rank < len(sides) or (weights < 0).any():
        return 0.0, base, support
    center = weights @ points[support]
    return float(weights @ ((points[support] - center) ** 2).sum(axis=1)), center, support
