"""Points on a mesh: whether they lie on it, and how they become vertices of it."""

from collections.abc import Mapping

import numpy as np

from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints
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
            vertices.append(whole_number(stop, name, 0, mesh.n_vertices - 1))
            continue
        require_one(stop, name)
        require_on(mesh, stop, name)
        # The point before may have split the face: look in each piece.
        pieces = np.flatnonzero(origin == stop.simplices[0])
        spots = points[faces[pieces]]
        sides = spots[:, 1:] - spots[:, :1]
        rest = np.linalg.pinv(sides.swapaxes(1, 2)) @ (stop.points - spots[:, 0])[:, :, None]
        weights = np.concatenate([1 - rest.sum(axis=1), rest[:, :, 0]], axis=1)
        piece = int(np.argmax(weights.min(axis=1)))
        corners = faces[pieces[piece]][weights[piece] > ON_SIDE]
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


def require_one(place: SurfacePoints, name: str) -> None:
    """Raise an error if an argument has more points than one."""
    if place.n_points != 1:
        raise InvalidParameterError(f"{name} must be one point; there are {place.n_points}.")


def require_on(mesh: Mesh, places: SurfacePoints, name: str) -> None:
    """Raise an error if points do not lie on a mesh; `name` is that of the argument."""
    known = (places.simplices >= 0) & (places.simplices < len(mesh.simplices))
    corners = mesh.points[mesh.simplices[np.where(known, places.simplices, 0)]]
    if (places.weights.shape[1], places.points.shape[1]) == corners.shape[1:]:
        away = np.abs(np.einsum("pc,pcd->pd", places.weights, corners) - places.points).max(axis=1)
        known &= away <= ELSEWHERE * np.ptp(mesh.points, axis=0).max()
    else:
        known[:] = False
    if not known.all():
        place = int(np.argmin(known))
        raise InvalidParameterError(
            f"{name} must lie on this mesh; point {place} at {places.points[place].tolist()} in face "
            f"{places.simplices[place]} does not. Try closest_points(mesh, {name}.points)."
        )
