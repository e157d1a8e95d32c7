"""Points on a mesh: whether they lie on it, and how they become vertices of it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.geometry.simplicial import Mesh

# A point with a smaller weight at a corner is moved to the opposite side: slivers have no angles.
ON_SIDE = 1e-6
# A point farther from where its weights put it, in extents of the mesh, belongs to another mesh.
ELSEWHERE = 1e-6


def insert_stops(
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
