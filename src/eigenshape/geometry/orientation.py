"""Orientation of surfaces: which side is outside."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from certeig.kit.threads import one_blas_thread
from eigenshape._corners import mean_normals
from eigenshape._vectors import row_dots, scale_to_unit, triangle_areas
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.face_turns import turn_faces
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.topology import is_closed


@one_blas_thread()
def orient_outward(mesh: MeshLike) -> TriangleMesh:
    """Turn all faces of a surface over if they face inward where it touches its convex hull.

    Where a surface touches its convex hull, its outside is the outside of the hull. This also holds
    for a part or for a scan from one side, whose signed volume says nothing.

    Parameters
    ----------
    mesh : MeshLike
        Consistently oriented, because all faces are turned together.

    Returns
    -------
    TriangleMesh
        The mesh itself if it faces outward already, or is flat.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.

    See Also
    --------
    repair : "orient" turns single faces over so that neighbors agree.

    Notes
    -----
    The corners of each facet of the hull vote by N · n, weighted by the area of the facet, with N
    the normal of the surface and n that of the facet. The result is right for a surface seen from
    outside. A room scanned from within, or a bowl without its outer side, is turned over.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.icosphere(1)
    >>> inverted = es.TriangleMesh(sphere.vertices, sphere.faces[:, ::-1])
    >>> es.geometry.enclosed_volume(inverted) < 0
    True
    >>> es.geometry.enclosed_volume(es.geometry.orient_outward(inverted)) > 0
    True
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    return turn_faces(mesh, np.full(mesh.n_faces, outward_vote(mesh) < 0))


def outward_vote(mesh: TriangleMesh) -> float:
    """Return how far normals agree with those of the convex hull, -1 to 1; 0 for a flat surface."""
    points, _ = scale_to_unit(mesh.vertices)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 0.0
    areas = triangle_areas(points[hull.simplices])
    means = mean_normals(mesh)[hull.simplices].mean(axis=1)
    return float(areas @ row_dots(means, hull.equations[:, :3]) / areas.sum())


def orient_closed_outward(mesh: TriangleMesh) -> TriangleMesh:
    """Turn all faces of a closed mesh over if its signed volume is negative.

    An open mesh, whose signed volume says nothing, is returned as it is; `orient_outward` decides
    for those.

    Raise InvalidShapeError if two neighboring faces of a closed mesh are turned against each other.
    """
    inward = is_closed(mesh) and enclosed_volume(mesh) < 0
    return turn_faces(mesh, np.full(mesh.n_faces, inward))
