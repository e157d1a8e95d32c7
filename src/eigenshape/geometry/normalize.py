"""Scaling of meshes to a standard size, with the mean of the vertices at the origin."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import cdist

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices

Points = Float[np.ndarray, "n 3"]


def normalize_box(mesh: MeshLike) -> TriangleMesh:
    """Scale a mesh so that the longest side of its axis-aligned bounding box is 1 (thesis 5.4).

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    TriangleMesh
        The scaled mesh, with the mean of its vertices at the origin.

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.

    See Also
    --------
    normalize_area, normalize_diameter

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.geometry.normalize_box(es.shapes.grid(2, 2, width=4, height=2))
    >>> np.ptp(mesh.vertices, axis=0).tolist()
    [1.0, 0.5, 0.0]
    """
    mesh = as_mesh(mesh)
    return _resize(mesh, lambda points: float(np.ptp(points, axis=0).max()))


def normalize_area(mesh: MeshLike) -> TriangleMesh:
    """Scale a mesh so that its surface area is 1.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    TriangleMesh
        The scaled mesh, with the mean of its vertices at the origin.

    Raises
    ------
    InvalidShapeError
        If no face has area.

    See Also
    --------
    normalize_box, normalize_diameter

    Examples
    --------
    >>> import eigenshape as es
    >>> round(es.geometry.surface_area(es.geometry.normalize_area(es.icosphere(1))), 6)
    1.0
    """
    mesh = as_mesh(mesh)
    sound = np.delete(mesh.faces, degenerate_simplices(mesh), axis=0)
    return _resize(
        mesh, lambda points: float(np.linalg.norm(area_vectors(points[sound]), axis=1).sum()) ** 0.5
    )


def normalize_diameter(mesh: MeshLike) -> TriangleMesh:
    """Scale a mesh so that the largest distance between two vertices is 1.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    TriangleMesh
        The scaled mesh, with the mean of its vertices at the origin.

    Raises
    ------
    InvalidShapeError
        If all vertices are equal.

    See Also
    --------
    normalize_box, normalize_area

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.geometry.normalize_diameter(es.shapes.grid(2, 2, width=3, height=4))
    >>> mesh.vertices.max(axis=0).round(6).tolist()
    [0.3, 0.4, 0.0]
    """
    mesh = as_mesh(mesh)
    return _resize(mesh, _diameter)


def _resize(mesh: TriangleMesh, size_of: Callable[[Points], float]) -> TriangleMesh:
    points, _ = scale_to_unit(mesh)
    size = size_of(points)
    if not size > 0:
        raise InvalidShapeError(
            "A mesh must have a size above zero to be normalized; "
            f"its {mesh.n_vertices} vertices give size {size}."
        )
    return TriangleMesh(points / size, mesh.faces)


def _diameter(points: Points) -> float:
    corners = _hull(points)
    # All points of a sphere lie on its hull, so distances are computed for a thousand at a time.
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
