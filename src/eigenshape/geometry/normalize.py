"""Bring a shape to a standard size; orientation stays, the mean of the vertices goes to the origin."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import face_area_vectors, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh

Points = Float[np.ndarray, "n 3"]


def normalize_box(mesh: TriangleMesh) -> TriangleMesh:
    """Scale so that the longest side of the axis-aligned bounding box is 1 (thesis 5.4).

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.
    """
    return _resized(mesh, lambda points: float(np.ptp(points, axis=0).max()))


def normalize_area(mesh: TriangleMesh) -> TriangleMesh:
    """Scale so that the surface area is 1.

    Raises
    ------
    InvalidShapeError
        If no face has area.
    """
    return _resized(
        mesh, lambda points: float(np.linalg.norm(face_area_vectors(points, mesh.faces), axis=1).sum()) ** 0.5
    )


def normalize_diameter(mesh: TriangleMesh) -> TriangleMesh:
    """Scale so that the two farthest vertices are 1 apart.

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.
    """
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
    try:
        candidates = points[ConvexHull(points).vertices]
    except QhullError:  # flat or straight: no hull with volume
        candidates = np.unique(points, axis=0)
    return float(pdist(candidates).max(initial=0.0))
