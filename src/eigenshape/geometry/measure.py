"""Lengths, areas and normals, right at any scale of the coordinates."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# A triangle thinner than this, height over longest side, has no normal that rounding leaves standing.
THINNEST = 1e-14


def unit_scaled(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Return the vertices about their mean, divided by a power of two that brings them to size 1, and that power.

    Squares and cubes of these neither overflow nor underflow, whatever the unit of the mesh, and dividing by a
    power of two costs no digit.
    """
    largest = float(np.abs(mesh.vertices).max())
    scale = _power_of_two(largest)
    points = mesh.vertices / scale
    points = points - points.mean(axis=0)
    inner = float(np.abs(points).max())
    inner_scale = _power_of_two(inner)
    return points / inner_scale, scale * inner_scale


def _power_of_two(size: float) -> float:
    # One below the exponent of frexp, so that the largest of all numbers has a power too.
    return float(2.0 ** (np.frexp(size)[1] - 1)) if size > 0 else 1.0


def face_area_vectors(points: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3"]:
    """Return for each face its normal times its area, in the unit of `points` squared."""
    a, b, c = points[faces].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def face_areas(mesh: TriangleMesh) -> Float[np.ndarray, " f"]:
    """Return the area of each face, in length^2."""
    points, scale = unit_scaled(mesh)
    return np.linalg.norm(face_area_vectors(points, mesh.faces), axis=1) * scale**2


def surface_area(mesh: TriangleMesh) -> float:
    """Return the total area, in length^2."""
    return float(face_areas(mesh).sum())


def enclosed_volume(mesh: TriangleMesh) -> float:
    """Return the signed volume under the surface, in length^3: positive for a closed mesh that faces outward."""
    points, scale = unit_scaled(mesh)
    a, b, c = points[mesh.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6) * scale**3


def face_normals(mesh: TriangleMesh) -> Float[np.ndarray, "f 3"]:
    """Return the unit normal of each face; zero where the face has no area."""
    return _unit(face_area_vectors(unit_scaled(mesh)[0], mesh.faces))


def vertex_normals(mesh: TriangleMesh) -> Float[np.ndarray, "n 3"]:
    """Return at each vertex the unit mean of its faces' normals, weighted by area; zero where there is none."""
    vectors = face_area_vectors(unit_scaled(mesh)[0], mesh.faces)
    sums = [
        np.bincount(mesh.faces.ravel(), weights=np.repeat(vectors[:, axis], 3), minlength=mesh.n_vertices)
        for axis in range(3)
    ]
    return _unit(np.column_stack(sums))


def _unit(vectors: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)


def edge_lengths(mesh: TriangleMesh) -> Float[np.ndarray, " e"]:
    """Return the length of each edge of `edge_table`."""
    points, scale = unit_scaled(mesh)
    one, two = edge_table(mesh).edges.T
    return np.linalg.norm(points[one] - points[two], axis=1) * scale


def bounding_box(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the lowest and the highest corner of the box around all vertices."""
    return mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)


def degenerate_faces(mesh: TriangleMesh) -> Int[np.ndarray, " k"]:
    """Return the faces without area: height at most 1e-14 of the longest side."""
    points, _ = unit_scaled(mesh)
    corners = points[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    doubled = 2 * np.linalg.norm(face_area_vectors(points, mesh.faces), axis=1)
    return np.flatnonzero(doubled <= THINNEST * longest**2)


def require_areas(mesh: TriangleMesh) -> None:
    """Refuse a mesh with a face that has no area, naming the first.

    Raises
    ------
    InvalidShapeError
        With the index, corners and number of such faces.
    """
    flat = degenerate_faces(mesh)
    if flat.size == mesh.n_faces:
        raise InvalidShapeError(
            f"Faces must have area; all {mesh.n_faces} have none: their points are equal or on a line."
        )
    if flat.size:
        raise InvalidShapeError(
            f"Faces must have area; face {flat[0]} is {mesh.faces[flat[0]].tolist()} with corners "
            f"{mesh.vertices[mesh.faces[flat[0]]].tolist()} ({flat.size} such). "
            "Repair with drop_degenerate."
        )
