"""The Hodge decomposition of one-forms, numbers on edges."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import real_numbers
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import require_finite_rows
from eigenshape._corners import edges_of
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.hodge import HodgeDecomposition, Rim
from eigenshape.calculus.linear_solver import factorize_definite, factorize_grounded
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements

# Share of a face's weight in the penalty on d ω: small enough that a few rounds are exact, large
# enough that rounding leaves half of the digits to each round.
PENALTY = 1e-8


# Rounds of the penalty at most; two to five are enough for 100,000 edges.
ROUNDS = 40


# Change of the closed part in a round, as a share of the largest value, at which rounds end.
CLOSED = 1e-12


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
    require_choice(boundary, Rim, "boundary")
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
    require_finite_rows(form, "values", "edge")
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
    poisson = factorize_grounded(stiffness, fixed)
    potential = poisson.solve((d0.T @ (mass @ form))[:, None])[:, 0]
    exact = d0 @ potential
    # What is left has a nearest closed one-form that is 0 off the free edges: least squares under
    # d z = 0, by the method of multipliers. Each round is one solve with M + dᵀPd/ε, which is
    # definite, whereas the saddle point system is singular on tetrahedra.
    rest = form - exact
    inner = np.flatnonzero(free)
    matrix, differential = mass[inner][:, inner], d1[:, inner].tocsr()
    # The penalty has the size of the mass, so that ε is a share in any unit.
    penalty = float(matrix.diagonal().mean()) / PENALTY
    factor = factorize_definite(matrix + penalty * (differential.T @ differential))
    loads = (mass @ rest)[inner]
    closed, stream = np.zeros(len(edges)), np.zeros(d1.shape[0])
    size = float(np.abs(rest).max(initial=0.0))
    for _ in range(ROUNDS):
        # Rounding of the penalty must stay in the range of dᵀ, or it would enter the closed part.
        turning = stream + penalty * (differential @ closed[inner])
        residual = loads - matrix @ closed[inner] - differential.T @ turning
        step = factor.solve(residual[:, None])[:, 0]
        closed[inner] += step
        stream = stream + penalty * (differential @ closed[inner])
        if np.abs(step).max(initial=0.0) <= CLOSED * size:
            break
    else:
        raise ConvergenceError(
            f"The closed part of a one-form must have no circulation; after {ROUNDS} rounds it "
            f"still changes by {np.abs(step).max() / size:.2g} of the largest value. Simplices may "
            'be too thin; try repair(mesh, ["collapse_needles"]).'
        )
    # The closed part is harmonic up to rounding, which is projected away.
    rounding = poisson.solve((d0.T @ (mass @ closed))[:, None])[:, 0]
    harmonic = closed - d0 @ rounding
    return HodgeDecomposition(exact, form - exact - harmonic, harmonic, potential, stream)


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
    local = (
        means[np.ix_(i, i)] * products[:, j[:, None], j]
        - means[np.ix_(i, j)] * products[:, j[:, None], i]
        - means[np.ix_(j, i)] * products[:, i[:, None], j]
        + means[np.ix_(j, j)] * products[:, i[:, None], i]
    )
    keys = _edge_keys(edges, mesh.n_points)
    numbers = np.searchsorted(keys, corners[:, i] * mesh.n_points + corners[:, j])
    rows = np.broadcast_to(numbers[:, :, None], local.shape)
    columns = np.broadcast_to(numbers[:, None, :], local.shape)
    full = sp.csr_array((local.ravel(), (rows.ravel(), columns.ravel())), shape=(len(edges),) * 2)
    return ((full + full.T) / 2).tocsr()


def _differentials(mesh: Mesh, edges: Int[np.ndarray, "e 2"]) -> tuple[sp.csr_array, sp.csr_array]:
    """Return the matrices of d on functions and on one-forms; triangles run from low to high."""
    n, number = mesh.n_points, np.arange(len(edges))
    ends = (np.tile(number, 2), edges.T.ravel())
    signs = np.repeat([-1.0, 1.0], len(edges))
    d0 = sp.csr_array((signs, ends), shape=(len(edges), n))
    rows = np.sort(mesh.simplices, axis=1) if mesh.dim == 2 else facet_table(mesh).facets
    keys = _edge_keys(edges, n)
    sides = [
        np.searchsorted(keys, rows[:, a] * n + rows[:, b]) for a, b in ((0, 1), (1, 2), (0, 2))
    ]
    signs = np.repeat([1.0, 1.0, -1.0], len(rows))
    places = (np.tile(np.arange(len(rows)), 3), np.concatenate(sides))
    d1 = sp.csr_array((signs, places), shape=(len(rows), len(edges)))
    return d0, d1
