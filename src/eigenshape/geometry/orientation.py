"""Which side of a surface is out, where its faces do not say."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from eigenshape.geometry.measure import area_vectors, unit_scaled, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh


def orient_outward(mesh: TriangleMesh) -> TriangleMesh:
    """Turn all faces over if more of what lies on the convex hull faces into it than out of it.

    Where a surface touches its convex hull, its outside is the hull's outside, also on a part or a one-sided scan,
    whose signed volume says nothing. Corners of the hull's facets vote by N · n, by the area of the facet with normal
    n. Sound for what is seen from outside; a room from within, or a bowl without an outer side, is turned over.

    Parameters
    ----------
    mesh : TriangleMesh
        Neighbouring faces must agree already: one decision is made for all.

    Returns
    -------
    TriangleMesh
        The same mesh where it faces out already, or is flat and has no outside.
    """
    points, _ = unit_scaled(mesh)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return mesh
    areas = np.linalg.norm(area_vectors(points[hull.simplices]), axis=1)
    sums = vertex_normals(mesh)[hull.simplices].sum(axis=1)
    vote = areas @ np.einsum("fi,fi->f", sums, hull.equations[:, :3])
    return mesh if vote >= 0 else TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
