"""Hodge decompositions: of vectors on faces, and of one-forms on edges."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from eigenshape._arrays import real_numbers
from eigenshape._errors import ConvergenceError, InvalidParameterError, InvalidShapeError
from eigenshape._text import html_repr, short_repr
from eigenshape._typing import ArrayLike
from eigenshape.calculus.heat_distance import factorize_definite
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.homology import betti_numbers, edges_of
from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import scaled_corners
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian
from eigenshape.operators.directions import require_oriented_manifold

Rim = Literal["tangential", "normal"]

# A vector counts as tangent if its part along the normal is at most this share of it: vectors that
# were projected in single precision pass.
TANGENT = 1e-6
# Share of a face's weight in the penalty on d ω: small enough that a few rounds are exact, large
# enough that rounding leaves half of the digits to each round.
PENALTY = 1e-8
# Rounds of the penalty at most; two to five are enough for 100,000 edges.
ROUNDS = 40
# Change of the closed part in a round, as a share of the largest value, at which rounds end.
CLOSED = 1e-12
# Harmonic parts of this many more random fields than there are dimensions are taken, so that none
# is missing.
SPARE_FIELDS = 2


@dataclass(frozen=True, eq=False)
class HodgeDecomposition:
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
    """

    exact: Float[np.ndarray, "..."]
    coexact: Float[np.ndarray, "..."]
    harmonic: Float[np.ndarray, "..."]
    potential: Float[np.ndarray, " n"]
    stream: Float[np.ndarray, " e"]

    __repr__ = short_repr
    _repr_html_ = html_repr


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
    _require_rim(boundary)
    require_sound(mesh)
    require_oriented_manifold(mesh)
    field = _as_tangent_vectors(mesh, vectors)
    exact, coexact, potential, stream = _split_field(mesh, field[:, :, None], boundary)
    exact, coexact = exact[:, :, 0], coexact[:, :, 0]
    harmonic = field - exact - coexact
    return HodgeDecomposition(exact, coexact, harmonic, potential[:, 0], stream[:, 0])


def harmonic_fields(mesh: MeshLike, *, boundary: Rim = "tangential") -> Float[np.ndarray, "b f 3"]:
    """Compute an orthonormal basis of the harmonic vector fields of a surface.

    Harmonic parts of random fields span the space; its dimension β_1 is known from topology.

    Parameters
    ----------
    mesh : MeshLike
        As in `decompose_field`.
    boundary : {"tangential", "normal"}
        As in `decompose_field`.

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
    _require_rim(boundary)
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
    for _ in range(2):
        exact, coexact, _, _ = _split_field(mesh, fields, boundary)
        fields = fields - exact - coexact
    weighted = (fields * np.sqrt(areas)[:, None, None]).reshape(3 * mesh.n_faces, -1)
    basis, _, _ = np.linalg.svd(weighted, full_matrices=False)
    found = basis[:, :dimension].T.reshape(dimension, mesh.n_faces, 3)
    return found / np.sqrt(areas)[:, None] / _scale(mesh)


def one_form_edges(mesh: MeshLike) -> Int[np.ndarray, "e 2"]:
    """List the edges on which a one-form has a value, each from its lower to its higher point.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.

    Returns
    -------
    (e, 2) int
        In lexicographic order; on triangles these are the edges of `edge_table`.

    Examples
    --------
    The differences of a function at the ends of all edges are a one-form:

    >>> import eigenshape as es
    >>> cube = es.shapes.box(1, 1, 1)
    >>> tails, heads = es.calculus.one_form_edges(cube).T
    >>> form = cube.points[heads, 0] - cube.points[tails, 0]
    >>> bool(abs(es.calculus.decompose_one_form(cube, form).coexact).max() < 1e-12)
    True
    """
    return edges_of(as_simplicial(mesh))


def decompose_one_form(
    mesh: MeshLike, values: ArrayLike, *, boundary: Rim = "tangential"
) -> HodgeDecomposition:
    """Decompose a one-form on edges into an exact, a coexact and a harmonic part.

    A one-form has one number per edge: the integral of a vector field along it. ω = df + δβ + h,
    orthogonal in the inner product of Whitney forms ∫ W_i·W_j (Whitney 1957; Arnold, Falk, Winther
    2006), which is definite on any mesh. Orientation plays no part. Works on triangles and
    tetrahedra.

    The harmonic part has the dimension β_1 of the topology with "tangential", and that of the
    cohomology relative to the boundary with "normal": β_1 on orientable surfaces, 0 on a Möbius
    band, β_2 in solids (Lefschetz duality).

    Parameters
    ----------
    mesh : MeshLike
        Triangles or tetrahedra, in any R^d.
    values : (e,) float
        One number per edge of `one_form_edges(mesh)`, from the lower to the higher point.
    boundary : {"tangential", "normal"}
        "tangential": no condition on f; δβ and h have no part normal to the boundary. "normal": f
        and h are 0 along the boundary.

    Returns
    -------
    HodgeDecomposition
        Fields of shape (e,), in the unit of `values`; `stream` has one number per triangle.

    Raises
    ------
    InvalidShapeError
        If the mesh is of another dimension, a simplex has no volume, or a point has no simplex.
    InvalidParameterError
        If `values` does not hold one finite number per edge, or `boundary` is not one of the two.
    ConvergenceError
        If rounding keeps the closed part from being closed, on extremely thin simplices.

    See Also
    --------
    decompose_field : The same for one vector per face.

    Examples
    --------
    >>> import eigenshape as es
    >>> ring = es.shapes.torus(12, 8)
    >>> form = es.calculus.one_form_edges(ring) @ [1.0, 2.0]
    >>> parts = es.calculus.decompose_one_form(ring, form)
    >>> bool(abs(parts.exact + parts.coexact + parts.harmonic - form).max() < 1e-9)
    True
    """
    mesh = as_simplicial(mesh)
    _require_rim(boundary)
    if mesh.dim not in (2, 3):
        raise InvalidShapeError(f"One-forms need triangles or tetrahedra; the mesh is a {mesh!r}.")
    require_sound(mesh)
    edges = edges_of(mesh)
    form = real_numbers(values, "values").astype(np.float64)
    if form.shape != (len(edges),):
        raise InvalidParameterError(
            f"values must hold one number per edge of one_form_edges(mesh), shape ({len(edges)},); "
            f"the shape is {form.shape}."
        )
    bad = np.flatnonzero(~np.isfinite(form))
    if bad.size:
        raise InvalidParameterError(f"values must be finite; entry {bad[0]} is {form[bad[0]]}.")
    mass = _whitney_mass(mesh, edges)
    d0, d1 = _differentials(mesh, edges)
    fixed = np.zeros(mesh.n_points, dtype=bool)
    free = np.ones(len(edges), dtype=bool)
    if boundary == "normal":
        table = facet_table(mesh)
        rim = table.facets[table.boundary]
        fixed[rim] = True
        on_rim = _edge_keys(edges_of_rows(rim), mesh.n_points)
        free = ~np.isin(_edge_keys(edges, mesh.n_points), on_rim)
    stiffness = d0.T @ mass @ d0
    stiffness = ((stiffness + stiffness.T) / 2).tocsr()  # rounding leaves a zero on one side alone
    potential = _solve_grounded(stiffness, (d0.T @ (mass @ form))[:, None], fixed)[:, 0]
    exact = d0 @ potential
    closed, stream = _closed_part(form - exact, mass, d1, free)
    # The closed part of what is left is harmonic up to rounding, which is projected away.
    rounding = _solve_grounded(stiffness, (d0.T @ (mass @ closed))[:, None], fixed)[:, 0]
    harmonic = closed - d0 @ rounding
    return HodgeDecomposition(exact, form - exact - harmonic, harmonic, potential, stream)


def _require_rim(boundary: str) -> None:
    if boundary not in get_args(Rim):
        raise InvalidParameterError(
            f"boundary must be 'tangential' or 'normal'; it is {boundary!r}."
        )


def _as_tangent_vectors(mesh: TriangleMesh, vectors: ArrayLike) -> Float[np.ndarray, "f 3"]:
    """Return one tangent vector per face, without what rounding leaves along the normal."""
    field = real_numbers(vectors, "vectors").astype(np.float64)
    if field.shape != (mesh.n_faces, 3):
        raise InvalidParameterError(
            f"vectors must hold one vector per face, shape ({mesh.n_faces}, 3); the shape is "
            f"{field.shape}."
        )
    bad = np.flatnonzero(~np.isfinite(field).all(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"vectors must be finite; that of face {bad[0]} is {field[bad[0]].tolist()}."
        )
    normals, _ = _normals_and_areas(mesh)
    along = np.einsum("fd,fd->f", field, normals)
    bad = np.flatnonzero(np.abs(along) > TANGENT * np.linalg.norm(field, axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"vectors must be tangent to their faces; that of face {bad[0]} has the part "
            f"{along[bad[0]]:.4g} along the normal ({bad.size} such). Subtract "
            "(vectors * normals).sum(axis=1)[:, None] * normals, with normals = "
            "es.geometry.face_normals(mesh)."
        )
    return field - along[:, None] * normals


def _scale(mesh: Mesh) -> float:
    return scaled_corners(mesh)[1]


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
        loads = np.stack(
            [
                np.bincount(nodes.ravel(), load.ravel(), minlength=len(fixed))
                for load in local.T.swapaxes(1, 2)
            ],
            axis=1,
        )
        found = _solve_grounded(stiffness, loads, fixed)
        potentials.append(found * scale)
        parts.append(np.einsum("fad,fak->fdk", gradients, found[nodes]))
    return parts[0], parts[1], potentials[0], potentials[1]


def _solve_grounded(
    stiffness: sp.csr_array, loads: Float[np.ndarray, "n k"], fixed: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, "n k"]:
    """Solve W x = loads with x = 0 at fixed points, and at one point of each component without."""
    _, components = connected_components(stiffness, directed=False)
    _, firsts = np.unique(components, return_index=True)
    has_fixed = np.isin(components[firsts], components[fixed])
    zero = fixed.copy()
    zero[firsts[~has_fixed]] = True
    free = np.flatnonzero(~zero)
    solution = np.zeros(loads.shape)
    if free.size:
        solution[free] = factorize_definite(stiffness[free][:, free]).solve(loads[free])
    return solution


def edges_of_rows(rows: Int[np.ndarray, "r c"]) -> Int[np.ndarray, "k 2"]:
    """Return all pairs of each row, with duplicates."""
    first, second = np.triu_indices(rows.shape[1], 1)
    return np.column_stack([rows[:, first].ravel(), rows[:, second].ravel()])


def _edge_keys(edges: Int[np.ndarray, "e 2"], n: int) -> Int[np.ndarray, " e"]:
    return edges.min(axis=1) * n + edges.max(axis=1)


def _whitney_mass(mesh: Mesh, edges: Int[np.ndarray, "e 2"]) -> sp.csr_array:
    """Assemble ∫ W_ij·W_kl of the Whitney forms W_ij = λ_i ∇λ_j - λ_j ∇λ_i."""
    corners = np.sort(mesh.simplices, axis=1)
    order = np.argsort(mesh.simplices, axis=1)
    products = elements.gradient_products(mesh)
    products = np.take_along_axis(products, order[:, :, None], axis=1)
    products = np.take_along_axis(products, order[:, None, :], axis=2)
    m = mesh.dim
    # ∫ λ_i λ_k over a simplex of volume 1.
    means = (1 + np.eye(m + 1)) / ((m + 1) * (m + 2))
    i, j = np.triu_indices(m + 1, 1)
    k, last = i, j
    local = (
        means[np.ix_(i, k)] * products[:, j[:, None], last]
        - means[np.ix_(i, last)] * products[:, j[:, None], k]
        - means[np.ix_(j, k)] * products[:, i[:, None], last]
        + means[np.ix_(j, last)] * products[:, i[:, None], k]
    )
    keys = _edge_keys(edges, mesh.n_points)
    numbers = np.searchsorted(keys, corners[:, i] * mesh.n_points + corners[:, j])
    rows = np.broadcast_to(numbers[:, :, None], local.shape)
    columns = np.broadcast_to(numbers[:, None, :], local.shape)
    full = sp.coo_array(
        (local.ravel(), (rows.ravel(), columns.ravel())), shape=(len(edges),) * 2
    ).tocsr()
    return ((full + full.T) / 2).tocsr()


def _differentials(mesh: Mesh, edges: Int[np.ndarray, "e 2"]) -> tuple[sp.csr_array, sp.csr_array]:
    """Return the matrices of d on functions and on one-forms; triangles run from low to high."""
    n, number = mesh.n_points, np.arange(len(edges))
    ones = np.ones(len(edges))
    d0 = sp.coo_array(
        (
            np.concatenate([-ones, ones]),
            (np.concatenate([number, number]), edges.T.ravel()),
        ),
        shape=(len(edges), n),
    ).tocsr()
    rows = np.sort(mesh.simplices, axis=1) if mesh.dim == 2 else facet_table(mesh).facets
    keys = _edge_keys(edges, n)
    sides = [
        np.searchsorted(keys, rows[:, a] * n + rows[:, b]) for a, b in ((0, 1), (1, 2), (0, 2))
    ]
    signs = np.repeat([1.0, 1.0, -1.0], len(rows))
    places = (np.tile(np.arange(len(rows)), 3), np.concatenate(sides))
    d1 = sp.coo_array((signs, places), shape=(len(rows), len(edges))).tocsr()
    return d0, d1


def _closed_part(
    form: Float[np.ndarray, " e"],
    mass: sp.csr_array,
    d1: sp.csr_array,
    free: Bool[np.ndarray, " e"],
) -> tuple[Float[np.ndarray, " e"], Float[np.ndarray, " q"]]:
    """Return the nearest closed one-form that is 0 off the free edges, and the multipliers.

    Least squares under d z = 0, by the method of multipliers: each round is one solve with
    M + dᵀPd/ε, which is definite, whereas the saddle point system is singular on tetrahedra.
    """
    inner = np.flatnonzero(free)
    matrix, differential = mass[inner][:, inner], d1[:, inner].tocsr()
    # The penalty has the size of the mass, so that ε is a share in any unit.
    penalty = float(matrix.diagonal().mean()) / PENALTY
    factor = factorize_definite(matrix + penalty * (differential.T @ differential))
    loads = (mass @ form)[inner]
    closed, stream = np.zeros(len(inner)), np.zeros(d1.shape[0])
    size = float(np.abs(form).max(initial=0.0))
    for _ in range(ROUNDS):
        # Rounding of the penalty must stay in the range of dᵀ, or it would enter the closed part.
        turning = stream + penalty * (differential @ closed)
        rest = loads - matrix @ closed - differential.T @ turning
        step = factor.solve(rest[:, None])[:, 0]
        closed = closed + step
        stream = stream + penalty * (differential @ closed)
        if np.abs(step).max(initial=0.0) <= CLOSED * size:
            break
    else:
        raise ConvergenceError(
            f"The closed part of a one-form must have no circulation; after {ROUNDS} rounds it "
            f"still changes by {np.abs(step).max() / size:.2g} of the largest value. Simplices may "
            'be too thin; try repair(mesh, ["collapse_needles"]).'
        )
    whole = np.zeros(len(form))
    whole[inner] = closed
    return whole, stream
