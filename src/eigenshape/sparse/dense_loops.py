"""Compiled loops of `front_loops`: the first columns of one dense front, eliminated; on and below the diagonal."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit
from eigenshape.sparse.blas_loops import solve_triangle, subtract_product

NARROW = 16  # columns that are eliminated one by one
TALL = 96  # rows of an update at once
LONG = 256  # terms of a sum in one product: shorter sums round less


@njit
@no_type_check
def eliminate_plain(front, width, pivots):
    """Eliminate the first columns one by one; say whether all pivots served."""
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
    """Eliminate by halves: products of matrices take the left half of some columns out of the right half.

    After every NARROW columns those of the largest power of two that has just been filled update as many that follow,
    which is the order of the recursion. L D goes into `times`.
    """
    height = len(front)
    for start in range(0, width, NARROW):
        end = min(start + NARROW, width)
        if not _eliminate_narrow(front, start, end, pivots, times, blas[1]):
            return False
        done = (end + NARROW - 1) // NARROW
        span = (done & -done) * NARROW
        if end < width:
            _update(front, times, max(end - span, 0), end, min(end + span, width), blas[0])
    if width < height:
        zero = np.int64(
            0
        )  # a literal 0 would be another type, for which `_update` is compiled again
        _update(front, times, zero, width, height, blas[0])
    return True


@njit
@no_type_check
def _eliminate_narrow(front, start, end, pivots, times, trsm):
    """Eliminate a few columns, all rows; those to the right are left as they are."""
    height = len(front)
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
    for i in range(end, height):
        for j in range(start, end):
            times[i, j] = front[i, j]
    rest, wide = height - end, times.shape[1]
    solve_triangle(
        trsm, (rest, end - start), front, start * height + start, times, end * wide + start
    )
    for i in range(end, height):
        for j in range(start, end):
            front[i, j] = times[i, j] / pivots[j]
    return True


@njit
@no_type_check
def _update(front, times, start, end, stop, gemm):
    """Take what the columns from start to end contribute out of those from end to stop, on and below the diagonal."""
    height, wide = len(front), times.shape[1]
    for low in range(end, height, TALL):
        high = min(low + TALL, height)
        for term in range(start, end, LONG):
            size = (high - low, min(high, stop) - end, min(term + LONG, end) - term)
            left, right = low * wide + term, end * height + term
            subtract_product(gemm, size, times, left, front, right, front, low * height + end)
