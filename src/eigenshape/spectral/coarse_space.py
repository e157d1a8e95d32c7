"""A space of few functions that holds the lowest eigenfunctions of an operator nearly: bumps on patches of points."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.linalg import eigsh

from eigenshape.spectral.coarse_space_loops import grow_patches, join_fragments, smooth_indicators

FRAGMENT = 0.5  # of the size aimed at, below which a patch is given away
DEGREE = 1.4  # steps of smoothing per edge that a patch is across
MESH_ROW = 7.0  # entries in a row of a triangle mesh, whose steps reach one edge far
PASSED = 4.0  # points of a patch to the wavelength from which functions are kept
LEAST_RATIO = 2.5  # of the top to the least of the zeros' interval
HEAVY = 0.3  # of a patch's mean mass, from which a point has a function of its own
UNUSUAL = 3.0  # times the mean mass, at least
MOST_KEPT = 0.5  # of the functions asked for
COVERED = 0.2  # sum of the bumps at a point, below which too
VECTORS = 20  # of the space in which the largest eigenvalue is looked for
TOLERANCE = 0.02
MARGIN = 1.05  # on what is found there


@dataclass(frozen=True, eq=False)
class CoarseSpace:
    """Functions P and the operator among them.

    Attributes
    ----------
    prolongation : (n, m) sparse
        P: its columns, smooth bumps and single points, sum to 1.
    stiffness, mass : (m, m) sparse
        PᵀAP and PᵀMP.
    top : float
        About the largest eigenvalue of diag(A)⁻¹A, rather more than less.
    """

    prolongation: sp.csr_array
    stiffness: sp.csr_array
    mass: sp.csr_array
    top: float


def coarse_space(
    stiffness: sp.csr_array, mass: Float[np.ndarray, " n"], n_coarse: int, *, smooth: bool = True
) -> CoarseSpace:
    """Join points into about `n_coarse` patches and smooth their indicators (Vaněk, Mandel and Brezina 1996).

    The smoother is a polynomial in diag(A)⁻¹A that is 1 at 0 and has the zeros of a Chebyshev polynomial where steps
    from patch to patch have their energy. Points of much mass, of which a patch would take in too few, have a function
    each, and the bumps around them are divided by their sum. Without smoothing functions are rough, but never
    nearly dependent.
    """
    n, inverse, kept = len(mass), inverse_diagonal(stiffness), _kept(mass, n_coarse)
    top = _top(stiffness, inverse)
    labels, count = _patches(stiffness, np.where(kept, 0.0, 1.0), n / n_coarse)
    members = np.argsort(labels, kind="stable")[np.count_nonzero(labels < 0) :]
    starts = np.searchsorted(labels[members], np.arange(count + 1))
    steps = _steps(top, n / count, stiffness.nnz / n) if smooth else np.empty(0)
    matrix = stiffness.indptr, stiffness.indices, stiffness.data
    first, rows, values = smooth_indicators(matrix, inverse, starts, members, steps)
    down = _prolongation(sp.csc_array((values, rows, first), shape=(n, count)), kept)
    up = sp.csr_array(down.T)
    return CoarseSpace(
        prolongation=down,
        stiffness=_symmetric(up @ (stiffness @ down)),
        mass=_symmetric(up @ (sp.diags_array(mass) @ down)),
        top=top,
    )


def _kept(mass: Float[np.ndarray, " n"], n_coarse: int) -> Bool[np.ndarray, " n"]:
    """Choose the points that have a function of their own."""
    limit = float(mass.mean()) * max(HEAVY * len(mass) / n_coarse, UNUSUAL)
    most = int(MOST_KEPT * n_coarse)
    if 0 < most < len(mass):
        limit = max(limit, float(np.partition(mass, -most)[-most]))
    return mass > limit


def _prolongation(bumps: sp.csc_array, kept: Bool[np.ndarray, " n"]) -> sp.csr_array:
    sums = np.asarray(bumps.sum(axis=1))
    own = np.flatnonzero(kept | (sums < COVERED))
    sums[own] = np.inf
    singles = sp.csr_array((np.ones(len(own)), (own, np.arange(len(own)))), shape=(len(sums), len(own)))
    joined = sp.csr_array(sp.hstack([sp.diags_array(1 / sums) @ bumps, singles]))
    joined.eliminate_zeros()
    return sp.csr_array(joined[:, np.unique(joined.indices)])


def inverse_diagonal(stiffness: sp.csr_array) -> Float[np.ndarray, " n"]:
    """Return 1/a_ii, 0 where a_ii is 0."""
    diagonal = stiffness.diagonal()
    return np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)


def _top(stiffness: sp.csr_array, inverse: Float[np.ndarray, " n"]) -> float:
    """Return about the largest eigenvalue of D⁻¹A, rather more than less, and at most Gershgorin's bound."""
    bound = float((abs(stiffness).sum(axis=1) * inverse).max())
    roots = sp.diags_array(np.sqrt(inverse))
    start = np.random.default_rng(0).standard_normal(len(inverse))
    scaled = sp.csr_array(roots @ stiffness @ roots)
    if not scaled.count_nonzero():
        return 1.0
    options = {"which": "LA", "v0": start, "ncv": VECTORS, "tol": TOLERANCE, "return_eigenvectors": False}
    found = eigsh(scaled, 1, **options)
    return min(MARGIN * float(found[0]), bound)


def _patches(
    stiffness: sp.csr_array, weights: Float[np.ndarray, " n"], size: float
) -> tuple[Int[np.ndarray, " n"], int]:
    matrix = stiffness.indptr, stiffness.indices, weights
    labels, count = grow_patches(*matrix, size)
    return labels, join_fragments(*matrix, labels, count, FRAGMENT * size)


def _steps(top: float, size: float, row: float) -> Float[np.ndarray, " steps"]:
    degree = max(round(DEGREE * np.sqrt(size * MESH_ROW / row)), 1)
    low = top / max(size / PASSED, LEAST_RATIO)
    nodes = np.cos(np.pi * (2 * np.arange(degree) + 1) / (2 * degree))
    return 2 / (top + low + (top - low) * nodes)


def _symmetric(matrix: sp.sparray) -> sp.csr_array:
    return sp.csr_array((matrix + matrix.T) / 2)
