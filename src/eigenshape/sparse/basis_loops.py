"""Compiled loops of products with tall blocks whose columns are packed by eight."""

from eigenshape._compile import njit
from eigenshape.sparse.lane_loops import (
    AHEAD,
    LANES,
    add_eight_sums,
    fetch_row,
    subtract_four_sums,
    subtract_sum,
    write_row_product,
)

CHUNK = 4096  # rows of a block that take a quarter of the second-level cache


@njit
def add_products(space, columns, parts, begin, end):
    """Add the rows of the product spaceᵀ columns that belong to slots begin to end - 1 to `parts`.

    The shapes are (s, n, LANES), (g, n, LANES) and (g, s LANES, LANES).
    """
    slots, n, _ = space.shape
    groups = len(columns)
    for start in range(0, n, CHUNK):
        count = min(CHUNK, n - start)
        for slot in range(begin, end):
            for group in range(groups):
                add_eight_sums(
                    space,
                    (slot * n + start) * LANES,
                    LANES,
                    1,
                    columns,
                    group * n + start,
                    count,
                    parts,
                    (group * slots + slot) * LANES,
                )


@njit
def subtract_combination(space, parts, columns, begin, end):
    """Subtract the product of `space` and `parts` from rows begin to end - 1 of the columns.

    The shapes are as in `add_products`.
    """
    slots, n, _ = space.shape
    groups = len(columns)
    for start in range(begin, end, CHUNK):
        stop = min(start + CHUNK, end)
        four = start + (stop - start) // 4 * 4
        for slot in range(slots):
            for row in range(start, four, 4):
                place = slot * n + row
                for ahead in range(AHEAD, AHEAD + 4):
                    fetch_row(space, place + ahead)
                for group in range(groups):
                    given, to = (group * slots + slot) * LANES, group * n + row
                    subtract_four_sums(
                        space, place * LANES, 1, LANES, parts, given, LANES, columns, to
                    )
            for row in range(four, stop):
                place = slot * n + row
                for group in range(groups):
                    given, to = (group * slots + slot) * LANES, group * n + row
                    subtract_sum(space, place * LANES, 1, 0, parts, given, LANES, columns, to)


@njit
def multiply_lanes(matrix, given, before, factor, share, begin, end, out):
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
