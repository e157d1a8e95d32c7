"""Sparse matrices whose eigenvalues are known, or that are hard to solve, made from their properties."""

from functools import reduce

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from certeig.solver.pencil import Pencil


def adjacency(n: int, *, closed: bool = False) -> sp.csr_array:
    """Return the adjacency matrix of a path of n points, or of a ring."""
    ends = [1.0, 1.0] if closed and n > 2 else []
    offsets = [1, -1, *([n - 1, 1 - n] if ends else [])]
    return sp.csr_array(sp.diags_array([1.0, 1.0, *ends], offsets=offsets, shape=(n, n)))


def laplacian(graph: sp.sparray) -> sp.csr_array:
    """Return D - A of a weighted graph."""
    return sp.csr_array(sp.diags_array(graph.sum(axis=1)) - graph)


def string(n: int) -> sp.csr_array:
    """Return the second difference with fixed ends, with λ_j = 4 sin²(πj / (2n + 2))."""
    return sp.csr_array(sp.diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(n, n)))


def string_values(n: int) -> np.ndarray:
    return 4 * np.sin(np.pi * np.arange(1, n + 1) / (2 * n + 2)) ** 2


def ring(n: int) -> sp.csr_array:
    """Return the Laplacian of a ring, with λ_j = 4 sin²(πj/n): all in pairs but one or two."""
    return laplacian(adjacency(n, closed=True))


def ring_values(n: int) -> np.ndarray:
    return np.sort(4 * np.sin(np.pi * np.arange(n) / n) ** 2)


def circulant(n: int, weights: dict[int, float]) -> sp.csr_array:
    """Return the symmetric matrix with W_ij = weights[|i - j| mod n]."""
    rows = np.arange(n)
    entries = [
        sp.coo_array((np.full(n, weight / 2), (rows, (rows + step) % n)), shape=(n, n))
        for step, weight in weights.items()
    ]
    half = sp.csr_array(sum(entries[1:], entries[0]))
    return sp.csr_array(half + half.T)


def circulant_values(n: int, weights: dict[int, float]) -> np.ndarray:
    angles = 2 * np.pi * np.arange(n) / n
    return np.sort(sum(weight * np.cos(step * angles) for step, weight in weights.items()))


def kronecker_sum(*parts: sp.sparray) -> sp.csr_array:
    """Return the matrix of the sums of eigenvalues of the parts."""
    return sp.csr_array(reduce(lambda one, two: sp.kronsum(two, one), parts))


def sums(*values: np.ndarray) -> np.ndarray:
    """Return all sums of one eigenvalue of each part, ascending."""
    return np.sort(reduce(np.add.outer, values).ravel())


def hypercube(dimension: int) -> sp.csr_array:
    """Return the Laplacian of a hypercube: 2j has as many copies as j of the dimensions can be chosen."""
    return laplacian(kronecker_sum(*[adjacency(2)] * dimension))


def hypercube_values(dimension: int) -> np.ndarray:
    return sums(*[np.array([0.0, 2.0])] * dimension)


def arrow(n: int) -> sp.csr_array:
    """Return a star's adjacency: 0 but for -√(n-1) and √(n-1)."""
    matrix = sp.lil_array((n, n))
    matrix[0, 1:] = matrix[1:, 0] = 1.0
    return sp.csr_array(matrix)


def pencil_with(
    values: np.ndarray, rng: np.random.Generator, *, identity: bool = False, turns: int = 2
) -> tuple[sp.csr_array, sp.csr_array]:
    """Return W and B with given eigenvalues: W = M Q diag(λ) Qᵀ Mᵀ and B = M Mᵀ.

    Q turns `turns` times random pairs of axes, and mirrors a few of them; M is lower bidiagonal, and
    scales rows over two decades, unless B is to be the identity.
    """
    n = len(values)
    rotation = sp.csr_array(sp.eye_array(n))
    for _ in range(turns):
        order, angles = rng.permutation(n)[: 2 * (n // 2)], rng.uniform(0, 2 * np.pi, n // 2)
        one, two = order[::2], order[1::2]
        diagonal = np.ones(n)
        diagonal[one] = diagonal[two] = np.cos(angles)
        beside = sp.coo_array((np.sin(angles), (one, two)), shape=(n, n))
        rotation = sp.csr_array(sp.diags_array(diagonal) + beside - beside.T) @ rotation
    few = rng.permutation(n)[:4]
    mirror = np.zeros((n, 1))
    mirror[few, 0] = rng.normal(size=len(few))
    mirror = sp.csr_array(mirror / np.linalg.norm(mirror))
    rotation = sp.csr_array(rotation - 2 * mirror @ (mirror.T @ rotation))
    turned = rotation @ sp.diags_array(values) @ rotation.T
    if identity:
        return _symmetric(turned), sp.csr_array(sp.eye_array(n))
    scales = 10 ** rng.uniform(-1, 1, n)
    beside = rng.uniform(-0.4, 0.4, max(n - 1, 0))
    factor = sp.diags_array(scales) @ (sp.eye_array(n) + sp.diags_array(beside, offsets=-1))
    return _symmetric(factor @ turned @ factor.T), _symmetric(factor @ factor.T)


def _symmetric(matrix: sp.sparray) -> sp.csr_array:
    return sp.csr_array((matrix + matrix.T) / 2)


def random_values(n: int, rng: np.random.Generator) -> np.ndarray:
    """Return n eigenvalues with multiplicities of up to 9, some of them zero, some negative."""
    sizes = rng.integers(1, 10, n)
    copies = np.repeat(np.arange(n), sizes)[:n]
    levels = rng.normal(size=n) if rng.random() < 0.5 else rng.exponential(size=n)
    if rng.random() < 0.3:
        levels[rng.integers(n)] = 0.0
    return np.sort(levels[copies])


def random_grid(
    side: int, seed: int = 0, *, full: bool = False
) -> tuple[sp.csr_array, sp.csr_array]:
    """Return an irregular grid: weights over a decade, and masses, beside the diagonal too if `full`."""
    rng = np.random.default_rng(seed)
    upper = sp.triu(kronecker_sum(adjacency(side), adjacency(side))).tocoo()
    upper.data = 10 ** rng.uniform(-0.5, 0.5, len(upper.data))
    roots = sp.diags_array(rng.uniform(0.7, 1.4, side**2))
    mass = sp.eye_array(side**2)
    if full:
        mass = mass + kronecker_sum(adjacency(side), adjacency(side)) / 8
    return laplacian(upper + upper.T), sp.csr_array(roots @ mass @ roots)


def wild(side: int = 24) -> tuple[sp.csr_array, sp.csr_array]:
    """Return weights over eight decades and masses over six, so that eigenvalues span eleven."""
    rng = np.random.default_rng(1)
    upper = sp.triu(kronecker_sum(adjacency(side), adjacency(side))).tocoo()
    upper.data = 10 ** rng.uniform(-4, 4, len(upper.data))
    return laplacian(upper + upper.T), sp.csr_array(
        sp.diags_array(10 ** rng.uniform(-3, 3, side**2))
    )


def full_parts(copies: int) -> sp.csr_array:
    """Return a direct sum of complete graphs with four points: 0 and 4, each three times as often."""
    return sp.csr_array(sp.block_diag([laplacian(sp.csr_array(np.ones((4, 4))))] * copies))


def scaled(stiffness: sp.sparray, mass: sp.sparray | None = None) -> Pencil:
    """Return a pencil as the solver has it."""
    return Pencil.scaled(
        sp.csr_array(stiffness),
        sp.csr_array(sp.eye_array(stiffness.shape[0])) if mass is None else mass,
    )


def dense_values(stiffness: sp.sparray, mass: sp.sparray | None = None) -> np.ndarray:
    """Return all eigenvalues by LAPACK."""
    return sl.eigvalsh(stiffness.toarray(), None if mass is None else mass.toarray())


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


def surface(n: int) -> sp.csr_array:
    """Return the graph Laplacian of the convex hull of n points on a spiral around a sphere."""
    from scipy.spatial import ConvexHull

    heights = 1 - (2 * np.arange(n) + 1) / n
    angles = np.pi * (1 + np.sqrt(5)) * np.arange(n)
    widths = np.sqrt(1 - heights**2)
    points = np.stack([widths * np.cos(angles), widths * np.sin(angles), heights], axis=1)
    corners = ConvexHull(points).simplices
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    ones = sp.csr_array((np.ones(len(edges)), edges.T), shape=(n, n))
    return laplacian(sp.csr_array(ones + ones.T > 0, dtype=np.float64))
