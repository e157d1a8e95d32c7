"""Points anywhere on a mesh, given by a simplex and barycentric coordinates."""

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import describe_value, require_type
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_volumes
from eigenshape.geometry.simplices import scaled_corners, volumes
from eigenshape.geometry.simplicial import Mesh

# A point farther from where its weights put it, in extents of the mesh, belongs to another mesh.
ELSEWHERE = 1e-6
# More points would take many gigabytes: a point on a surface takes 56 bytes, and twice that while
# it is drawn.
MOST_POINTS = 10**8


@record
class SurfacePoints(ReadOnly):
    """Points on a mesh of dimension m, as drawn by `sample_surface`.

    Attributes
    ----------
    points : (p, d) float
        Coordinates, in length.
    simplices : (p,) int
        Simplex in which each point lies; for a surface, its face.
    weights : (p, m+1) float
        Barycentric coordinates of each point in its simplex, at least 0, with sum 1.

    Examples
    --------
    The weights give the points back:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> found = es.geometry.sample_surface(mesh, 10, rng=np.random.default_rng(0))
    >>> corners = mesh.vertices[mesh.faces[found.simplices]]
    >>> np.allclose(np.einsum("pc,pcd->pd", found.weights, corners), found.points)
    True
    """

    points: Float[np.ndarray, "p d"]
    simplices: Int[np.ndarray, " p"]
    weights: Float[np.ndarray, "p corners"]

    @property
    def n_points(self) -> int:
        """Number of points, p."""
        return len(self.points)


def sample_surface(mesh: MeshLike, n: Integer, *, rng: np.random.Generator) -> SurfacePoints:
    """Draw random points on a mesh, uniformly by volume and independently (thesis 4.1).

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m: for a surface, uniformly by area.
    n : int
        Number of points, 1 to 10⁸.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    SurfacePoints

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume.
    InvalidParameterError
        If `n` is out of range.

    See Also
    --------
    farthest_points : Choose evenly spread vertices.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> drawn = es.geometry.sample_surface(es.icosphere(2), 5, rng=np.random.default_rng(0))
    >>> drawn.points.shape, drawn.simplices.shape, drawn.weights.shape
    ((5, 3), (5,), (5, 3))
    """
    mesh = as_simplicial(mesh)
    require_type(rng, np.random.Generator, "rng")
    count = whole_number(n, "n", 1, MOST_POINTS)
    require_volumes(mesh)
    shares = np.cumsum(volumes(scaled_corners(mesh)[0]))
    simplices = np.searchsorted(shares, rng.random(count) * shares[-1], side="right")
    # Exponential variables divided by their sum are uniform on a simplex.
    spacings = rng.standard_exponential((count, mesh.dim + 1))
    return place_points(mesh, simplices, spacings / spacings.sum(axis=1, keepdims=True))


def place_points(
    mesh: Mesh, simplices: Int[np.ndarray, " p"], weights: Float[np.ndarray, "p corners"]
) -> SurfacePoints:
    """Return the points with given barycentric coordinates in given simplices."""
    points = np.einsum("pc,pcd->pd", weights, mesh.points[mesh.simplices[simplices]])
    return SurfacePoints(points, simplices, weights)


def vertex_number(n_vertices: int, vertex: Any, name: str) -> int:
    """Return a vertex that was given where a SurfacePoints could be; raise an error if it is none."""
    if not hasattr(vertex, "__index__"):
        raise InvalidParameterError(
            f"{name} must be a vertex or a SurfacePoints; the value is {describe_value(vertex)}. Find a "
            "point from coordinates by closest_points(mesh, [point])."
        )
    return whole_number(vertex, name, 0, n_vertices - 1)


def require_one(place: SurfacePoints, name: str) -> None:
    """Raise an error if an argument has more points than one."""
    if place.n_points != 1:
        raise InvalidParameterError(f"{name} must be one point; there are {place.n_points}.")


def require_on(mesh: Mesh, places: SurfacePoints, name: str) -> None:
    """Raise an error if points do not lie on a mesh; `name` is that of the argument."""
    try:
        there = place_points(mesh, places.simplices, places.weights).points
        away = np.abs(there - places.points).max(axis=1)
    except (IndexError, ValueError):  # no such faces, or no such numbers of weights
        away = np.full(places.n_points, np.inf)
    if (away > ELSEWHERE * np.ptp(mesh.points, axis=0).max()).any():
        place = int(np.argmax(away))
        raise InvalidParameterError(
            f"{name} must lie on this mesh; point {place} at {places.points[place].tolist()} in face "
            f"{places.simplices[place]} does not. Try closest_points(mesh, {name}.points)."
        )
