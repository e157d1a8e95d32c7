"""Straight paths from a vertex: the exponential map."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import finite_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.calculus.unfolding import (
    STRAIGHT,
    GeodesicPath,
    Sides,
    apex_of,
    as_path,
    cross,
    flat_corners,
    next_side,
    point_on_side,
    previous_side,
    walkable_sides,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.samples.surface_points import (
    SurfacePoints,
    require_on,
    require_one,
    vertex_number,
)
from eigenshape.operators.directions import require_oriented_manifold, vertex_directions


def trace_geodesic(
    mesh: MeshLike, start: Integer | SurfacePoints, vector: ArrayLike
) -> GeodesicPath:
    """Walk straight from a vertex or point, in the direction and for the length of a tangent vector.

    This is the exponential map. Across an edge the path goes on straight in the unfolded faces
    (Polthier and Schmies 1998). It ends early at a boundary.

    Parameters
    ----------
    mesh : MeshLike
        As in `geodesic_path`.
    start : int or SurfacePoints
        Vertex, or one point, such as `closest_points` finds.
    vector : (2,) float
        Tangent vector in length: at a vertex in its frame, row `start` of `operators.tangent_frames`,
        where angles around an inner vertex are scaled to 2π; at a point in the frame of its face, x
        along its first side.

    Returns
    -------
    GeodesicPath
        Shorter than `vector` only if it meets a boundary. The face where it ends, and the weights
        there, are those of ``closest_points(mesh, path.points[-1:])``.

    Raises
    ------
    InvalidShapeError
        As in `geodesic_path`.
    InvalidParameterError
        If the vertex is out of range, the point does not lie on this mesh or is not one, or `vector`
        is not two finite numbers, or points out of the surface at a boundary vertex.

    See Also
    --------
    logarithmic_map : The inverse.

    Examples
    --------
    Once around a sphere, and back to the start up to the discretization:

    >>> import eigenshape as es
    >>> path = es.calculus.trace_geodesic(es.icosphere(4), 0, [6.2832, 0.0])
    >>> bool(abs(path.points[-1] - path.points[0]).max() < 0.1)
    True
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    require_oriented_manifold(mesh)
    if isinstance(start, SurfacePoints):
        require_one(start, "start")
        require_on(mesh, start, "start")
        path = [start.points[0]]
    else:
        path = [mesh.vertices[vertex_number(mesh.n_vertices, start, "start")]]
    given = finite_values(vector, "vector")
    if len(given) != 2:
        raise InvalidParameterError(
            f"vector must hold two coordinates in the tangent frame; it holds {len(given)}."
        )
    points, scale = scale_to_unit(mesh)
    length = float(np.hypot(*given)) / scale
    if not length > 0:
        return as_path(np.array(path))
    sides = walkable_sides(TriangleMesh(points, mesh.faces))
    # The path starts at 0, in a face that lies in the plane around it.
    if isinstance(start, SurfacePoints):
        face, angle = int(start.simplices[0]), float(np.arctan2(given[1], given[0]))
        corners = flat_corners(points[mesh.faces[face]])
        a, b, c = (corners - start.weights[0] @ corners).tolist()
        exits = [(3 * face, a, b), (3 * face + 1, b, c), (3 * face + 2, c, a)]
    else:
        side, angle = _leave_vertex(mesh, sides, int(start), given)
        head = complex(sides.lengths[side])
        exits = [(next_side(side), head, apex_of(sides, side, 0j, head))]
    way, walked = complex(np.cos(angle), np.sin(angle)), 0.0
    while True:
        # The path leaves between the ends of a side, the first on its right and the second on its
        # left. Of two sides at a vertex that the path meets, rounding chooses.
        exit_side, right, left = max(
            exits, key=lambda each: min(-cross(way, each[1]), cross(way, each[2]))
        )
        below, above = cross(way, right), cross(way, left)
        share = min(max(-below / (above - below), 0.0), 1.0) if above > below else 0.0
        meeting = ((right + share * (left - right)) * way.conjugate()).real
        crossing = point_on_side(mesh, sides, exit_side, share)
        if meeting >= length:
            part = (length - walked) / (meeting - walked) if meeting > walked else 0.0
            path.append(path[-1] + part * (crossing - path[-1]))
            break
        path.append(crossing)
        walked = max(walked, meeting)
        twin = int(sides.twins[exit_side])
        if twin < 0:
            break
        # Across, the side runs from `left` to `right`, and the next face lies on its left.
        apex = apex_of(sides, twin, left, right)
        exits = [(next_side(twin), right, apex), (previous_side(twin), apex, left)]
    return as_path(np.array(path))


def _leave_vertex(
    mesh: TriangleMesh, sides: Sides, vertex: int, vector: Float[np.ndarray, "2"]
) -> tuple[int, float]:
    """Return the side of a vertex on whose left a vector leaves it, and the angle between both."""
    directions = vertex_directions(mesh)
    angle = float(np.arctan2(vector[1], vector[0])) % (2 * np.pi)
    # The side after which the direction leaves the vertex, and its angle to that side.
    out = np.flatnonzero(sides.tails == vertex)
    before = [previous_side(int(each)) for each in out]
    is_inner = (sides.twins[out] >= 0).all() and (sides.twins[before] >= 0).all()
    scale = 2 * np.pi / sides.around[vertex] if is_inner else 1.0
    offsets = (angle - directions.at_tail[out]) / scale
    wedges = sides.angles[out]
    inside = (offsets >= 0) & (offsets <= wedges)
    chosen = int(np.argmax(inside))
    if not inside.any():
        # Rounding may leave a gap between two faces, at the last side or the first.
        gaps = np.minimum(np.abs(offsets), np.abs(offsets - wedges))
        chosen = int(np.argmin(gaps))
        if gaps[chosen] > STRAIGHT:
            raise InvalidParameterError(
                f"vector must point into the surface; at boundary vertex {vertex} it has the angle "
                f"{angle:.4g}, and the faces end at {sides.around[vertex]:.4g}."
            )
    return int(out[chosen]), float(np.clip(offsets[chosen], 0, wedges[chosen]))
