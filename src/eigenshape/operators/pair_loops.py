"""Compiled loops over the pairs of points that `cells` finds.

Each walks the cells from `first` to `last`, and for each point of a cell the runs of points that may lie within reach;
`farthest` is the square of the reach. The points stand in the order of the cells.
"""

from typing import no_type_check

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
@no_type_check
def _square(points, i, j):
    total = 0.0
    for axis in range(points.shape[1]):
        step = points[i, axis] - points[j, axis]
        total += step * step
    return total


@njit(cache=True, nogil=True)
@no_type_check
def count(points, order, cells, runs, farthest, wanted, counts, first, last):
    for cell in range(first, last):
        for i in range(cells[cell], cells[cell + 1]):
            if not wanted[order[i]]:
                continue
            found = 0
            for run in range(runs.shape[1]):
                for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                    found += _square(points, i, j) <= farthest
            counts[order[i]] = found


@njit(cache=True, nogil=True)
@no_type_check
def fill(points, order, back, cells, runs, farthest, weights, rate, starts, columns, values, first, last):
    for cell in range(first, last):
        for i in range(cells[cell], cells[cell + 1]):
            row = order[i]
            place = starts[row]
            for run in range(runs.shape[1]):
                for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                    if _square(points, i, j) <= farthest:
                        columns[place] = order[j]
                        place += 1
            columns[starts[row] : place].sort()
            for entry in range(starts[row], place):
                other = columns[entry]
                values[entry] = weights[row] * weights[other] * np.exp(-rate * _square(points, i, back[other]))


@njit(cache=True, nogil=True)
@no_type_check
def difference(points, cells, runs, farthest, weights, rate, values, sums, first, last):
    for cell in range(first, last):
        for i in range(cells[cell], cells[cell + 1]):
            sums[i] = 0.0
            for run in range(runs.shape[1]):
                for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                    square = _square(points, i, j)
                    if square <= farthest:
                        pair = weights[i] * weights[j] * np.exp(-rate * square)
                        for b in range(values.shape[1]):
                            sums[i, b] += pair * (values[i, b] - values[j, b])
