"""Compiled loops of `front_loops`: eliminate the first columns of one dense front.

Only entries on and below the diagonal are used.
"""

import numpy as np

from eigenshape._compile import njit
from eigenshape.sparse.blas_loops import solve_triangle, subtract_product

NARROW = 16  # columns that are eliminated one by one
TALL = 96  # rows that are updated at once
LONG = 256  # terms of a sum in one product: shorter sums have less rounding error


@njit
def eliminate_plain(front, height, width, pivots, low):
    """Eliminate the first columns one by one; return whether all pivots are finite and not zero.

    The front is flat, row by row. Its pivots go to pivots[low:low + width].
    """
    for j in range(width):
        corner = j * height + j
        pivot = front[corner]
        if not 0.0 < abs(pivot) < np.inf:
            return False
        pivots[low + j] = pivot
        front[corner] = 1.0
        for i in range(j + 1, height):
            row = i * height
            share = front[row + j] / pivot
            if share != 0:
                for k in range(j + 1, i + 1):
                    front[row + k] -= share * front[k * height + j]
        for i in range(j + 1, height):
            front[i * height + j] /= pivot
    return True


@njit
def eliminate_blocked(front, height, width, pivots, low, times, blas):
    """Eliminate the first columns by recursive halving, so that most work is in matrix products.

    The left half of a block of columns is eliminated, then updates the right half by a product.
    This loop does so in the order of the recursion: after every NARROW columns, the largest block
    of 2^k NARROW columns that is complete updates as many columns after it. At the end all columns
    update the rest of the front. L D is written to `times`, row by row. The other arguments, and what is
    returned, are those of `eliminate_plain`.
    """
    for start in range(0, width, NARROW):
        end = min(start + NARROW, width)
        # The triangular block on the diagonal, column by column.
        for j in range(start, end):
            corner = j * height + j
            pivot = front[corner]
            if not 0.0 < abs(pivot) < np.inf:
                return False
            pivots[low + j] = pivot
            front[corner] = 1.0
            for i in range(j + 1, end):
                row = i * height
                share = front[row + j]
                times[i * width + j] = share
                front[row + j] = share / pivot
                for k in range(j + 1, i + 1):
                    front[row + k] -= share * front[k * height + j]
        # The rows below the triangle.
        for i in range(end, height):
            for j in range(start, end):
                times[i * width + j] = front[i * height + j]
        size, corner = (height - end, end - start), start * height + start
        solve_triangle(blas[1], size, front, corner, height, times, end * width + start, width)
        for i in range(end, height):
            for j in range(start, end):
                front[i * height + j] = times[i * width + j] / pivots[low + j]
        first, last = 0, height
        if end < width:
            done = (end + NARROW - 1) // NARROW
            span = (done & -done) * NARROW
            first, last = max(end - span, 0), min(end + span, width)
        for top in range(end, height, TALL):
            bottom = min(top + TALL, height)
            for term in range(first, end, LONG):
                # On and below the diagonal.
                size = (bottom - top, min(bottom, last) - end, min(term + LONG, end) - term)
                left, right, taken = top * width + term, end * height + term, top * height + end
                subtract_product(
                    blas[0], size, times, left, width, front, right, height, front, taken, height
                )
    return True
