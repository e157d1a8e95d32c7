"""Directions of edges in the tangent planes of their ends."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape._corners import edge_keys, face_angles, scaled_corners, shared_facets, side_ends
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import (
    require_oriented_manifold,
    require_sound,
)


@record
class Directions(ReadOnly):
    """The directions of the sides of all faces; side 3f + s runs from corner s of face f to the next.

    Attributes
    ----------
    at_tail : (3f,) float
        Angle of the side in the tangent plane of its start, counter-clockwise from the first side
        there; those around an inner vertex are scaled to 2π.
    at_head : (3f,) float
        Angle at which its start is seen from its end, likewise.
    first : (n,) int
        The first side that leaves each vertex: on a boundary that with nothing on its right, else
        that of the lowest number.
    """

    at_tail: Float[np.ndarray, " h"]
    at_head: Float[np.ndarray, " h"]
    first: Int[np.ndarray, " n"]


def vertex_directions(mesh: TriangleMesh) -> Directions:
    """Measure the directions of edges around each vertex (Sharp, Soliman, Crane 2019).

    Raise InvalidShapeError if the mesh is no manifold, two neighboring faces are turned against
    each other, a face has no area or a vertex no face.
    """
    require_sound(mesh)
    require_oriented_manifold(mesh)
    twins = side_twins(mesh)
    tails, heads = side_ends(mesh.faces)
    # The first side of a vertex is that of its first face, or on a boundary that without a twin.
    _, first = np.unique(tails, return_index=True)
    boundary = np.flatnonzero(twins < 0)
    first[tails[boundary]] = boundary
    inner = np.ones(mesh.n_vertices, dtype=bool)
    inner[tails[boundary]] = False

    # Walk around all vertices at once, from side to side of a corner, and sum up the angles.
    angles = face_angles(mesh).ravel()
    at_tail, at_head = np.empty(len(angles)), np.empty(len(angles))
    around = np.zeros(mesh.n_vertices)
    walking, side = np.arange(mesh.n_vertices), first
    while walking.size:
        at_tail[side] = around[walking]
        around[walking] += angles[side]
        last = side - side % 3 + (side + 2) % 3
        at_head[last] = around[walking]
        side = twins[last]
        on = (side >= 0) & (side != first[walking])
        walking, side = walking[on], side[on]
    scale = np.where(inner, 2 * np.pi / around, 1.0)
    return Directions(at_tail * scale[tails], at_head * scale[heads], first)


def half_cotangents(mesh: TriangleMesh) -> Float[np.ndarray, " h"]:
    """Return half of the cotangent opposite to each side."""
    corners, _ = scaled_corners(mesh)
    to_next, to_last = (np.roll(corners, -turn, axis=1) - corners for turn in (1, 2))
    cosines = np.einsum("fij,fij->fi", to_next, to_last)
    sines = np.linalg.norm(np.cross(to_next, to_last), axis=2)
    return np.roll(cosines / sines, 1, axis=1).ravel() / 2


def side_twins(mesh: TriangleMesh) -> Int[np.ndarray, " h"]:
    """Return the side that lies on each, -1 on a boundary."""
    keys = edge_keys(mesh.faces, mesh.n_vertices)
    one, two = shared_facets(keys)
    twins = np.full(len(keys), -1)
    twins[one], twins[two] = two, one
    return twins
