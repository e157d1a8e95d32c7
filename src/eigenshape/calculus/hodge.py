"""Hodge decompositions: of vectors on faces, and of one-forms on edges."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import ReadOnly, real_numbers, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import require_finite_rows
from eigenshape._corners import scaled_corners
from eigenshape._vectors import area_vectors, row_dots
from eigenshape.calculus.derivatives import sum_at_nodes
from eigenshape.calculus.linear_solver import factorize_grounded
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.homology import betti_numbers
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented_manifold, require_sound
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian

Rim = Literal["tangential", "normal"]

# A vector counts as tangent if its part along the normal is at most this share of it: vectors that
# were projected in single precision pass.
TANGENT = 1e-6
# Harmonic parts of this many more random fields than there are dimensions are taken, so that none
# is missing.
SPARE_FIELDS = 2


@record
class HodgeDecomposition(ReadOnly):
    """A field as the sum of three fields that are orthogonal to each other.

    Attributes
    ----------
    exact : (f, 3) or (e,) float
        Gradient of `potential`, without curl.
    coexact : (f, 3) or (e,) float
        Quarter turn of the gradient of `stream` on a surface; in general what is orthogonal to all
        closed fields. Without divergence.
    harmonic : (f, 3) or (e,) float
        The rest, without curl and divergence. Its dimension depends on the topology alone; it is 0
        on a sphere or a disc.
    potential : (n,) float
        Values at the vertices.
    stream : (e,) or (q,) float
        For vectors: values at the midpoints of edges. For a one-form: values on the triangles of
        the mesh, whose codifferential is `coexact`, to about eight digits.

    Examples
    --------
    The gradient of a function on a sphere is exact, and its potential is the function:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> height = ball.vertices[:, 2]
    >>> slopes = es.calculus.gradient(ball, height)
    >>> parts = es.calculus.decompose_field(ball, slopes)
    >>> bool(np.allclose(parts.exact, slopes))
    True
    >>> bool(np.allclose(parts.exact + parts.coexact + parts.harmonic, slopes))
    True
    >>> bool(np.ptp(parts.potential - height) < 1e-9)  # up to a constant
    True
    """

    exact: Float[np.ndarray, "..."]
    coexact: Float[np.ndarray, "..."]
    harmonic: Float[np.ndarray, "..."]
    potential: Float[np.ndarray, " n"]
    stream: Float[np.ndarray, " e"]


def decompose_field(
    mesh: MeshLike, vectors: ArrayLike, *, boundary: Rim = "tangential"
) -> HodgeDecomposition:
    """Decompose vectors on faces into a gradient, a rotated gradient and a harmonic field.

    X = ∇f + J∇g + H, with f linear on each face and continuous, g linear on each face and
    continuous at midpoints of edges only (Crouzeix-Raviart), and J a quarter turn. With these two
    spaces the three parts are orthogonal, and H has exactly the dimension β_1 of the topology
    (Polthier and Preuß 2003; Poelke and Polthier 2016). Each of f and g costs one sparse solve.

    Parameters
    ----------
    mesh : MeshLike
        A manifold with consistently oriented faces.
    vectors : (f, 3) float
        One tangent vector per face, in any unit.
    boundary : {"tangential", "normal"}
        "tangential": f is free and g is 0 on the boundary, so J∇g and H flow along it.
        "normal": f is 0 on the boundary and g is free, so ∇f and H stand perpendicular on it.
        Without boundary both are the same.

    Returns
    -------
    HodgeDecomposition
        Fields of shape (f, 3), orthogonal in Σ area X·Y, in the unit of `vectors`. `potential` and
        `stream` in that unit times length; they are 0 at the first vertex or edge of a component
        that has no boundary condition.

    Raises
    ------
    InvalidShapeError
        If the mesh is no manifold, two neighboring faces are turned against each other, a face has
        no area, or a vertex has no face.
    InvalidParameterError
        If `vectors` has another shape, is not finite or not tangent to its face, or `boundary` is
        not one of the two.

    See Also
    --------
    decompose_one_form : The same for one number per edge, on tetrahedra too.
    harmonic_fields : A basis of the harmonic fields.

    Examples
    --------
    A field around the axis of a torus is harmonic but for the discretization:

    >>> import eigenshape as es
    >>> import numpy as np
    >>> ring = es.shapes.torus(40, 20)
    >>> x, y, _ = ring.vertices[ring.faces].mean(axis=1).T
    >>> around = np.column_stack([-y, x, 0 * x]) / (x**2 + y**2)[:, None]
    >>> normals = es.geometry.face_normals(ring)
    >>> around -= (around * normals).sum(axis=1)[:, None] * normals
    >>> parts = es.calculus.decompose_field(ring, around)
    >>> areas = es.geometry.face_areas(ring)
    >>> sizes = [areas @ (part**2).sum(axis=1) for part in (parts.exact, parts.coexact)]
    >>> bool(max(sizes) < 0.01 * (areas @ (parts.harmonic**2).sum(axis=1)))
    True
    """
    mesh = as_mesh(mesh)
    require_choice(boundary, Rim, "boundary")
    require_sound(mesh)
    require_oriented_manifold(mesh)
    field = real_numbers(vectors, "vectors").astype(np.float64)
    if field.shape != (mesh.n_faces, 3):
        raise InvalidParameterError(
            f"vectors must hold one vector per face, shape ({mesh.n_faces}, 3); the shape is "
            f"{field.shape}."
        )
    require_finite_rows(field, "vectors", "face")
    normals, _ = _normals_and_areas(mesh)
    along = row_dots(field, normals)
    bad = np.flatnonzero(np.abs(along) > TANGENT * np.linalg.norm(field, axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"vectors must be tangent to their faces; that of face {bad[0]} has the part "
            f"{along[bad[0]]:.4g} along the normal ({bad.size} such). Subtract "
            "(vectors * normals).sum(axis=1)[:, None] * normals, with normals = "
            "es.geometry.face_normals(mesh)."
        )
    field = field - along[:, None] * normals  # what rounding leaves along the normal
    exact, coexact, potential, stream = _split_field(mesh, field[:, :, None], boundary)
    exact, coexact = exact[:, :, 0], coexact[:, :, 0]
    harmonic = field - exact - coexact
    return HodgeDecomposition(exact, coexact, harmonic, potential[:, 0], stream[:, 0])


def harmonic_fields(
    mesh: MeshLike, *, boundary: Rim = "tangential", progress: Progress | None = None
) -> Float[np.ndarray, "b f 3"]:
    """Compute an orthonormal basis of the harmonic vector fields of a surface.

    Harmonic parts of random fields span the space; its dimension β_1 is known from topology.

    Parameters
    ----------
    mesh : MeshLike
        As in `decompose_field`.
    boundary : {"tangential", "normal"}
        As in `decompose_field`.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    (b, f, 3) float
        b = β_1 fields with one vector per face, orthonormal in Σ area X·Y, in 1/length.

    Raises
    ------
    InvalidShapeError, InvalidParameterError
        As in `decompose_field`.

    See Also
    --------
    es.geometry.betti_numbers : The number of fields.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.calculus.harmonic_fields(es.shapes.torus(12, 8)).shape
    (2, 192, 3)
    """
    mesh = as_mesh(mesh)
    require_choice(boundary, Rim, "boundary")
    require_sound(mesh)
    require_oriented_manifold(mesh)
    dimension = betti_numbers(mesh)[1]
    if not dimension:
        return np.empty((0, mesh.n_faces, 3))
    normals, areas = _normals_and_areas(mesh)
    rng = np.random.default_rng(0)
    fields = rng.standard_normal((mesh.n_faces, 3, dimension + SPARE_FIELDS))
    fields -= normals[:, :, None] * np.einsum("fd,fdk->fk", normals, fields)[:, None]
    fields /= np.sqrt(areas)[:, None, None]  # else large faces would hide small ones
    # A second pass takes away what rounding left of the much larger other parts.
    report_progress = progress or silent
    for number in range(2):
        report_progress(number / 2, f"pass {number + 1} of 2")
        exact, coexact, _, _ = _split_field(mesh, fields, boundary)
        fields = fields - exact - coexact
    weighted = (fields * np.sqrt(areas)[:, None, None]).reshape(3 * mesh.n_faces, -1)
    basis, _, _ = np.linalg.svd(weighted, full_matrices=False)
    found = basis[:, :dimension].T.reshape(dimension, mesh.n_faces, 3)
    return found / np.sqrt(areas)[:, None] / scaled_corners(mesh)[1]


def _normals_and_areas(
    mesh: TriangleMesh,
) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, " f"]]:
    """Return the normal and the area of each face, scaled to size 1."""
    corners, _ = scaled_corners(mesh)
    vectors = area_vectors(corners)
    areas = np.linalg.norm(vectors, axis=1)
    return vectors / areas[:, None], areas


def _split_field(
    mesh: TriangleMesh, fields: Float[np.ndarray, "f 3 k"], boundary: Rim
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Project fields to gradients and to rotated gradients; return these, and both potentials."""
    corners, scale = scaled_corners(mesh)
    normals, areas = _normals_and_areas(mesh)
    # ∇λ_a is a quarter turn of the side opposite to corner a, divided by twice the area.
    sides = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)
    turned = np.cross(normals[:, None], sides) / (2 * areas[:, None, None])
    table = facet_table(mesh)
    rim = np.zeros(len(table.facets), dtype=bool)
    rim[table.boundary] = True
    fixed_edges = rim if boundary == "tangential" else np.zeros_like(rim)
    fixed_points = np.zeros(mesh.n_vertices, dtype=bool)
    if boundary == "normal":
        fixed_points[table.facets[rim]] = True

    # ∇ψ_a = -2 ∇λ_a for the function of the edge opposite to corner a.
    across = -2 * np.cross(normals[:, None], turned)
    potentials, parts = [], []
    for nodes, gradients, stiffness, fixed in (
        (mesh.faces, turned, cotangent_laplacian(mesh).stiffness, fixed_points),
        (table.simplex_facets, across, crouzeix_raviart_laplacian(mesh).stiffness, fixed_edges),
    ):
        local = np.einsum("f,fad,fdk->fak", areas, gradients, fields)
        loads = sum_at_nodes(nodes, len(fixed), local)
        found = factorize_grounded(stiffness, fixed).solve(loads)
        potentials.append(found * scale)
        parts.append(np.einsum("fad,fak->fdk", gradients, found[nodes]))
    return parts[0], parts[1], potentials[0], potentials[1]
