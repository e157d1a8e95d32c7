"""Points anywhere on a surface, each known by its face and its place in it."""

from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, whole_number
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.simplices import require_volumes, scaled_corners, volumes
from eigenshape.geometry.simplicial import Mesh

MOST = 10**8  # points: gigabytes


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a mesh of dimension m.

    Attributes
    ----------
    points : (p, d) float
        Coordinates, in length.
    simplices : (p,) int
        The simplex that each lies in; on a surface, its face.
    weights : (p, m+1) float
        Barycentric coordinates there, ≥ 0, with sum 1.
    """

    points: Float[np.ndarray, "p d"]
    simplices: Int[np.ndarray, " p"]
    weights: Float[np.ndarray, "p corners"]

    @property
    def n_points(self) -> int:
        """Number of points, p."""
        return len(self.points)


def sample_surface(mesh: MeshLike, n: SupportsIndex, *, rng: np.random.Generator) -> SurfacePoints:
    """Throw n points on a mesh, uniformly by volume and independently (thesis 4.1).

    Parameters
    ----------
    mesh : MeshLike
    n : int
        At least 1.
    rng : numpy.random.Generator

    Returns
    -------
    SurfacePoints

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume.
    InvalidParameterError
        If n is not in range.
    """
    mesh = as_simplicial(mesh)
    require_type(rng, np.random.Generator, "rng")
    count = whole_number(n, "n", 1, MOST)
    require_volumes(mesh)
    shares = np.cumsum(volumes(scaled_corners(mesh)[0]))
    simplices = np.searchsorted(shares, rng.random(count) * shares[-1], side="right")
    # Spacings of exponential variables are uniform on a simplex.
    spacings = rng.standard_exponential((count, mesh.dim + 1))
    return place_points(mesh, simplices, spacings / spacings.sum(axis=1, keepdims=True))


def place_points(
    mesh: Mesh, simplices: Int[np.ndarray, " p"], weights: Float[np.ndarray, "p corners"]
) -> SurfacePoints:
    """Return the points with these barycentric coordinates in these simplices."""
    points = np.einsum("pc,pcd->pd", weights, mesh.points[mesh.simplices[simplices]])
    return SurfacePoints(frozen(points), frozen(simplices), frozen(weights))
