"""Operators with spectra that are hard to get right: clusters, components, wide scales, full masses."""

from functools import cache

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.laplacian import Laplacian

TETRAHEDRON = TriangleMesh(
    np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
    np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]),
)


def tetrahedra(copies: int) -> TriangleMesh:
    return disjoint_union(*[TETRAHEDRON] * copies)


def graph(adjacency, mass=None) -> Laplacian:
    """Combinatorial Laplacian D - A, with unit masses unless told."""
    adjacency = sp.csr_array(adjacency, dtype=np.float64)
    masses = np.ones(adjacency.shape[0]) if mass is None else mass
    return Laplacian(
        sp.csr_array(sp.diags_array(adjacency.sum(axis=1)) - adjacency),
        sp.csr_array(sp.diags_array(masses)),
    )


def path(n: int) -> sp.csr_array:
    return sp.csr_array(sp.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[1, -1]))


def cycle(n: int) -> sp.csr_array:
    closing = sp.coo_array((np.ones(2), ([0, n - 1], [n - 1, 0])), shape=(n, n))
    return sp.csr_array(path(n) + closing)


def hypercube(dimension: int) -> sp.csr_array:
    adjacency = path(2)
    for _ in range(dimension - 1):
        adjacency = sp.csr_array(sp.kronsum(adjacency, path(2)))
    return adjacency


def wild(side: int = 24) -> Laplacian:
    """Weights over eight decades and masses over six, so that eigenvalues span eleven."""
    rng = np.random.default_rng(1)
    upper = sp.triu(sp.kronsum(path(side), path(side))).tocoo()
    upper.data = 10 ** rng.uniform(-4, 4, len(upper.data))
    return graph(upper + upper.T, 10 ** rng.uniform(-3, 3, side**2))


@cache
def dense_eigenvalues(laplacian: Laplacian) -> np.ndarray:
    """Return all eigenvalues; several tests ask for those of one operator."""
    stiffness, mass = laplacian.stiffness.toarray(), laplacian.mass
    if mass.nnz == mass.shape[0]:  # diagonal: an ordinary problem, in a third of the time
        scales = 1 / np.sqrt(mass.diagonal())
        return sl.eigvalsh(scales[:, None] * stiffness * scales)
    return sl.eigh(stiffness, mass.toarray(), eigvals_only=True)


def random_symmetric(n: int, density: float, seed: int) -> sp.csc_array:
    """Return a sparse symmetric matrix, indefinite, whose diagonal is larger than most entries."""
    rng = np.random.default_rng(seed)
    half = sp.random_array(
        (n, n), density=density, rng=rng, data_sampler=lambda size: rng.normal(size=size)
    )
    matrix = sp.csc_array(
        half + half.T + sp.diags_array(rng.normal(size=n) + 3 * np.sign(rng.normal(size=n)))
    )
    matrix.sort_indices()
    return matrix
