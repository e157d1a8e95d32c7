"""Geodesic paths: locally shortest between two vertices."""

from cmath import phase
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from certeig.kit.arrays import whole_numbers
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._vectors import scale_to_unit
from eigenshape.calculus.places import require_one, vertex_number
from eigenshape.calculus.unfolding import (
    STRAIGHT,
    GeodesicPath,
    Sides,
    apex_of,
    as_path,
    cross,
    next_side,
    point_on_side,
    previous_side,
    walkable_sides,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.measure import edge_lengths
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented_manifold, require_sound
from eigenshape.geometry.samples.surface_points import SurfacePoints, require_on
from eigenshape.geometry.topology import edge_table

# Rounds in which pivots are passed on their other side; a path of k edges takes about √k.
ROUNDS = 10_000

# A point with a smaller weight at a corner is moved to the opposite side: slivers have no angles.
ON_SIDE = 1e-6

# The left and the right end of each edge that a strip of faces crosses, in the plane.
Portals = list[tuple[complex, complex]]


def geodesic_path(
    mesh: MeshLike,
    start: Integer | SurfacePoints,
    end: Integer | SurfacePoints,
    *,
    via: ArrayLike = (),
) -> GeodesicPath:
    """Find a locally shortest path between two vertices, or points inside faces.

    The shortest path along edges is the start. The strip of faces beside it is unfolded, where the
    shortest path is a taut string; each vertex on which the string bends is passed on its other
    side if the angle there is less than π, until there is none (Xin and Wang 2007; the same moves
    as the edge flips of Sharp and Crane 2020, done on the strip). Every move shortens the path. The
    end is a geodesic: straight across edges, with at least π on both sides of a vertex. It need not
    be the shortest of all geodesics: there may be another around a handle or a hill.

    Parameters
    ----------
    mesh : MeshLike
        A manifold, with or without boundary, with consistently oriented faces.
    start, end : int or SurfacePoints
        Vertices, or one point each, such as `closest_points` finds.
    via : (k,) int
        Vertices that the path along edges passes on its way. They choose the side of a hill or
        handle; the path is then straightened as a whole, and leaves them.

    Returns
    -------
    GeodesicPath

    Raises
    ------
    InvalidShapeError
        If the mesh is no manifold, two neighboring faces are turned against each other, a face has
        no area, or a vertex has no face.
    InvalidParameterError
        If a vertex is out of range, a point does not lie on this mesh or is not one, two stops that
        follow each other are equal, or they lie on different components.
    ConvergenceError
        If moves do not end, which they do.

    See Also
    --------
    trace_geodesic : The straight path from a vertex in a direction.
    eigenshape.geometry.geodesic_distances : Lengths alone, of shortest paths to all vertices.

    Examples
    --------
    Around a corner of a cube:

    >>> import eigenshape as es
    >>> cube = es.geometry.boundary_surface(es.shapes.box(1, 1, 1))
    >>> path = es.calculus.geodesic_path(cube, 0, 7)
    >>> round(path.length, 6)  # √5
    2.236068

    Between points in the middle of two faces:

    >>> ends = es.geometry.closest_points(cube, [[0.5, 0.5, 1], [0.5, 1, 0.5]])
    >>> start, end = (es.geometry.closest_points(cube, [place]) for place in ends.points)
    >>> round(es.calculus.geodesic_path(cube, start, end).length, 6)
    1.0
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    require_oriented_manifold(mesh)
    last = mesh.n_vertices - 1
    between = whole_numbers(via, "A vertex of via", 0, last).tolist() if np.size(via) else []
    mesh, (first, final) = _insert_stops(mesh, {"start": start, "end": end})
    stops = [first, *between, final]
    # The shortest path along edges through all stops.
    graph = sp.csr_array(
        (edge_lengths(mesh), edge_table(mesh).edges.T), shape=(mesh.n_vertices,) * 2
    )
    path = stops[:1]
    for one, two in pairwise(stops):
        if one == two:
            raise InvalidParameterError(
                f"Each stop of a path must differ from the one before; vertex {one} is followed by "
                "itself."
            )
        _, before = dijkstra(graph, directed=False, indices=one, return_predecessors=True)
        if before[two] < 0:
            raise InvalidParameterError(
                "The vertices of a path must be on one component; "
                f"{one} and {two} are on different ones."
            )
        back = [two]
        while back[-1] != one:
            back.append(int(before[back[-1]]))
        path += back[-2::-1]
    unit = TriangleMesh(scale_to_unit(mesh.vertices)[0], mesh.faces)
    sides = walkable_sides(unit)
    strip = _strip_along(sides, path)
    for _ in range(ROUNDS):
        # Drop what the strip crosses before it leaves the first vertex and after it meets the last.
        starts = [place for place, side in enumerate(strip) if _touches(sides, side, first)]
        strip = strip[starts[-1] + 1 :] if starts else strip
        stops = [place for place, side in enumerate(strip) if _touches(sides, side, final)]
        strip = strip[: stops[0]] if stops else strip
        if not strip:
            return as_path(mesh.vertices[[first, final]])
        portals = _unfold(sides, strip)
        corners = _pull_taut(portals)
        moved = _pass_pivots(sides, strip, portals, corners)
        if moved is None:
            break
        strip = moved
    else:
        raise ConvergenceError(f"A path must become straight; {ROUNDS} rounds were not enough.")
    # Where the path starts, crosses edges, passes vertices, and ends.
    points = [mesh.vertices[first]]
    for (begin, first_end), (stop, last_end) in pairwise(corners):
        origin = portals[begin][first_end]
        way = portals[stop][last_end] - origin
        for number in range(begin + 1, stop):
            left, right = (cross(way, end - origin) for end in portals[number])
            share = left / (left - right) if left > right else 0.0
            share = 1 - min(max(share, 0.0), 1.0)
            points.append(point_on_side(mesh, sides, strip[number - 1], share))
        if stop < len(portals) - 1:
            points.append(point_on_side(mesh, sides, strip[stop - 1], 1.0 - last_end))
    return as_path(np.array([*points, mesh.vertices[final]]))


def _insert_stops(
    mesh: TriangleMesh, stops: Mapping[str, Integer | SurfacePoints]
) -> tuple[TriangleMesh, list[int]]:
    """Return the vertex of each stop, a vertex or one point on the mesh, which becomes a vertex.

    The faces at a point are split, and the vertices of the mesh stay the first ones. Raise
    InvalidParameterError if a stop is not on the mesh; its name is that of the argument.
    """
    points, faces, origin = mesh.vertices, mesh.faces, np.arange(mesh.n_faces)
    vertices = []
    for name, stop in stops.items():
        if not isinstance(stop, SurfacePoints):
            vertices.append(vertex_number(mesh.n_vertices, stop, name))
            continue
        require_one(stop, name)
        require_on(mesh, stop, name)
        # The point before may have split the face: look in each piece.
        pieces = faces[origin == stop.simplices[0]]
        there = closest_points(TriangleMesh(points, pieces), stop.points)
        corners = pieces[there.simplices[0], there.weights[0] > ON_SIDE]
        if len(corners) == 1:
            vertices.append(int(corners[0]))
            continue
        # Each face at that side becomes one for each corner of the side, with the point instead.
        split = np.flatnonzero(np.isin(faces, corners).sum(axis=1) == len(corners))
        whole = faces[split]
        new = [np.where(whole == corner, len(points), whole) for corner in corners]
        faces = np.concatenate([np.delete(faces, split, axis=0), *new])
        origin = np.concatenate([np.delete(origin, split), np.tile(origin[split], len(corners))])
        vertices.append(len(points))
        points = np.append(points, stop.points, axis=0)
    return TriangleMesh(points, faces), vertices


def _strip_along(sides: Sides, path: list[int]) -> list[int]:
    """Return the sides that a strip of faces beside a path of edges crosses.

    At each vertex the strip takes the side of the path with the smaller angle.
    """
    strip: list[int] = []
    is_left: bool | None = None
    for before, vertex, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        # Walk around the vertex on either side, and list what is crossed up to the next edge.
        fans: list[tuple[float, bool, list[int]]] = []
        for left in (True, False):
            step = next_side if left else previous_side
            side = sides.of_edge.get((before, vertex) if left else (vertex, before), -1)
            crossed: list[int] = []
            angle = 0.0
            while side >= 0 and len(crossed) <= len(sides.tails):
                out = step(side)
                angle += float(sides.angles[out if left else side])
                if (sides.heads[out] if left else sides.tails[out]) == after:
                    fans.append((angle, left, crossed))
                    break
                crossed.append(out)
                side = int(sides.twins[out])
        _, now_left, fan = min(fans, key=lambda found: found[0])
        if is_left is not None and is_left != now_left:
            # From the left of the edge to its right, or back.
            ends = (before, vertex) if is_left else (vertex, before)
            strip.append(sides.of_edge[ends])
        strip += fan
        is_left = now_left
    return strip


def _unfold(sides: Sides, strip: list[int]) -> Portals:
    """Lay the faces of a strip in the plane; return the left and the right end of each crossing.

    The first and the last are the two ends of the path, as portals without width.
    """
    side = strip[0]
    # The side lies from 0 along the axis; its face is on its left.
    tail, head = 0j, complex(sides.lengths[side])
    start = apex_of(sides, side, tail, head)
    portals = [(start, start), (head, tail)]
    for following in strip[1:]:
        twin = int(sides.twins[side])
        apex = apex_of(sides, twin, head, tail)
        # Seen from the next face the side runs from `head` to `tail`.
        tail, head = (tail, apex) if following == next_side(twin) else (apex, head)
        portals.append((head, tail))
        side = following
    end = apex_of(sides, int(sides.twins[side]), head, tail)
    return [*portals, (end, end)]


def _pull_taut(portals: Portals) -> list[tuple[int, int]]:
    """Return the portals at whose left (0) or right (1) end the shortest path bends.

    The two ends of the path are among them. This is the funnel algorithm (Lee and Preparata 1984):
    the funnel between the last bend and the two ends of a portal narrows, until one of its sides
    passes the other.
    """
    corners = [(0, 0)]
    apex = portals[0][0]
    tips, at = [apex, apex], [0, 0]  # the left and the right side of the funnel
    number = 1
    while number < len(portals):
        for end, sign in ((1, 1.0), (0, -1.0)):
            tip, other, new = tips[end] - apex, tips[1 - end] - apex, portals[number][end] - apex
            if sign * cross(tip, new) < 0:
                continue  # would widen the funnel
            # Equal ends are those of the last portal, which has no width.
            if tip == 0 or new == other or sign * cross(other, new) < 0:
                tips[end], at[end] = portals[number][end], number
                continue
            # Past the other side: the path bends there, and the funnel begins anew.
            if other == 0 and len(corners) > 1:
                corners.pop()  # several portals have that vertex; the last one counts
            corners.append((at[1 - end], 1 - end))
            apex, number = tips[1 - end], at[1 - end]
            tips, at = [apex, apex], [number, number]
            break
        number += 1
    corners.append((len(portals) - 1, 0))
    return corners


def _pass_pivots(
    sides: Sides, strip: list[int], portals: Portals, corners: list[tuple[int, int]]
) -> list[int] | None:
    """Lead the strip around the other side of vertices where that is shorter; None if nowhere."""
    places = [portals[number][end] for number, end in corners]
    moved: list[int] = []
    done = 0  # sides of the strip that are copied or replaced
    any_moved = False
    for place in range(1, len(corners) - 1):
        number, is_right = corners[place]
        vertex = int((sides.tails if is_right else sides.heads)[strip[number - 1]])
        into, out = places[place] - places[place - 1], places[place + 1] - places[place]
        bend = abs(phase(into.conjugate() * out))
        if sides.around[vertex] - (np.pi + bend) >= np.pi - STRAIGHT:
            continue
        # The range of sides around this one that all have the vertex.
        begin, stop = number - 1, number
        while begin > 0 and _touches(sides, strip[begin - 1], vertex):
            begin -= 1
        while stop < len(strip) and _touches(sides, strip[stop], vertex):
            stop += 1
        if begin < done:
            continue
        # Walk around the vertex the other way, from the face of the first to beyond the last.
        # Across, a side ends (or starts) at the vertex, and the one after starts (or ends) there.
        side, target = strip[begin], int(sides.twins[strip[stop - 1]]) // 3
        step = previous_side if sides.tails[side] == vertex else next_side
        crossed: list[int] = []
        while side >= 0 and side // 3 != target and len(crossed) < len(sides.tails):
            crossed.append(step(side))
            side = int(sides.twins[crossed[-1]])
        if side < 0 or side // 3 != target:
            continue
        moved += strip[done:begin] + crossed
        done, any_moved = stop, True
    return moved + strip[done:] if any_moved else None


def _touches(sides: Sides, side: int, vertex: int) -> bool:
    return vertex in (sides.tails[side], sides.heads[side])
