"""The connection Laplacian, on tangent vectors."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Complex, Float

from eigenshape._corners import edge_keys, side_ends
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import row_dots, size_one, unit_vectors
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.choices import Mass
from eigenshape.operators.clouds.cloud_triangles import cloud_normals
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.directions import half_cotangents, vertex_directions
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.robust import robust_laplacian

# Entry of the mass matrix for two corners of a face, as a share of the area of the face.
MASS_SHARES = {"lumped": 0.0, "consistent": 1 / 12, "averaged": 1 / 24}
# Sums of cotangents down to minus this count as zero: those of cocircular points come out there.
COCIRCULAR = 1e-14


def connection_laplacian(mesh: MeshLike | PointCloud, mass: Mass = "lumped") -> Laplacian:
    """Build the Laplacian of tangent vector fields, with the Levi-Civita connection of the surface.

    The energy of W is Σ_ij w_ij |v_j - r_ij v_i|², with cotangent weights w_ij and r_ij the
    rotation that transports a vector along the edge from vertex i to vertex j (Knöppel, Crane,
    Pinkall, Schröder 2013; Sharp, Soliman, Crane 2019). The angles around an inner vertex are
    scaled to 2π; those at a boundary vertex are not scaled, and the boundary is free.

    W is positive semidefinite on any mesh. If all w_ij ≥ 0, as on a Delaunay mesh, each term is,
    and W is the published operator. Otherwise the published sum may be negative for some fields.
    The energy of a face with negative weights is a sum of squares if the face is flat. So in such
    faces, few on a good mesh, each r_ij is rotated by a third of the curvature of the face, such
    that the transport around the face is the identity. The rotation is of the order of curvature
    times squared edge length, as is the discretization error.

    On a point cloud the weights are those of `robust_laplacian`, which are at least 0, and r_ij is the
    least turn in space that takes one tangent plane to the other (Sharp, Soliman, Crane 2019, section
    7.2). It reflects where the normals of two points look to different sides, so these sides do not
    matter.

    Unlike in a scalar Laplacian the rows of W do not sum to 0: only parallel fields have no energy,
    and on a curved surface there are none.

    Parameters
    ----------
    mesh : MeshLike or PointCloud
        A manifold, with or without boundary, with consistently oriented faces; or points of a surface
        in R³.
    mass : {"lumped", "consistent", "averaged"}
        As in `cotangent_laplacian`. The consistent mass transports vectors as W does, in faces made
        flat. That of a point cloud is lumped.

    Returns
    -------
    Laplacian
        On 2n numbers: 2i and 2i + 1 are the coordinates of the vector at vertex i in row i of
        `tangent_frames`. W without unit, B in length².

    Raises
    ------
    InvalidShapeError
        If an edge has more than two faces, a vertex has no face or more than one fan of faces, two
        neighboring faces have opposite orientations, a face has no area, or coordinates are beyond
        1e±150; of a point cloud as in `robust_laplacian`.
    InvalidParameterError
        If `mass` is not one of the three.

    See Also
    --------
    es.operators.tangent_frames : The frames in which vectors are given.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> laplacian = es.operators.connection_laplacian(ball)
    >>> laplacian.n_points == 2 * ball.n_vertices
    True
    >>> bool(es.solve_spectrum(laplacian, 1).eigenvalues[0] > 0.9)  # no parallel field
    True
    """
    if isinstance(mesh, PointCloud):
        return _cloud_connection(mesh)
    mesh = as_mesh(mesh)
    scalar = cotangent_laplacian(mesh, mass)
    sides = vertex_directions(mesh)
    turns = np.exp(1j * (sides.at_head + np.pi - sides.at_tail))
    flat_turns = flatten_turns(turns)
    weights = half_cotangents(mesh)
    # Faces are made flat until the weights of all others sum to 0 or more at every edge. What is
    # left is a sum of squares edge by edge, and a flat face is one by itself.
    _, edges = np.unique(edge_keys(mesh.faces, mesh.n_vertices), return_inverse=True)
    flat = np.zeros(len(weights), dtype=bool)
    while True:
        kept = np.where(flat, 0.0, weights)
        short = np.bincount(edges, weights=kept)[edges] < -COCIRCULAR
        more = (short & (kept < 0)).reshape(-1, 3).any(axis=1)
        if not more.any():
            break
        flat |= np.repeat(more, 3)
    entries = -weights * np.where(flat, flat_turns, turns)
    stiffness = _transport_matrix(mesh, scalar.stiffness.diagonal(), entries)
    shares = np.repeat(MASS_SHARES[mass] * face_areas(mesh), 3)
    masses = _transport_matrix(mesh, scalar.mass.diagonal(), shares * flat_turns)
    return Laplacian(as_real(stiffness), as_real(masses))


def tangent_frames(mesh: MeshLike | PointCloud) -> Float[np.ndarray, "n 2 3"]:
    """Compute two orthonormal tangent vectors at each vertex, or point of a cloud.

    The first is the direction of the first edge of the vertex, made orthogonal to the area-weighted
    mean normal of its faces. The second is a quarter turn further, counter-clockwise seen from
    outside. The first edge of an inner vertex is that of its first face; the first edge of a
    boundary vertex is the boundary edge with a face on its left.

    The tangent plane of a point of a cloud is the best plane of its 30 nearest neighbors through it.
    The first vector lies in the plane along that coordinate axis which the normal is farthest from;
    the largest coordinate of the normal, from which the second is a quarter turn further, is positive.

    Parameters
    ----------
    mesh : MeshLike or PointCloud

    Returns
    -------
    (n, 2, 3) float
        Without unit.

    Raises
    ------
    InvalidShapeError
        As in `connection_laplacian`, or `local_triangles`; or if the normals of the faces at a vertex cancel, or its
        first edge is parallel to the normal.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.operators.tangent_frames(es.shapes.grid(1, 1)).shape
    (4, 2, 3)
    """
    if isinstance(mesh, PointCloud):
        normals = cloud_normals(mesh)
        axes = np.eye(3)[np.abs(normals).argmin(axis=1)]
        first = unit_vectors(axes - row_dots(axes, normals)[:, None] * normals)
        return np.stack([first, np.cross(normals, first)], axis=1)
    mesh = as_mesh(mesh)
    sides = vertex_directions(mesh)
    points, _ = size_one(mesh.vertices)
    normals = vertex_normals(mesh)
    _, heads = side_ends(mesh.faces)
    along = points[heads[sides.first]] - points
    lengths = np.linalg.norm(along, axis=1)
    along = along - row_dots(along, normals)[:, None] * normals
    left = np.linalg.norm(along, axis=1)
    bad = np.flatnonzero((left <= 1e-12 * lengths) | (np.linalg.norm(normals, axis=1) == 0))
    if bad.size:
        raise InvalidShapeError(
            f"A vertex must have a tangent plane; at vertex {bad[0]} at {mesh.vertices[bad[0]].tolist()} the normals "
            f"of its faces cancel, or lie along its first edge ({bad.size} such)."
        )
    first = along / left[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)


def _cloud_connection(cloud: PointCloud) -> Laplacian:
    scalar, frames = robust_laplacian(cloud), tangent_frames(cloud)
    entries = scalar.stiffness.tocsr()
    rows = np.repeat(np.arange(cloud.n_points), np.diff(entries.indptr))
    # The least turn is the orthogonal factor of the projection of one plane on the other.
    left, _, right = np.linalg.svd(frames[rows] @ frames[entries.indices].swapaxes(1, 2))
    blocks = entries.data[:, None, None] * (left @ right)
    stiffness = sp.bsr_array((blocks, entries.indices, entries.indptr)).tocsr()
    # Rounding of both turns along an edge
    stiffness = (stiffness + stiffness.T) / 2
    return Laplacian(stiffness, sp.kron(scalar.mass, sp.eye_array(2)).tocsr())


def flatten_turns(turns: Complex[np.ndarray, " h"]) -> Complex[np.ndarray, " h"]:
    """Turn the three of each face by a third of its curvature each, so that they lead back to the same vector."""
    around = turns.reshape(-1, 3).prod(axis=1)
    return turns * np.repeat(np.exp(-1j * np.angle(around) / 3), 3)


def _transport_matrix(
    mesh: TriangleMesh, diagonal: Float[np.ndarray, " n"], entries: Complex[np.ndarray, " h"]
) -> sp.csr_array:
    """Put the entry of each side where it acts on its tail and counts at its head, and the conjugate the other way."""
    tails, heads = side_ends(mesh.faces)
    half = sp.csr_array((entries, (heads, tails)), shape=(mesh.n_vertices,) * 2)
    return (sp.diags_array(diagonal.astype(complex)) + half + half.conj().T).tocsr()


def as_real(matrix: sp.csr_array) -> sp.csr_array:
    """Write a Hermitian matrix of n complex numbers as a symmetric one of 2n real numbers."""
    quarter = sp.csr_array(np.array([[0.0, -1.0], [1.0, 0.0]]))
    return (sp.kron(matrix.real, sp.eye_array(2)) + sp.kron(matrix.imag, quarter)).tocsr()
