"""Lengths, areas and normals, right at any scale of the coordinates."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# A triangle thinner than this, height over longest side, has no normal that rounding leaves standing.
THINNEST = 1e-14
# Powers of two up to which areas and volumes are handed out: beyond, sums overflow or small faces lose digits.
LARGEST_EXPONENT = 1000


def unit_scaled(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Return the vertices about their mean, divided by a power of two that brings them to size 1, and that power.

    Squares and cubes of these neither overflow nor underflow, whatever the unit of the mesh, and dividing by a
    power of two costs no digit.
    """
    points, scale = _size_one(mesh.vertices)
    points, inner_scale = _size_one(points - points.mean(axis=0))
    return points, scale * inner_scale


def scaled_corners(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "f 3 3"], float]:
    """Return the corners of each face, divided by a power of two that brings them to size 1, and that power.

    Nothing is moved: what is measured between corners depends on them alone, to the last digit, and not on the order
    of the vertices, nor on those that no face uses.
    """
    return _size_one(mesh.vertices[mesh.faces])


def _size_one(coordinates: Float[np.ndarray, "..."]) -> tuple[Float[np.ndarray, "..."], float]:
    largest = np.abs(coordinates).max()
    # One below the exponent of frexp, so that the largest of all numbers has a power too.
    scale = float(2.0 ** (np.frexp(largest)[1] - 1)) if largest > 0 else 1.0
    return coordinates / scale, scale


def in_length(values: Float[np.ndarray, "..."], scale: float, power: int) -> Float[np.ndarray, "..."]:
    """Return values times scale to the power of 1, 2 or 3; `scale` is a power of two.

    Raises
    ------
    InvalidShapeError
        If floats cannot hold lengths to that power.
    """
    exponent = power * (int(np.frexp(scale)[1]) - 1)
    if abs(exponent) > LARGEST_EXPONENT:
        raise InvalidShapeError(
            f"To measure {('lengths', 'areas', 'volumes')[power - 1]} the largest coordinate must lie within "
            f"1e-{301 // power}..1e{301 // power}; it is about {scale:.0e}. Choose another unit, or normalize_box."
        )
    return np.ldexp(values, exponent)


def area_vectors(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, "f 3"]:
    """Return for each triple of corners their normal times their area."""
    a, b, c = corners.transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def face_areas(mesh: TriangleMesh) -> Float[np.ndarray, " f"]:
    """Return the area of each face, in length^2."""
    corners, scale = scaled_corners(mesh)
    return in_length(np.linalg.norm(area_vectors(corners), axis=1), scale, 2)


def surface_area(mesh: TriangleMesh) -> float:
    """Return the total area, in length^2."""
    return float(face_areas(mesh).sum())


def enclosed_volume(mesh: TriangleMesh) -> float:
    """Return the signed volume under the surface, in length^3: positive for a closed mesh that faces outward."""
    corners, scale = scaled_corners(mesh)
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return float(in_length(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, scale, 3).sum())


def face_normals(mesh: TriangleMesh) -> Float[np.ndarray, "f 3"]:
    """Return the unit normal of each face; zero where the face has no area."""
    return _unit(area_vectors(scaled_corners(mesh)[0]))


def vertex_normals(mesh: TriangleMesh) -> Float[np.ndarray, "n 3"]:
    """Return at each vertex the unit mean of its faces' normals, weighted by area; zero where there is none."""
    vectors = area_vectors(scaled_corners(mesh)[0])
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
    ends, scale = _size_one(mesh.vertices[edge_table(mesh).edges])
    return in_length(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), scale, 1)


def bounding_box(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the lowest and the highest corner of the box around all vertices."""
    return mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)


def degenerate_faces(mesh: TriangleMesh) -> Int[np.ndarray, " k"]:
    """Return the faces without area: height at most 1e-14 of the longest side."""
    corners, _ = scaled_corners(mesh)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    doubled = 2 * np.linalg.norm(area_vectors(corners), axis=1)
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
