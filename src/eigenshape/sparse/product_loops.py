"""Compiled loop of products of a sparse matrix and columns that are packed by eight."""

from typing import no_type_check

from eigenshape._compile import njit
from eigenshape.sparse.lane_loops import LANES, write_row_product


@njit
@no_type_check
def multiply_rows(matrix, given, before, factor, share, begin, end, out):
    """Fill rows begin to end - 1 of `out` with factor A given - share before.

    The matrix A is given by int64 pointers, int32 indices and entries. The columns have shape (n,
    LANES); `out` may be `before`.
    """
    pointers, indices, entries = matrix
    row = given[:1].copy()
    for i in range(begin, end):
        write_row_product(entries, indices, pointers[i], pointers[i + 1], given, row, 0)
        for lane in range(LANES):
            out[i, lane] = factor * row[0, lane] - share * before[i, lane]
