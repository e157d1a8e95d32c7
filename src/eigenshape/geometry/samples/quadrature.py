"""Quadrature: points with weights, so that ∫ f over a shape is about Σ w_i f(x_i)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import ReadOnly, finite_rows, freeze, positive_values, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._typing import ArrayLike, Integer


@dataclass(frozen=True, eq=False, init=False)
class Quadrature(ReadOnly):
    """Points of an m-dimensional shape in R^d with positive weights.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit. They are copied, and the copy is read-only.
    weights : (n,) float or None
        Weight of each point, positive: in length^m, or without unit if the weights sum to 1. They
        are copied, and the copy is read-only. None stands for 1/n each, as for a uniform random
        sample (thesis 2.2).
    dim : int
        Dimension m of the shape, 1 to d.

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    InvalidParameterError
        If a weight is not positive and finite, the number of weights is not the number of points,
        or `dim` is not in 1..d.

    See Also
    --------
    shape_quadrature : That of a mesh or of a point cloud.

    Examples
    --------
    Simpson's rule on the interval from 0 to 1.

    >>> import eigenshape as es
    >>> es.geometry.Quadrature([[0], [0.5], [1]], [1 / 6, 4 / 6, 1 / 6], dim=1)
    Quadrature(3 points in R^1, dim=1)
    """

    points: Float[np.ndarray, "n d"]
    weights: Float[np.ndarray, " n"]
    dim: int

    def __init__(self, points: ArrayLike, weights: ArrayLike | None, dim: Integer) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A quadrature must have points; it has none.")
        share = np.full(len(coordinates), 1 / len(coordinates))
        measure = positive_values(share if weights is None else weights, "weights")
        if len(measure) != len(coordinates):
            raise InvalidParameterError(
                "weights must hold one number per point; "
                f"there are {len(measure)} for {len(coordinates)} points."
            )
        object.__setattr__(self, "dim", whole_number(dim, "dim", 1, coordinates.shape[1]))
        object.__setattr__(self, "points", freeze(coordinates))
        object.__setattr__(self, "weights", freeze(measure))

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)

    def __repr__(self) -> str:
        return f"Quadrature({self.n_points} points in R^{self.points.shape[1]}, dim={self.dim})"
