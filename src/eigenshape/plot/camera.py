"""The direction of the view, and where the points of a shape lie in the picture."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from eigenshape._text import html_repr
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table, face_pairs

Up = Literal["auto", "x", "y", "z"]
# Length of the mean normal above which a surface counts as a scan. A closed surface has 0, a flat piece 1.
ONE_WAY = 0.3
MARGIN = 0.04  # share of the picture that is left free on each side
# Points at most this share of the longest side of the box above the lowest point carry the shape.
SOLE = 0.02
# z is up only if the base along z is this many times larger: a smaller factor turns over many
# shapes for which y is up.
WIDER = 4.0
# A shape is shown from behind if its front has less than this share of the curvature seen there.
LESS = 0.8


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection onto a square picture.

    Attributes
    ----------
    rotation : (3, 3) float
        Orthonormal rows, which point right, down and towards the viewer.
    size : int
        Width and height of the picture in pixels.

    See Also
    --------
    three_quarter_view : Guess a camera from a shape.

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> from_z = es.plot.Camera(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]]), size=300)
    >>> mesh = es.icosphere(1)
    >>> figure = es.figure_field(mesh, mesh.vertices[:, 2], camera=from_z)
    """

    rotation: Float[np.ndarray, "3 3"]
    size: int

    _repr_html_ = html_repr


@one_blas_thread()
def three_quarter_view(mesh: MeshLike, *, up: Up = "auto", size: int = 600) -> Camera:
    """Return a camera that shows a shape upright, from its front left and a little from above.

    The front is +z if y is up, as in most collections and in glTF; +x if z is up; +y if x is up. If the opposite side
    is clearly more curved, that side is the front, because a face is more curved than the back of a head. An open
    surface that mostly faces one way is taken for a scan, and is shown from there.

    Parameters
    ----------
    mesh : MeshLike
    up : {"auto", "x", "y", "z"}
        The upward axis. "auto" takes y, or z if the shape would fall over along y and would stand along z on a base
        more than four times as large. It is a guess: of 243 real shapes whose upright pose is known, it shows 183
        upright, and y alone shows 143.
    size : int
        Width and height of the picture in pixels.

    Returns
    -------
    Camera

    Examples
    --------
    >>> import eigenshape as es
    >>> camera = es.plot.three_quarter_view(es.icosphere(1), up="z", size=300)
    >>> camera.size, bool(camera.rotation[1, 2] < 0)  # the second row points down
    (300, True)
    """
    mesh = as_mesh(mesh)
    axis = "xyz".index(_upright_axis(mesh) if up == "auto" else up)
    upward, front = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    side = np.cross(upward, front)
    towards = 0.78 * front + 0.48 * side + 0.4 * upward
    behind = -0.78 * front - 0.48 * side + 0.4 * upward
    facing = _facing(mesh)
    if facing is not None and np.linalg.norm(np.cross(upward, facing)) > 0.1:
        towards = facing
    else:
        before, after = _sum_visible_bending(mesh, np.stack([towards, behind]))
        if before < LESS * after:
            towards = behind
    towards = towards / np.linalg.norm(towards)
    right = np.cross(upward, towards)
    right = right / np.linalg.norm(right)
    return Camera(np.stack([right, -np.cross(towards, right), towards]), size)


def _upright_axis(mesh: TriangleMesh) -> Literal["y", "z"]:
    points = scale_to_unit(mesh)[0]
    areas = np.linalg.norm(area_vectors(points[mesh.faces]), axis=1)
    weights = areas / max(areas.sum(), np.finfo(np.float64).tiny)
    center = weights @ points[mesh.faces].mean(axis=1)
    along_y, along_z = (_base(points - center, axis) for axis in (1, 2))
    falls_along_y = not _surrounds_origin(along_y)
    wider_along_z = _hull_area(along_z) > WIDER * _hull_area(along_y)
    return "z" if falls_along_y and _surrounds_origin(along_z) and wider_along_z else "y"


def _base(points: Float[np.ndarray, "n 3"], axis: int) -> Float[np.ndarray, "k 2"]:
    """Return where the lowest points would touch the ground."""
    height = points[:, axis] - points[:, axis].min()
    return np.delete(points, axis, axis=1)[height <= SOLE * np.ptp(points, axis=0).max()]


def _surrounds_origin(points: Float[np.ndarray, "k 2"]) -> bool:
    """Say whether the origin lies inside the convex hull: what stands on these points does not fall over."""
    around = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    gaps = np.diff(around, append=around[0] + 2 * np.pi)
    return bool(gaps.max() < np.pi)


def _hull_area(points: Float[np.ndarray, "k 2"]) -> float:
    try:
        return float(ConvexHull(points).volume)
    except QhullError:  # fewer than three points, or all on a line
        return 0.0


def _sum_visible_bending(
    mesh: TriangleMesh, directions: Float[np.ndarray, "d 3"]
) -> Float[np.ndarray, " d"]:
    """Sum the bending that a viewer sees, for each direction towards a viewer.

    The bending of an edge is its angle times its length, weighted by how far it faces the viewer.
    """
    points = scale_to_unit(mesh)[0]
    vectors = area_vectors(points[mesh.faces])
    normals = (
        vectors / np.maximum(np.linalg.norm(vectors, axis=1), np.finfo(np.float64).tiny)[:, None]
    )
    if np.einsum("ij,ij->", vectors, points[mesh.faces].mean(axis=1)) < 0:
        normals = -normals  # the faces look inward
    table = edge_table(mesh)
    pairs, edges = face_pairs(table)
    one, two = normals[pairs].transpose(1, 0, 2)
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", one, two), -1, 1))
    begin, end = points[table.edges[edges]].transpose(1, 0, 2)
    lengths = np.linalg.norm(end - begin, axis=1)
    return (angles * lengths) @ np.maximum((one + two) @ directions.T, 0)


def _facing(mesh: TriangleMesh) -> Float[np.ndarray, "3"] | None:
    """Return the mean normal of an open surface that mostly faces one way."""
    vectors = area_vectors(scale_to_unit(mesh)[0][mesh.faces])
    mean = vectors.sum(axis=0) / max(
        np.linalg.norm(vectors, axis=1).sum(), np.finfo(np.float64).tiny
    )
    return mean if np.linalg.norm(mean) > ONE_WAY else None


def in_picture(mesh: TriangleMesh, camera: Camera) -> Float[np.ndarray, "n 3"]:
    """Return the vertices in pixels: right, down, and towards the viewer; the shape fills the picture."""
    points = scale_to_unit(mesh)[0] @ camera.rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    span = max(float((high - low)[:2].max()), np.finfo(np.float64).tiny)
    scale = camera.size * (1 - 2 * MARGIN) / span
    return (points - (low + high) / 2) * scale + [camera.size / 2, camera.size / 2, 0.0]
