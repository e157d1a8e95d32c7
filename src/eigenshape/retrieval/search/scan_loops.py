"""Compiled loop of `coarse`: one pass over the short rows of all shapes."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def scan(query, rows, unit, price, found):
    """Write 1 - the best mean cosine over relative sizes, of one query with each shape.

    `query` is (s, d) int16 and `rows` (n, s, d) int8; `unit` is the mean cosine of a product of 1.
    """
    n_sizes = len(query)
    for place in range(len(rows)):
        best = -np.inf
        for step in range(1 - n_sizes, n_sizes):
            ours, theirs = query[max(-step, 0)], rows[place, max(step, 0)]
            total = np.int32(0)
            for number in range(len(ours)):
                total += np.int32(ours[number]) * np.int32(np.int16(theirs[number]))
            best = max(best, unit * np.float64(np.int32(total)) - price * abs(step))
        found[place] = 1.0 - best
