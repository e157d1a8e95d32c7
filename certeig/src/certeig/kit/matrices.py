"""Checks of sparse matrices, and read-only copies."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import as_array, freeze, require_no_mask
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike

# Largest difference of W_ij and W_ji, relative to the largest entry, that is accepted as rounding.
ASYMMETRY = 1e-12
# Row sums up to this share of the absolute row sums count as zero: those of stiffness matrices are
# zero up to the rounding of their entries.
ZERO_ROW_SUM = 1e-12


def freeze_sparse(matrix: sp.csr_array) -> sp.csr_array:
    """Return a copy with sorted indices whose arrays are read-only."""
    copy = matrix.copy()
    copy.sum_duplicates()  # sorts, too: SciPy would do so later in place, where it no longer can
    for part in (copy.data, copy.indices, copy.indptr):
        part.flags.writeable = False
    return copy


def require_square(matrix: Any, name: str, wanted: str = "a square sparse matrix") -> None:
    """Raise an error if a value is not a square sparse matrix with rows."""
    shape = np.shape(matrix)
    if not sp.issparse(matrix) or len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise InvalidParameterError(
            f"{name} must be {wanted}; it is a {type(matrix).__name__} of shape {shape}."
        )


def as_symmetric(name: str, value: Any) -> sp.csr_array:
    """Return a read-only copy of a matrix, or raise an error if it is not finite and symmetric."""
    require_square(value, name)
    if value.dtype.kind not in "biuf":
        raise InvalidParameterError(
            f"{name} must be real; the type of its entries is {value.dtype}. Pass its real part, or the real matrix "
            f"[[Re, -Im], [Im, Re]] of a Hermitian one, which has each eigenvalue twice."
        )
    matrix = freeze_sparse(sp.csr_array(value, dtype=np.float64))
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        entries = matrix.tocoo()
        row, column = entries.row[bad[0]], entries.col[bad[0]]
        raise InvalidParameterError(
            f"{name} must be finite; entry ({row}, {column}) is {entries.data[bad[0]]} ({bad.size} such)."
        )
    differences = abs(matrix - matrix.T).tocoo()
    worst = differences.data.argmax() if differences.nnz else 0
    if differences.nnz and differences.data[worst] > ASYMMETRY * abs(matrix.data).max():
        row, column = differences.row[worst], differences.col[worst]
        raise InvalidParameterError(
            f"{name} must be symmetric; entry ({row}, {column}) is {matrix[row, column]} "
            f"and entry ({column}, {row}) is {matrix[column, row]}."
        )
    return matrix


def require_points(fixed: ArrayLike, n_points: int, noun: str = "point") -> Int[np.ndarray, " c"]:
    """Return `fixed` as an array of points, in its order and with its duplicates; `noun` is what messages call one.

    Raise InvalidParameterError if an entry is no such number, or out of range.
    """
    points = np.atleast_1d(as_array(fixed, "fixed"))
    if points.size and points.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"fixed must be a list of {noun} numbers; the type of its entries is {points.dtype}. "
            f"Pass np.flatnonzero(mask) for a mask."
        )
    bad = np.flatnonzero((points < 0) | (points >= n_points))
    if bad.size:
        raise InvalidParameterError(
            f"fixed must hold {noun}s 0..{n_points - 1}; entry {bad[0]} is {points[bad[0]]}."
        )
    require_no_mask(points.ravel(), "fixed", n_points)
    return points.astype(np.int64)


def find_zero_row_sums(matrix: sp.sparray) -> Bool[np.ndarray, " n"]:
    """Return for each row whether it sums to zero, up to rounding.

    Constants on a component have no energy if all its rows do. Each row is compared with its own
    entries: beside one stiff edge, the rows at a fixed boundary are small and not zero.
    """
    sums, sizes = np.abs(matrix.sum(axis=1)), abs(matrix).sum(axis=1)
    return sums <= ZERO_ROW_SUM * sizes


def on_all_rows(
    vectors: Float[np.ndarray, "f k"], free: Int[np.ndarray, " f"], n: int
) -> Float[np.ndarray, "n k"]:
    """Extend vectors on the free rows by zeros at the fixed ones; the result is read-only."""
    every = np.zeros((n, vectors.shape[1]))
    every[free] = vectors
    return freeze(every)
