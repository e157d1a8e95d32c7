"""From where a shape is looked at, and where its points then lie in the picture."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.measure import area_vectors, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh

Up = Literal["auto", "x", "y", "z"]
ONE_WAY = 0.3  # length of the mean normal, which a closed surface has 0 of, from which on a surface is a scan
MARGIN = 0.04  # of the picture, left free on each side
SOLE = 0.03  # of the longest side of the box: what is at most so far above the lowest point carries the shape


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection: rows are right, down and towards the viewer.

    Attributes
    ----------
    rotation : (3, 3) float
    size : int
        Pixels of the square picture.
    """

    rotation: Float[np.ndarray, "3 3"]
    size: int


def three_quarter_view(mesh: TriangleMesh, *, up: Up = "y", size: int = 600) -> Camera:
    """Look at a shape from its front, its left and a little from above; at a scan from where it was seen.

    The front is +z where y is up, as in most collections and in glTF; +x where z is up; +y where x is up. A surface
    that is open and mostly faces one way is a scan, and is looked at from there.

    "auto" takes z for up where the shape stands on its lowest points along z and would fall over along y, and y
    otherwise. It is a guess: it rights many shapes of collections where z is up, and upsets a few where y is.
    """
    axis = "xyz".index(_standing_axis(mesh) if up == "auto" else up)
    upward, front = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    towards = 0.78 * front + 0.48 * np.cross(upward, front) + 0.4 * upward
    facing = _facing(mesh)
    if facing is not None and np.linalg.norm(np.cross(upward, facing)) > 0.1:
        towards = facing
    towards = towards / np.linalg.norm(towards)
    right = np.cross(upward, towards)
    right = right / np.linalg.norm(right)
    return Camera(np.stack([right, -np.cross(towards, right), towards]), size)


def _standing_axis(mesh: TriangleMesh) -> Literal["y", "z"]:
    points = unit_scaled(mesh)[0]
    areas = np.linalg.norm(area_vectors(points[mesh.faces]), axis=1)
    weights = areas / max(areas.sum(), np.finfo(np.float64).tiny)
    centre = weights @ points[mesh.faces].mean(axis=1)
    return "z" if _stands(points - centre, 2) and not _stands(points - centre, 1) else "y"


def _stands(points: Float[np.ndarray, "n 3"], axis: int) -> bool:
    """Say whether the origin, the centre of the surface, lies over the convex hull of the lowest points."""
    height = points[:, axis] - points[:, axis].min()
    one, two = np.delete(points, axis, axis=1)[height <= SOLE * np.ptp(points, axis=0).max()].T
    around = np.sort(np.arctan2(two, one))
    gaps = np.diff(around, append=around[0] + 2 * np.pi)
    return bool(gaps.max() < np.pi)


def _facing(mesh: TriangleMesh) -> Float[np.ndarray, "3"] | None:
    """Return the mean normal of an open surface that mostly faces one way."""
    vectors = area_vectors(unit_scaled(mesh)[0][mesh.faces])
    mean = vectors.sum(axis=0) / max(np.linalg.norm(vectors, axis=1).sum(), np.finfo(np.float64).tiny)
    return mean if np.linalg.norm(mean) > ONE_WAY else None


def in_picture(mesh: TriangleMesh, camera: Camera) -> Float[np.ndarray, "n 3"]:
    """Return the vertices in pixels: right, down, and towards the viewer; the shape fills the picture."""
    points = unit_scaled(mesh)[0] @ camera.rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    span = max(float((high - low)[:2].max()), np.finfo(np.float64).tiny)
    scale = camera.size * (1 - 2 * MARGIN) / span
    return (points - (low + high) / 2) * scale + [camera.size / 2, camera.size / 2, 0.0]
