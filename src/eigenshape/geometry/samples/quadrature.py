"""Quadrature: points with weights, so that ∫ f over a shape is about Σ w_i f(x_i)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import ReadOnly, finite_rows, freeze, positive_values, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._text import html_repr
from eigenshape._typing import ArrayLike, Integer
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes


@dataclass(frozen=True, eq=False, init=False)
class Quadrature(ReadOnly):
    """Points of an m-dimensional shape in R^d with positive weights.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit. They are copied, and the copy is read-only.
    weights : (n,) float
        Weight of each point, positive: in length^m, or without unit if the weights sum to 1. They
        are copied, and the copy is read-only.
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
    mesh_quadrature, cloud_quadrature, uniform_quadrature

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

    _repr_html_ = html_repr

    def __init__(self, points: ArrayLike, weights: ArrayLike, dim: Integer) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A quadrature must have points; it has none.")
        measure = positive_values(weights, "weights")
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


def mesh_quadrature(mesh: MeshLike) -> Quadrature:
    """Give each point of a mesh 1/(m+1) of the volume of its simplices as weight.

    The rule is exact for functions that are linear on each simplex.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m.

    Returns
    -------
    Quadrature
        The points of the mesh with weights in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume, two simplices have the same corners, or a point has no simplex.

    See Also
    --------
    cloud_quadrature : Weights for points without a mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.mesh_quadrature(es.shapes.interval(4)).weights.tolist()
    [0.125, 0.25, 0.25, 0.25, 0.125]
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    return Quadrature(mesh.points, dual_volumes(mesh), mesh.dim)


def uniform_quadrature(points: ArrayLike, dim: Integer) -> Quadrature:
    """Give each of n points the weight 1/n, as for a uniform random sample (thesis 2.2).

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit.
    dim : int
        Dimension m of the sampled shape, 1 to d.

    Returns
    -------
    Quadrature
        The points, with weights that have no unit and sum to 1.

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    InvalidParameterError
        If `dim` is not in 1..d.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.uniform_quadrature([[0, 0], [1, 0], [0, 1], [1, 1]], dim=2).weights.tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    coordinates = finite_rows(points, "points")
    return Quadrature(coordinates, np.full(len(coordinates), 1 / max(len(coordinates), 1)), dim)


def sphere_quadrature(n: Integer) -> Quadrature:
    """Return a quadrature of the unit sphere that is exact for polynomials up to degree 2n - 1.

    The product of a Gauss rule with n latitudes and 2n equal steps of longitude.

    Parameters
    ----------
    n : int
        Number of latitudes, 2 to 10,000.

    Returns
    -------
    Quadrature
        2n² points, with weights that sum to 4π.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range.

    Examples
    --------
    The integral of z² over the unit sphere is 4π/3.

    >>> import eigenshape as es
    >>> rule = es.geometry.sphere_quadrature(4)
    >>> integral = (rule.weights * rule.points[:, 2] ** 2).sum()
    >>> bool(abs(integral - 4 * 3.141592653589793 / 3) < 1e-12)
    True
    """
    count = whole_number(n, "n", 2, 10**4)
    heights, weights = np.polynomial.legendre.leggauss(count)
    angles = np.pi * np.arange(2 * count) / count
    z, angle = (grid.ravel() for grid in np.meshgrid(heights, angles, indexing="ij"))
    ring = np.sqrt(1 - z**2)
    points = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return Quadrature(points, np.repeat(weights * np.pi / count, 2 * count), 2)


def torus_quadrature(
    n_around: Integer, n_across: Integer, *, outer: float = 1.0, inner: float = 0.4
) -> Quadrature:
    """Return a quadrature of a torus, with equal steps in both angles.

    For smooth functions the error falls faster than any power of the number of points, because the
    integrand is periodic.

    Parameters
    ----------
    n_around, n_across : int
        Number of points around the axis and across the tube, 3 to 100,000 each.
    outer, inner : float
        Radius of the circle in the middle of the tube, and radius of the tube, in length.

    Returns
    -------
    Quadrature
        Points of the torus, with weights in length².

    Raises
    ------
    InvalidParameterError
        If a number is out of range or a radius is not positive.

    See Also
    --------
    torus : A mesh of the same torus.

    Examples
    --------
    The area of a torus is 4π² times both radii.

    >>> import eigenshape as es
    >>> rule = es.geometry.torus_quadrature(12, 12, outer=1, inner=0.4)
    >>> bool(abs(rule.weights.sum() - 4 * 3.141592653589793**2 * 0.4) < 1e-12)
    True
    """
    around = whole_number(n_around, "n_around", 3, 10**5)
    across = whole_number(n_across, "n_across", 3, 10**5)
    positive_values([outer, inner], "outer and inner")
    angles = np.meshgrid(
        2 * np.pi * np.arange(around) / around,
        2 * np.pi * np.arange(across) / across,
        indexing="ij",
    )
    u, v = (angle.ravel() for angle in angles)
    rim = outer + inner * np.cos(v)
    points = np.column_stack([rim * np.cos(u), rim * np.sin(u), inner * np.sin(v)])
    return Quadrature(points, rim * inner * (2 * np.pi) ** 2 / (around * across), 2)
