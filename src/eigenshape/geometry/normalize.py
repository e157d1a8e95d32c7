"""Bring a shape to a standard size; orientation stays, the mean of the vertices goes to the origin."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import cdist

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices

Points = Float[np.ndarray, "n 3"]


def normalize_box(mesh: MeshLike) -> TriangleMesh:
    """Scale so that the longest side of the axis-aligned bounding box is 1 (thesis 5.4).

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.
    """
    mesh = as_mesh(mesh)
    return _resized(mesh, lambda points: float(np.ptp(points, axis=0).max()))


def normalize_area(mesh: MeshLike) -> TriangleMesh:
    """Scale so that the surface area is 1.

    Raises
    ------
    InvalidShapeError
        If no face has area.
    """
    mesh = as_mesh(mesh)
    sound = np.delete(mesh.faces, degenerate_simplices(mesh), axis=0)
    return _resized(
        mesh, lambda points: float(np.linalg.norm(area_vectors(points[sound]), axis=1).sum()) ** 0.5
    )


def normalize_diameter(mesh: MeshLike) -> TriangleMesh:
    """Scale so that the two farthest vertices are 1 apart.

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.
    """
    mesh = as_mesh(mesh)
    return _resized(mesh, _diameter)


def _resized(mesh: TriangleMesh, size_of: Callable[[Points], float]) -> TriangleMesh:
    points, _ = unit_scaled(mesh)
    size = size_of(points)
    if not size > 0:
        raise InvalidShapeError(
            f"A shape must have a size to be normalised; its {mesh.n_vertices} vertices span {size} of it."
        )
    return TriangleMesh(points / size, mesh.faces)


def _diameter(points: Points) -> float:
    corners = _hull(points)
    # A sphere has all its points on its hull: their distances come a thousand rows at a time.
    return max(
        float(cdist(rows, corners).max())
        for rows in np.split(corners, range(1000, len(corners), 1000))
    )


def _hull(points: Points) -> Float[np.ndarray, "h 3"]:
    axes = np.linalg.svd(points, full_matrices=False)[2]
    for dimension in (3, 2):
        try:
            return points[ConvexHull(points @ axes[:dimension].T).vertices]
        except QhullError:  # flat or straight: no hull with volume, or with area
            continue
    along = points @ axes[0]
    return points[[np.argmin(along), np.argmax(along)]]
