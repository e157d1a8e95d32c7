"""Compiled loops of `front_loops`: eliminate the first columns of one dense front.

Only entries on and below the diagonal are used.
"""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit
from eigenshape.sparse.blas_loops import solve_triangle, subtract_product

NARROW = 16  # columns that are eliminated one by one
TALL = 96  # rows that are updated at once
LONG = 256  # terms of a sum in one product: shorter sums have less rounding error


@njit
@no_type_check
def eliminate_plain(front, width, pivots):
    """Eliminate the first columns one by one; return whether all pivots are finite and not zero."""
    height = len(front)
    for j in range(width):
        pivot = front[j, j]
        if pivot == 0 or not np.isfinite(pivot):
            return False
        pivots[j] = pivot
        front[j, j] = 1.0
        for i in range(j + 1, height):
            share = front[i, j] / pivot
            if share != 0:
                for k in range(j + 1, i + 1):
                    front[i, k] -= share * front[k, j]
        for i in range(j + 1, height):
            front[i, j] /= pivot
    return True


@njit
@no_type_check
def eliminate_blocked(front, width, pivots, times, blas):
    """Eliminate the first columns by recursive halving, so that most work is in matrix products.

    The left half of a block of columns is eliminated, then updates the right half by a product.
    This loop does so in the order of the recursion: after every NARROW columns, the largest block
    of 2^k NARROW columns that is complete updates as many columns after it. At the end all columns
    update the rest of the front. L D is written to `times`.
    """
    height, wide = len(front), times.shape[1]
    gemm, trsm = blas
    for start in range(0, width, NARROW):
        end = min(start + NARROW, width)
        # The triangular block on the diagonal, column by column.
        for j in range(start, end):
            pivot = front[j, j]
            if pivot == 0 or not np.isfinite(pivot):
                return False
            pivots[j] = pivot
            front[j, j] = 1.0
            for i in range(j + 1, end):
                times[i, j] = front[i, j]
                front[i, j] /= pivot
                for k in range(j + 1, i + 1):
                    front[i, k] -= times[i, j] * front[k, j]
        # The rows below the triangle.
        for i in range(end, height):
            for j in range(start, end):
                times[i, j] = front[i, j]
        size, corner = (height - end, end - start), start * height + start
        solve_triangle(trsm, size, front, corner, times, end * wide + start)
        for i in range(end, height):
            for j in range(start, end):
                front[i, j] = times[i, j] / pivots[j]
        # Update the columns to the right, on and below the diagonal.
        first, stop = 0, height
        if end < width:
            done = (end + NARROW - 1) // NARROW
            span = (done & -done) * NARROW
            first, stop = max(end - span, 0), min(end + span, width)
        for low in range(end, height, TALL):
            high = min(low + TALL, height)
            for term in range(first, end, LONG):
                size = (high - low, min(high, stop) - end, min(term + LONG, end) - term)
                left, right = low * wide + term, end * height + term
                subtract_product(gemm, size, times, left, front, right, front, low * height + end)
    return True
