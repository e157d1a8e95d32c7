"""Curvature of a mesh: Gaussian by the angles around its vertices, principal by fitted polynomials."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape._corners import face_angles, in_length
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import row_dots, scale_to_unit, unit_vectors
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound, warn_of_seams
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import edge_table, neighbor_links

# Vertices whose polynomials are fitted together: the products of monomials of 19 neighbors each
# take 30 MB then.
VERTICES_AT_ONCE = 1 << 11
# Points from which a cubic, of 10 coefficients, is fitted; below, a quadratic of 6. A quarter more
# points than coefficients keep the fit of boundary corners stable.
ENOUGH_FOR_CUBIC = 13
# Eigenvalues of the normal equations up to this share of the largest are left out; those of good
# neighborhoods are 1e-4 of it or more.
UNDETERMINED = 1e-9


def angle_defects(mesh: TriangleMesh) -> Float[np.ndarray, " n"]:
    """Return the angle defect at each vertex: the full turn minus the angles of its faces.

    K_i = 2π - Σ θ - (π/2) Σ (2 - number of faces at the edge), with sums over the angles and the
    edges at the vertex. The last sum is 0 inside, π on a boundary and 2π where a boundary passes
    twice. The sum of all defects is 2π times the Euler characteristic (Gauss-Bonnet) on any mesh.
    """
    table = edge_table(mesh)
    n = mesh.n_vertices
    angles = np.bincount(mesh.faces.ravel(), weights=face_angles(mesh).ravel(), minlength=n)
    missing_faces = np.repeat(2.0 - table.n_faces, 2)
    missing = np.bincount(table.edges.ravel(), weights=missing_faces, minlength=n)
    return 2 * np.pi - angles - np.pi / 2 * missing


def gaussian_curvature(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Compute the Gaussian curvature at each vertex: its angle defect divided by its area.

    K_i / A_i with A_i a third of the area of the faces at the vertex (Meyer, Desbrun, Schröder and
    Barr 2003, with that area).

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    (n,) float
        Curvature of each vertex, in 1/length². The sum of the curvatures times `dual_volumes` is 2π
        times the Euler characteristic.

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or areas overflow.

    See Also
    --------
    dual_volumes : The areas A_i.

    Notes
    -----
    At a boundary vertex the defect measures the turn of the boundary within the surface, so the
    value is not comparable with the curvature inside. The values converge pointwise on regular
    meshes, where six faces meet at each vertex; on others a part of the error remains. Section 5.4
    of the thesis compares the extrema of this function as feature points.

    Examples
    --------
    The total curvature of a sphere is 4π.

    >>> import eigenshape as es
    >>> sphere = es.icosphere(2)
    >>> curvature = es.geometry.gaussian_curvature(sphere)
    >>> total = (curvature * es.geometry.dual_volumes(sphere)).sum()
    >>> bool(abs(total - 4 * 3.14159265) < 1e-6)
    True
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    warn_of_seams(mesh)
    return angle_defects(mesh) / dual_volumes(mesh)


@record
class PrincipalCurvatures(ReadOnly):
    """The principal curvatures of a surface at its vertices, and their directions.

    Attributes
    ----------
    values : (n, 2) float
        In 1/length, the larger first; positive where the surface is convex seen from the side on
        which its faces are counter-clockwise: 1/R on a sphere that faces outward.
    directions : (n, 2, 3) float
        Unit tangent vectors, orthogonal to each other; their signs mean nothing, and where both
        curvatures are equal, nor do the directions.

    See Also
    --------
    es.geometry.principal_curvatures : Computes them.

    Examples
    --------
    >>> import eigenshape as es
    >>> curvatures = es.geometry.principal_curvatures(es.icosphere(3))
    >>> bool((abs(curvatures.mean - 1) < 0.05).all())
    True
    """

    values: Float[np.ndarray, "n 2"]
    directions: Float[np.ndarray, "n 2 3"]

    @property
    def mean(self) -> Float[np.ndarray, " n"]:
        """Mean curvature H, half the sum; in 1/length."""
        return self.values.mean(axis=1)

    @property
    def gaussian(self) -> Float[np.ndarray, " n"]:
        """Gaussian curvature K, the product; in 1/length²."""
        return self.values.prod(axis=1)


def principal_curvatures(mesh: MeshLike) -> PrincipalCurvatures:
    """Compute the principal curvatures and their directions at each vertex.

    In the tangent plane of each vertex a cubic polynomial is fitted to the heights of the vertices
    within two edges, by least squares (the osculating jets of Cazals and Pouget 2005, of degree 3).
    The error of the curvatures is of second order in the edge length on a smooth surface, on
    irregular meshes and at boundaries, too. Noise is not smoothed; call `denoise` first.

    Parameters
    ----------
    mesh : MeshLike
        With consistently oriented faces.

    Returns
    -------
    PrincipalCurvatures

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex belongs to no face, neighboring faces have
        opposite orientations, or the normals of the faces at a vertex cancel.

    See Also
    --------
    es.geometry.gaussian_curvature : By angle defects, which keeps the Gauss-Bonnet theorem.
    es.operators.mean_curvature : By the Laplacian of positions.

    Examples
    --------
    >>> import eigenshape as es
    >>> torus = es.shapes.torus(96, 48, outer=2.0, inner=1.0)
    >>> es.geometry.principal_curvatures(torus).values[:, 0].mean().round(1).item()
    1.0
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    warn_of_seams(mesh)
    normals = vertex_normals(mesh)
    flat = np.flatnonzero(~normals.any(axis=1))
    if flat.size:
        raise InvalidShapeError(
            f"A vertex must have a normal; those of the faces at vertex {flat[0]} at "
            f"{mesh.vertices[flat[0]].tolist()} cancel ({flat.size} such)."
        )
    points, scale = scale_to_unit(mesh.vertices)
    # Frames whose first axis is any unit vector orthogonal to the normal
    first = unit_vectors(np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)]))
    frames = np.stack([first, np.cross(normals, first), normals], axis=1)
    links = neighbor_links(mesh) + sp.eye_array(mesh.n_vertices, format="csr")
    values = np.empty((mesh.n_vertices, 2))
    directions = np.empty((mesh.n_vertices, 2, 3))
    for start in range(0, mesh.n_vertices, VERTICES_AT_ONCE):
        rows = np.arange(start, min(start + VERTICES_AT_ONCE, mesh.n_vertices))
        near = (links[rows] @ links).tocsr()
        jets = _fit_jets(points, frames[rows], rows, near)
        # The shape operator of each graph, by its two fundamental forms
        fu, fv, fuu, fuv, fvv = jets.T
        metric = np.stack([1 + fu * fu, fu * fv, fu * fv, 1 + fv * fv], axis=1).reshape(-1, 2, 2)
        # The sign makes a graph that bends away from its normal, as a sphere does, positive.
        bending = -np.stack([fuu, fuv, fuv, fvv], axis=1).reshape(-1, 2, 2)
        bending /= np.sqrt(1 + fu * fu + fv * fv)[:, None, None]
        lower = np.linalg.inv(np.linalg.cholesky(metric))
        curvatures, vectors = np.linalg.eigh(lower @ bending @ lower.transpose(0, 2, 1))
        along = lower.transpose(0, 2, 1) @ vectors  # orthonormal in the first fundamental form
        rise = np.einsum("ra,rac->rc", jets[:, :2], along)
        in_frame = np.concatenate([along, rise[:, None]], axis=1)
        axes = np.einsum("rac,rai->rci", in_frame, frames[rows])
        # The larger curvature first
        values[rows], directions[rows] = curvatures[:, ::-1], axes[:, ::-1]
    return PrincipalCurvatures(in_length(values, scale, -1), directions)


def _fit_jets(
    points: Float[np.ndarray, "n 3"],
    frames: Float[np.ndarray, "r 3 3"],
    rows: Int[np.ndarray, " r"],
    near: sp.csr_array,
) -> Float[np.ndarray, "r 5"]:
    """Return f_u, f_v, f_uu, f_uv, f_vv of the height over each tangent plane, at the vertex."""
    owners = np.repeat(np.arange(len(rows)), np.diff(near.indptr))
    offsets = points[near.indices] - points[rows[owners]]
    local = np.einsum("pij,pj->pi", frames[owners], offsets)
    # Divided by the radius of each neighborhood, so that all monomials are of size 1.
    squares = row_dots(local, local)
    radii = np.sqrt(np.maximum.reduceat(squares, near.indptr[:-1]))
    u, v, heights = (local / radii[owners, None]).T
    # A few neighbors do not determine a cubic: its coefficients are then left out.
    counts = np.diff(near.indptr)
    cubic = np.where(counts < ENOUGH_FOR_CUBIC, 0.0, 1.0)[owners]
    monomials = np.stack(
        [np.ones_like(u), u, v, u * u, u * v, v * v]
        + [cubic * each for each in (u * u * u, u * u * v, u * v * v, v * v * v)],
        axis=1,
    )
    products = monomials[:, :, None] * np.column_stack([monomials, heights])[:, None, :]
    sums = np.add.reduceat(products, near.indptr[:-1], axis=0)
    inverses = np.linalg.pinv(sums[:, :, :-1], rcond=UNDETERMINED, hermitian=True)
    fitted = np.einsum("rij,rj->ri", inverses, sums[:, :, -1])
    by_radius = 1 / radii[:, None]
    return np.concatenate(
        [fitted[:, 1:3], fitted[:, 3:6] * np.array([2.0, 1.0, 2.0]) * by_radius], axis=1
    )
