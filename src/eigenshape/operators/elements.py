"""Lagrange elements of any order on simplices of any dimension.

A node of order p is the mean of p corners, which may repeat: (a, a, a) is the corner a itself, and
(a, a, b) is a third of the way from a to b. The ascending corners identify a node, also if several
elements share it.
"""

from functools import lru_cache
from itertools import combinations_with_replacement
from math import factorial

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import freeze
from certeig.kit.threads import one_blas_thread
from eigenshape._corners import barycentric_gradients, in_length, scaled_corners, volumes_of
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import Mesh


def gradient_products(
    mesh: Mesh, tensors: Float[np.ndarray, "s d d"] | None = None
) -> Float[np.ndarray, "s corners corners"]:
    """Return V ∇λ_a·D∇λ_b for the barycentric coordinates of each simplex, in length^(m-2).

    D is the identity, or one tensor per simplex.
    """
    corners, scale = scaled_corners(mesh)
    basis, triangles, gradients = barycentric_gradients(corners)
    conducted = (
        gradients if tensors is None else gradients @ (basis.transpose(0, 2, 1) @ tensors @ basis)
    )
    products = (conducted @ gradients.transpose(0, 2, 1)) * volumes_of(triangles)[:, None, None]
    return in_length(products, scale, mesh.dim - 2)


def stiffness(
    nodes: Int[np.ndarray, "s nodes"], products: Float[np.ndarray, "s corners corners"], order: int
) -> sp.csr_array:
    """Assemble ∫ ∇N_i·D∇N_j; the diagonal is set so that all row sums are zero."""
    dim = products.shape[1] - 1
    with one_blas_thread():  # how threads split the product would change the last digits
        local = np.einsum("sab,abij->sij", products, reference_stiffness(dim, order), optimize=True)
    weights = _assemble(nodes, local)
    return (weights - sp.diags_array(weights.sum(axis=1))).tocsr()


def mass(mesh: Mesh, nodes: Int[np.ndarray, "s nodes"], order: int) -> sp.csr_array:
    """Assemble ∫ N_i N_j, in length^m."""
    return weighted_mass(simplex_volumes(mesh), nodes, reference_mass(mesh.dim, order))


def weighted_mass(
    measure: Float[np.ndarray, " s"],
    nodes: Int[np.ndarray, "s nodes"],
    reference: Float[np.ndarray, "nodes nodes"],
) -> sp.csr_array:
    """Assemble one local matrix, multiplied by the measure of each simplex."""
    diagonal = np.bincount(nodes.ravel(), weights=np.outer(measure, np.diag(reference)).ravel())
    return (sp.diags_array(diagonal) + _assemble(nodes, measure[:, None, None] * reference)).tocsr()


def _assemble(
    nodes: Int[np.ndarray, "s nodes"], local: Float[np.ndarray, "s nodes nodes"]
) -> sp.csr_array:
    """Sum up the entries off the diagonal: each pair is summed once, then mirrored."""
    i, j = np.triu_indices(nodes.shape[1], 1)
    short = nodes.astype(np.int32)  # as long as indices of SciPy need be
    ends = (short[:, i].ravel(), short[:, j].ravel())
    n = int(nodes.max()) + 1
    half = sp.csr_array((local[:, i, j].ravel(), ends), shape=(n, n))
    return (half + half.T).tocsr()


@lru_cache
def local_nodes(dim: int, order: int) -> Int[np.ndarray, "nodes order"]:
    """Return the nodes of one simplex, each as its corners."""
    return freeze(np.array(list(combinations_with_replacement(range(dim + 1), order))))


def number_nodes(
    simplices: Int[np.ndarray, "s corners"], order: int
) -> tuple[np.ndarray, Int[np.ndarray, "s nodes"]]:
    """Return the nodes of a mesh, each as its corners, (n_nodes, order), and those of each simplex.

    The points of the mesh come first, in their own order. Nodes between two points follow, then
    those between three, and so on.
    """
    named = np.sort(simplices[:, local_nodes(simplices.shape[1] - 1, order)], axis=2)
    n_corners = 1 + np.count_nonzero(np.diff(named, axis=2), axis=2)
    # A sort key for each node: one integer if it fits into 64 bits, otherwise several
    base = int(named.max()) + 1
    if (order + 1) * base**order < 2**63:
        keys = (n_corners * base**order + named @ base ** np.arange(order)[::-1]).ravel()
    else:
        fields = [n_corners, *np.moveaxis(named, 2, 0)]
        keys = np.rec.fromarrays([field.ravel() for field in fields])
    _, firsts, numbers = np.unique(keys, return_index=True, return_inverse=True)
    return named.reshape(-1, order)[firsts], numbers.reshape(n_corners.shape)


@lru_cache
def reference_mass(dim: int, order: int) -> Float[np.ndarray, "nodes nodes"]:
    """Return ∫ N_i N_j over a simplex of volume 1."""
    exponents, coefficients = _basis(dim, order)
    return freeze(coefficients.T @ _integrals(exponents[:, None] + exponents) @ coefficients)


@lru_cache
def mass_floor(dim: int, order: int) -> float:
    """Return the largest c with B ≥ c diag(B) on one simplex, and so on any mesh."""
    reference = reference_mass(dim, order)
    return float(sl.eigvalsh(reference, np.diag(np.diag(reference)))[0])


@lru_cache
def reference_stiffness(dim: int, order: int) -> Float[np.ndarray, "corners corners nodes nodes"]:
    """Return ∫ ∂_a N_i ∂_b N_j over a simplex of volume 1; ∂_a is with respect to λ_a."""
    exponents, coefficients = _basis(dim, order)
    units = np.eye(dim + 1, dtype=np.int64)
    pairs = np.zeros((dim + 1, dim + 1, len(exponents), len(exponents)))
    for a in range(dim + 1):
        for b in range(dim + 1):
            factors = np.outer(exponents[:, a], exponents[:, b])
            sums = np.maximum((exponents - units[a])[:, None] + (exponents - units[b]), 0)
            pairs[a, b] = coefficients.T @ (factors * _integrals(sums)) @ coefficients
    return freeze(pairs)


@lru_cache
def _basis(
    dim: int, order: int
) -> tuple[Int[np.ndarray, "nodes corners"], Float[np.ndarray, "nodes nodes"]]:
    """Return the monomials λ^α with |α| = order, and the basis functions in them as columns."""
    names = local_nodes(dim, order)
    exponents = (names[:, :, None] == np.arange(dim + 1)).sum(axis=1)
    places = exponents / order
    return freeze(exponents), freeze(np.linalg.inv(np.prod(places[:, None] ** exponents, axis=2)))


def _integrals(exponents: Int[np.ndarray, "i j corners"]) -> Float[np.ndarray, "i j"]:
    """Return ∫ λ^α over a simplex of volume 1: m! α! / (m + |α|)!."""
    factorials = np.array([float(factorial(value)) for value in range(int(exponents.max()) + 1)])
    dim = exponents.shape[2] - 1
    below = np.vectorize(lambda degree: float(factorial(dim + degree)), otypes=[float])(
        exponents.sum(axis=2)
    )
    return factorial(dim) * factorials[exponents].prod(axis=2) / below
