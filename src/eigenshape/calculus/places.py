"""Checks of places on a mesh: a vertex, or one point of it."""

from typing import Any

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.samples.surface_points import SurfacePoints


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
