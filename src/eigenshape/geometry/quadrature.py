"""Points with weights: ∫ f over a shape is about Σ w_i f(x_i)."""

from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import finite_rows, frozen, positive_values, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes


@dataclass(frozen=True, eq=False, init=False)
class Quadrature:
    """Points of an m-dimensional shape in R^d and the measure that each stands for.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit. Copied, then read-only.
    weights : (n,) float
        Measure of each point, positive: in length^m, or without unit where they sum to 1. Copied, then read-only.
    dim : int
        m, 1 to d.

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    InvalidParameterError
        If a weight is not positive and finite, they are not one a point, or `dim` is not in 1..d.
    """

    points: Float[np.ndarray, "n d"]
    weights: Float[np.ndarray, " n"]
    dim: int

    def __init__(self, points: ArrayLike, weights: ArrayLike, dim: SupportsIndex) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A quadrature must have points; it has none.")
        measure = positive_values(weights, "weights")
        if len(measure) != len(coordinates):
            raise InvalidParameterError(
                f"weights must be one a point; there are {len(measure)} for {len(coordinates)} points."
            )
        object.__setattr__(self, "dim", whole_number(dim, "dim", 1, coordinates.shape[1]))
        object.__setattr__(self, "points", frozen(coordinates))
        object.__setattr__(self, "weights", frozen(measure))

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)

    def __repr__(self) -> str:
        return f"Quadrature({self.n_points} points in R^{self.points.shape[1]}, dim={self.dim})"


def mesh_quadrature(mesh: MeshLike) -> Quadrature:
    """Weigh each point of a mesh with 1/(m+1) of the volume of its simplices: exact for linear functions.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the corners of another, or a point no simplex.
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    return Quadrature(mesh.points, dual_volumes(mesh), mesh.dim)


def uniform_quadrature(points: ArrayLike, dim: SupportsIndex) -> Quadrature:
    """Give n points of a uniform sample the weight 1/n each (thesis 2.2)."""
    coordinates = finite_rows(points, "points")
    return Quadrature(coordinates, np.full(len(coordinates), 1 / max(len(coordinates), 1)), dim)


def sphere_quadrature(n: SupportsIndex) -> Quadrature:
    """Integrate over the unit sphere, polynomials up to degree 2n - 1 exactly: n Gauss latitudes, 2n longitudes."""
    count = whole_number(n, "n", 2, 10**4)
    heights, weights = np.polynomial.legendre.leggauss(count)
    angles = np.pi * np.arange(2 * count) / count
    z, angle = (grid.ravel() for grid in np.meshgrid(heights, angles, indexing="ij"))
    ring = np.sqrt(1 - z**2)
    points = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return Quadrature(points, np.repeat(weights * np.pi / count, 2 * count), 2)


def torus_quadrature(
    n_around: SupportsIndex, n_across: SupportsIndex, *, outer: float = 1.0, inner: float = 0.4
) -> Quadrature:
    """Integrate over a torus by the rectangle rule, which for smooth periodic functions errs by less than any power."""
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
