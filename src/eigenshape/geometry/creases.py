"""Creases of surfaces, and normals that are not averaged across them."""

import numpy as np
from jaxtyping import Bool, Float

from eigenshape._corners import scaled_corners
from eigenshape._vectors import area_vectors, row_dots, sum_rows, unit_vectors
from eigenshape.geometry.facets import corner_fans
from eigenshape.geometry.measure import face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# A crease is an edge at which the surface turns by more than this angle, in degrees ...
LEAST_TURN = 40.0
# ... and by more than this many times the lower quartile of the turns at all edges. The quartile is
# at most 0.2° on machine parts, whose faces are flat or cylindrical, and 1° to 10° on organic
# shapes of 1,000 to 50,000 faces. There many edges of coarse faces turn by 40° in smooth places.
TIMES_QUARTILE = 20.0
# An edge at which the surface turns by more than this angle is a crease on any shape: the edges of
# an octahedron turn by 70.5°. Of a horse, a hand and a human of 2,000 faces it splits the normals
# of 0.1 % to 9 % of the vertices, at ears and hooves; 50° would split 1 % to 22 %.
LARGEST_TURN = 70.0


def smooth_pairs(mesh: TriangleMesh) -> Bool[np.ndarray, " p"]:
    """Return, for each pair of `face_pairs`, whether the edge between the two faces is no crease.

    The faces must be turned alike. A face without area has no creases.
    """
    normals = face_normals(mesh)
    pairs, _ = edge_table(mesh).face_pairs
    one, two = normals[pairs].transpose(1, 0, 2)
    cosines = row_dots(one, two)
    cosines[~(one.any(axis=1) & two.any(axis=1))] = 1.0
    if not len(cosines):
        return np.ones(0, dtype=bool)
    quartile = np.degrees(np.arccos(min(np.quantile(cosines, 0.75), 1.0)))
    limit = np.clip(TIMES_QUARTILE * quartile, LEAST_TURN, LARGEST_TURN)
    return cosines >= np.cos(np.radians(limit))


def corner_normals(mesh: TriangleMesh) -> Float[np.ndarray, "f 3 3"]:
    """Return a unit normal for each corner of each face, not averaged across creases.

    It is the mean of the normals of the faces at that vertex that are connected to the face without
    crossing a crease, weighted by area. Where a surface has no creases it is the normal of
    `vertex_normals`. The faces must be turned alike.
    """
    points, fans = corner_fans(mesh, smooth_pairs(mesh))
    vectors = np.repeat(area_vectors(scaled_corners(mesh)[0]), 3, axis=0)
    return unit_vectors(sum_rows(fans, vectors, len(points)))[fans].reshape(-1, 3, 3)
