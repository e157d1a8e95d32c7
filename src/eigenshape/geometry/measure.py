"""Lengths, areas and normals, right at any scale of the coordinates."""

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.simplices import in_length, scaled_corners, size_one
from eigenshape.geometry.topology import edge_table


def unit_scaled(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Return the vertices about their mean, divided by a power of two that brings them to size 1, and that power.

    Squares and cubes of these neither overflow nor underflow, whatever the unit of the mesh, and dividing by a
    power of two costs no digit.
    """
    points, scale = size_one(mesh.vertices)
    points, inner_scale = size_one(points - points.mean(axis=0))
    return points, scale * inner_scale


def area_vectors(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, "f 3"]:
    """Return for each triple of corners their normal times their area."""
    a, b, c = corners.transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def face_areas(mesh: MeshLike) -> Float[np.ndarray, " f"]:
    """Return the area of each face, in length^2."""
    mesh = as_mesh(mesh)
    corners, scale = scaled_corners(mesh)
    return in_length(np.linalg.norm(area_vectors(corners), axis=1), scale, 2)


def surface_area(mesh: MeshLike) -> float:
    """Return the total area, in length^2."""
    mesh = as_mesh(mesh)
    return float(face_areas(mesh).sum())


def enclosed_volume(mesh: MeshLike) -> float:
    """Return the signed volume under the surface, in length^3: positive for a closed mesh that faces outward.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    corners, scale = scaled_corners(mesh)
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return float(in_length(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, scale, 3).sum())


def face_normals(mesh: MeshLike) -> Float[np.ndarray, "f 3"]:
    """Return the unit normal of each face; zero where the face has no area."""
    mesh = as_mesh(mesh)
    return _unit(area_vectors(scaled_corners(mesh)[0]))


def vertex_normals(mesh: MeshLike) -> Float[np.ndarray, "n 3"]:
    """Return at each vertex the unit mean of its faces' normals, weighted by area; zero where there is none.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    return mean_normals(mesh)


def mean_normals(mesh: TriangleMesh) -> Float[np.ndarray, "n 3"]:
    """Return `vertex_normals` of any mesh; where neighbors disagree their normals cancel, in part or all."""
    vectors = area_vectors(scaled_corners(mesh)[0])
    sums = [
        np.bincount(
            mesh.faces.ravel(), weights=np.repeat(vectors[:, axis], 3), minlength=mesh.n_vertices
        )
        for axis in range(3)
    ]
    return _unit(np.column_stack(sums))


def _unit(vectors: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)


def edge_lengths(mesh: MeshLike) -> Float[np.ndarray, " e"]:
    """Return the length of each edge of `edge_table`."""
    mesh = as_mesh(mesh)
    ends, scale = size_one(mesh.vertices[edge_table(mesh).edges])
    return in_length(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), scale, 1)


def bounding_box(shape: Shape) -> tuple[Float[np.ndarray, " d"], Float[np.ndarray, " d"]]:
    """Return the lowest and the highest corner of the box around all points."""
    return shape.points.min(axis=0), shape.points.max(axis=0)
