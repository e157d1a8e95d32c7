"""The connection Laplacian, on tangent vectors."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Complex, Float

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import size_one
from eigenshape.operators.cotangent import Mass, cotangent_laplacian
from eigenshape.operators.directions import corner_products, vertex_directions
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.tufted import edge_keys

MASS_SHARES = {
    "lumped": 0.0,
    "consistent": 1 / 12,
    "averaged": 1 / 24,
}  # of a face's area, for two of its corners
COCIRCULAR = 1e-14  # a sum of cotangents that rounding may leave below zero


def connection_laplacian(mesh: MeshLike, mass: Mass = "lumped") -> Laplacian:
    """Build the Laplacian of tangent vectors, with the Levi-Civita connection of the mesh.

    W has the energy sum_ij w_ij |v_j - r_ij v_i|²: cotangent weights w_ij, and r_ij the rotation that carries a vector
    along the edge from vertex i to vertex j (Knöppel, Crane, Pinkall, Schröder 2013; Sharp, Soliman, Crane 2019). The
    angles around an inner vertex are scaled to 2π, those at a boundary vertex left as they are; the boundary is free.

    W is positive semidefinite on any mesh. Where w_ij ≥ 0, as on a Delaunay mesh, each term says so, and W is the
    published one. Elsewhere the published sum may give a field an energy below zero. A weight below zero is outweighed
    within its face once the face is flat: in such faces, few on a good mesh, the three r_ij are turned by a third of
    the face's curvature each, so that the way around it leads back to the same vector. What is turned is of the order
    of curvature times squared edge length, as is the error of the whole.

    Unlike in a scalar Laplacian the rows of W do not sum to 0: only parallel fields have no energy, and a curved
    surface has none.

    Parameters
    ----------
    mesh : MeshLike
        A manifold, with or without boundary, its faces turned one way.
    mass : "lumped", "consistent" or "averaged"
        As in `cotangent_laplacian`; the consistent one carries vectors as W does, in faces made flat.

    Returns
    -------
    Laplacian
        On 2n numbers; 2i and 2i + 1 are the coordinates of the vector at vertex i in row i of `tangent_frames`.
        W without unit, B in length².

    Raises
    ------
    InvalidShapeError
        If an edge has more than two faces, a vertex more than one fan or none, two neighbouring faces are turned
        against each other, or a face has no area; or if coordinates are beyond 1e±150.
    InvalidParameterError
        If `mass` is none of the three.
    """
    mesh = as_mesh(mesh)
    scalar = cotangent_laplacian(mesh, mass)
    sides = vertex_directions(mesh)
    turns = np.exp(1j * (sides.at_head + np.pi - sides.at_tail))
    flat_turns = flattened(turns)
    weights = _weights(mesh)
    flat = np.repeat(_faces_to_flatten(mesh, weights), 3)
    stiffness = _carried(
        mesh, scalar.stiffness.diagonal(), -weights * np.where(flat, flat_turns, turns)
    )
    shares = np.repeat(MASS_SHARES[mass] * face_areas(mesh), 3)
    return Laplacian(
        _real(stiffness), _real(_carried(mesh, scalar.mass.diagonal(), shares * flat_turns))
    )


def tangent_frames(mesh: MeshLike) -> Float[np.ndarray, "n 2 3"]:
    """Return two orthonormal tangent vectors at each vertex.

    The first is the direction of the vertex' first edge, made orthogonal to the mean normal of its faces (weighted by
    area); the second is a quarter turn on, counter-clockwise seen from outside. The first edge is at an inner vertex
    that of the first face that has the vertex, at a boundary vertex the boundary edge with a face on its left.

    Raises
    ------
    InvalidShapeError
        As in `connection_laplacian`; or if at a vertex the normals of the faces cancel, or the first edge is normal.
    """
    mesh = as_mesh(mesh)
    sides = vertex_directions(mesh)
    points, _ = size_one(mesh.vertices)
    normals = vertex_normals(mesh)
    along = points[np.roll(mesh.faces, -1, axis=1).ravel()[sides.first]] - points
    lengths = np.linalg.norm(along, axis=1)
    along = along - np.einsum("ij,ij->i", along, normals)[:, None] * normals
    left = np.linalg.norm(along, axis=1)
    bad = np.flatnonzero((left <= 1e-12 * lengths) | (np.linalg.norm(normals, axis=1) == 0))
    if bad.size:
        raise InvalidShapeError(
            f"A vertex must have a tangent plane; at vertex {bad[0]} at {mesh.vertices[bad[0]].tolist()} the normals "
            f"of its faces cancel, or lie along its first edge ({bad.size} such)."
        )
    first = along / left[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)


def _weights(mesh: TriangleMesh) -> Float[np.ndarray, " h"]:
    """Return half of the cotangent opposite to each side."""
    cosines, sines = corner_products(mesh)
    return np.roll((cosines / sines).reshape(-1, 3), 1, axis=1).ravel() / 2


def flattened(turns: Complex[np.ndarray, " h"]) -> Complex[np.ndarray, " h"]:
    """Turn the three of each face by a third of its curvature each, so that they lead back to the same vector."""
    around = turns.reshape(-1, 3).prod(axis=1)
    return turns * np.repeat(np.exp(-1j * np.angle(around) / 3), 3)


def _faces_to_flatten(
    mesh: TriangleMesh, weights: Float[np.ndarray, " h"]
) -> Bool[np.ndarray, " f"]:
    """Choose faces so that the weights of all others sum to 0 or more at every edge.

    What is left is a sum of squares edge by edge, and a flat face is one by itself.
    """
    _, edges = np.unique(edge_keys(mesh.faces, mesh.n_vertices), return_inverse=True)
    flat = np.zeros(mesh.n_faces, dtype=bool)
    while True:
        kept = np.where(np.repeat(flat, 3), 0.0, weights)
        short = np.bincount(edges, weights=kept)[edges] < -COCIRCULAR
        more = (short & (kept < 0)).reshape(-1, 3).any(axis=1)
        if not more.any():
            return flat
        flat |= more


def _carried(
    mesh: TriangleMesh, diagonal: Float[np.ndarray, " n"], entries: Complex[np.ndarray, " h"]
) -> sp.csr_array:
    """Put the entry of each side where it acts on its tail and counts at its head, and the conjugate the other way."""
    tails, heads = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    half = sp.coo_array((entries, (heads, tails)), shape=(mesh.n_vertices,) * 2).tocsr()
    return (sp.diags_array(diagonal.astype(complex)) + half + half.conj().T).tocsr()


def _real(matrix: sp.csr_array) -> sp.csr_array:
    """Write a Hermitian matrix of n complex numbers as a symmetric one of 2n real numbers."""
    quarter = sp.csr_array(np.array([[0.0, -1.0], [1.0, 0.0]]))
    return (sp.kron(matrix.real, sp.eye_array(2)) + sp.kron(matrix.imag, quarter)).tocsr()
