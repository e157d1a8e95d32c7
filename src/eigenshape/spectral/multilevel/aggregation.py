"""A hierarchy of coarser operators by smoothed aggregation (Vaněk, Mandel, Brezina 1996)."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from certeig.kit.arrays import record
from certeig.kit.threads import free_threads, map_in_threads, share_units
from certeig.solver.chebyshev import largest_ritz_value
from eigenshape.spectral.multilevel.multilevel_loops import grow_aggregates, multiply_sparse

LARGEST = 256  # most points in an aggregate, on average
TOO_LITTLE = 1.5  # ratio of points between levels below which another level is not worth its cost
# Smoothing steps per edge of an aggregate's diameter. From a million points to 9,000, 18 steps make
# eigenvalues err by 0.2 % of the 300th, 16 steps by 0.3 %, and 10 steps by several per cent. Each
# step lengthens the rows of P and of the next level by a tenth.
DEGREE = 1.7
MESH_ROW = 7.0  # entries per row of a triangle mesh, where a smoothing step reaches one edge far
# Smoothing keeps functions with at least size / PASSED points per wavelength (an area on surfaces),
# where `size` is the number of points in an aggregate.
PASSED = 2.8
LEAST_RATIO = 2.5  # smallest ratio of the ends of the interval that smoothing damps
ENERGY_ROUNDING = 1e-12  # share of the summed energies below which an energy counts as rounding
# Smoothing damps the eigenvalues above top / (SMOOTHED × points of an aggregate).
SMOOTHED = 0.6
LEAST_SPREADS = (6.0, 20.0)  # smallest spread of operators with long rows, and of a triangle mesh
ROWS_A_THREAD = 4096  # rows of a product that are worth a thread


@record
class Level:
    """An operator of the hierarchy, and the prolongation from the next coarser one.

    Attributes
    ----------
    stiffness, mass : (n, n) sparse
        A and M in double precision; no `mass` where M is diagonal.
    weights : (n, 1) float
        The diagonal of M.
    rough : (n, n) sparse
        A in single precision, for corrections.
    rough_scales : ((n, 1) float, (n, 1) float)
        The diagonals of M and of diag(A)⁻¹ in single precision.
    prolong : (n, m) sparse
        P in the precision of the vectors. Its columns are the basis functions of the next level.
    rough_prolong, rough_restrict : (n, m) sparse, (m, n) sparse
        P and Pᵀ in single precision.
    top : float
        Upper bound of the eigenvalues of diag(A)⁻¹ A.
    spread : float
        Smoothing damps the eigenvalues above top / spread.
    """

    stiffness: sp.csr_array
    mass: sp.csr_array | None
    weights: np.ndarray
    rough: sp.csr_array
    rough_scales: tuple[np.ndarray, np.ndarray]
    prolong: sp.csr_array
    rough_prolong: sp.csr_array
    rough_restrict: sp.csr_array
    top: float
    spread: float

    @property
    def n(self) -> int:
        """Number of points."""
        return int(self.weights.shape[0])


def build_levels(
    stiffness: sp.csr_array,
    mass: sp.csr_array,
    n_coarsest: int,
    dtype: type,
    *,
    smooth: bool = True,
) -> tuple[list[Level], sp.csr_array, sp.csr_array]:
    """Coarsen a pencil with diagonal mass to about `n_coarsest` points; return the levels, and the coarsest A and M.

    `dtype` is the precision of the vectors. Without smoothing, the columns of P are indicators of
    aggregates: inaccurate, but never nearly dependent.
    """
    levels: list[Level] = []
    stiffness, mass = _by_rows(stiffness), _by_rows(mass)
    while stiffness.shape[0] > TOO_LITTLE * n_coarsest:
        n = stiffness.shape[0]
        # The indicators of aggregates, as columns
        ratio = n / n_coarsest
        size = max(round(ratio ** (1 / np.ceil(np.log(ratio) / np.log(LARGEST)))), 2)
        labels, count = grow_aggregates(stiffness.indptr, stiffness.indices, stiffness.data, size)
        columns = sp.csr_array(
            (np.ones(n), labels, np.arange(n + 1, dtype=np.int32)),
            shape=(n, count),
        )
        if n < TOO_LITTLE * columns.shape[1]:
            break
        top = scaled_top(stiffness)
        if smooth:
            columns = _smooth(stiffness, top, columns)
        least, most = LEAST_SPREADS
        least = max(least, min(most, most * MESH_ROW * n / stiffness.nnz))
        up = _by_rows(columns.T)
        energies = up.power(2) @ stiffness.diagonal()
        coarser = _project(up, stiffness, columns), _project(up, mass, columns)
        projected = coarser[0]
        alone = np.flatnonzero(np.diff(projected.indptr) == 1)
        places = projected.indptr[alone]
        rounding = np.abs(projected.data[places]) <= ENERGY_ROUNDING * energies[alone]
        projected.data[places[rounding]] = 0.0

        weights, inverse = mass.diagonal()[:, None], 1 / _positive(stiffness.diagonal())[:, None]
        rough_prolong = _by_rows(columns, np.float32)
        level = Level(
            stiffness=stiffness,
            mass=mass if levels else None,
            weights=weights,
            rough=_by_rows(stiffness, np.float32),
            rough_scales=(weights.astype(np.float32), inverse.astype(np.float32)),
            prolong=rough_prolong if dtype is np.float32 else _by_rows(columns),
            rough_prolong=rough_prolong,
            rough_restrict=_by_rows(up, np.float32),
            top=top,
            spread=max(SMOOTHED * n / columns.shape[1], least),
        )
        levels.append(level)
        stiffness, mass = coarser
    return levels, stiffness, mass


def _smooth(stiffness: sp.csr_array, top: float, columns: sp.csr_array) -> sp.csr_array:
    """Smooth columns by a polynomial in diag(A)⁻¹A that is 1 at 0, so that constants do not change.

    Its zeros are those of a Chebyshev polynomial on the part of the spectrum that contains the
    jumps between aggregates. So the jumps decrease with the degree as fast as possible.
    """
    size = columns.shape[0] / columns.shape[1]
    row = stiffness.nnz / stiffness.shape[0]
    degree = max(round(DEGREE * np.sqrt(size * MESH_ROW / row)), 1)
    low = top / max(size / PASSED, LEAST_RATIO)
    # The rows of 1 - step diag(A)⁻¹ A: the entry of the 1 comes first, then those of A.
    n = stiffness.shape[0]
    rows = np.repeat(np.arange(n), np.diff(stiffness.indptr))
    places = np.arange(len(rows)) + rows + 1
    starts = stiffness.indptr + np.arange(n + 1, dtype=np.int32)
    indices = np.insert(stiffness.indices, stiffness.indptr[:-1], np.arange(n))
    entries = np.ones(len(indices))
    inverse = 1 / _positive(stiffness.diagonal())
    for node in np.cos(np.pi * (2 * np.arange(degree) + 1) / (2 * degree)):
        step = 2 / (top + low + (top - low) * node)
        entries[places] = -(step * inverse)[rows] * stiffness.data
        filtered = sp.csr_array((entries, indices, starts), shape=stiffness.shape)
        columns = _multiply(filtered, columns)
    return _by_rows(columns)


def _project(up: sp.csr_array, matrix: sp.csr_array, down: sp.csr_array) -> sp.csr_array:
    product = _multiply(up, _multiply(matrix, down))
    return _by_rows((product + product.T) * 0.5)


def _multiply(left: sp.csr_array, right: sp.csr_array) -> sp.csr_array:
    """Return the product of two matrices by rows; its rows are not sorted.

    Threads share them. SciPy's product takes one thread, and a pass before it that counts entries.
    """
    one, two = ((each.indptr, each.indices, each.data) for each in (left, right))
    shape = left.shape[0], right.shape[1]

    def fill(share: tuple[int, int]) -> tuple[np.ndarray, ...]:
        return multiply_sparse(one, two, shape[1], *share)

    found = map_in_threads(fill, share_units(shape[0], ROWS_A_THREAD, free_threads()))
    lengths, columns, values = (np.concatenate(each) for each in zip(*found, strict=True))
    starts = np.append(0, np.cumsum(lengths)).astype(np.int32)
    return sp.csr_array((values, columns, starts), shape=shape)


def _by_rows(matrix: sp.sparray, dtype: type = np.float64) -> sp.csr_array:
    """Return a matrix by rows, which are sorted, with indices of 32 bits."""
    rows = sp.csr_array(matrix)
    rows.sort_indices()
    parts = rows.data.astype(dtype, copy=False), rows.indices, rows.indptr
    indices, pointers = (part.astype(np.int32, copy=False) for part in parts[1:])
    return sp.csr_array((parts[0], indices, pointers), shape=rows.shape)


def _positive(diagonal: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return np.where(diagonal > 0, diagonal, 1.0)


def scaled_top(matrix: sp.csr_array) -> float:
    """Bound the eigenvalues of diag(A)⁻¹A, by Gershgorin or by Lanczos (Zhou and others 2006).

    The bound by Lanczos is the largest Ritz value plus the last residual. It is not certain, but
    only the speed of corrections depends on it.
    """
    inverse = 1 / _positive(matrix.diagonal())
    gershgorin, roots = float((inverse * abs(matrix).sum(axis=1)).max()), np.sqrt(inverse)
    value, rest, _ = largest_ritz_value(
        lambda column: roots * (matrix @ (roots * column)), len(roots)
    )
    return min(gershgorin, value + rest) or 1.0
