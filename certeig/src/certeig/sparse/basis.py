"""Tall columns in slots of eight, (s, n, 8): eight numbers of a row are adjacent in memory."""

from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.threads import free_threads, map_in_threads, share_units
from certeig.sparse.basis_loops import (
    CHUNK,
    LANES,
    add_products,
    multiply_lanes,
    subtract_combination,
)

COMBINED_ROWS = 512  # rows of a combination that are computed at once
# Multiplications that are worth a thread: below, starting it costs more than it saves.
FEWEST_MULTIPLICATIONS = 1_000_000
# Rows of a sparse matrix that a thread multiplies at least.
ROWS_A_THREAD = 1024

Slots = Float[np.ndarray, "s n 8"]
Block = Float[np.ndarray, "g n 8"]
# Pointers, indices and entries of a sparse matrix, row by row.
SparseRows: TypeAlias = tuple[Int[np.ndarray, " p"], Int[np.ndarray, " e"], Float[np.ndarray, " e"]]


def pack_columns(columns: Float[np.ndarray, "n k"]) -> Slots:
    """Return columns in slots, the last slot padded with zeros."""
    n, k = columns.shape
    slots = np.zeros((-(-k // LANES), n, LANES))
    for slot, start in zip(slots, range(0, k, LANES), strict=True):
        part = columns[:, start : start + LANES]
        slot[:, : part.shape[1]] = part
    return slots


def products(space: Slots, columns: Block) -> Float[np.ndarray, "m b"]:
    """Return the product spaceᵀ columns."""
    parts = np.zeros((len(columns), len(space) * LANES, LANES))
    slots = _shares(len(space), 1, space.size * len(columns) * LANES)
    map_in_threads(lambda share: add_products(space, columns, parts, *share), slots)
    return np.concatenate(list(parts), axis=1)


def subtract(space: Slots, weights: Float[np.ndarray, "m b"], columns: Block) -> None:
    """Subtract the product of `space` and `weights` from the columns, in place."""
    parts = np.ascontiguousarray(
        weights.reshape(len(weights), len(columns), LANES).transpose(1, 0, 2)
    )
    rows = _shares(space.shape[1], CHUNK, space.size * len(columns) * LANES)
    map_in_threads(lambda share: subtract_combination(space, parts, columns, *share), rows)


def combine_columns(space: Slots, weights: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "n k"]:
    """Return the product of `space` and `weights` as an ordinary matrix."""
    slots, n, _ = space.shape
    result = np.empty((n, weights.shape[1]))

    def fill_rows(share: tuple[int, int]) -> None:
        flat = np.empty((COMBINED_ROWS, slots, LANES))
        for start in range(*share, COMBINED_ROWS):
            count = min(COMBINED_ROWS, share[1] - start)
            flat[:count] = space[:, start : start + count].transpose(1, 0, 2)
            rows = flat[:count].reshape(count, slots * LANES)
            np.matmul(rows, weights, out=result[start : start + count])

    map_in_threads(fill_rows, _shares(n, COMBINED_ROWS, space.size * weights.shape[1]))
    return result


def sparse_rows(symmetric: sp.csr_array | sp.csc_array) -> SparseRows:
    """Return the rows of a symmetric matrix, which are its columns, as kernels take them."""
    indices = symmetric.indices.astype(np.int32, copy=False)
    return symmetric.indptr.astype(np.int64), indices, symmetric.data


def multiply(
    matrix: SparseRows,
    given: Float[np.ndarray, "n 8"],
    out: Float[np.ndarray, "n 8"],
    *,
    factor: float = 1.0,
    before: Float[np.ndarray, "n 8"] | None = None,
) -> None:
    """Fill `out` with factor A given, less what was `before`, which `out` may be."""
    share, subtracted = (0.0, given) if before is None else (1.0, before)
    rows = _shares(len(given), ROWS_A_THREAD, len(matrix[1]) * LANES)
    map_in_threads(
        lambda part: multiply_lanes(matrix, given, subtracted, factor, share, *part, out), rows
    )


def _shares(size: int, unit: int, multiplications: int) -> list[tuple[int, int]]:
    """Divide slots or rows among as many threads as the work is worth."""
    worth = max(multiplications // FEWEST_MULTIPLICATIONS, 1)
    return share_units(size, unit, min(free_threads(), worth))
