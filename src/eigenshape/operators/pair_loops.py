"""Compiled loops over the pairs of points that `cells` finds.

Each walks the cells from `first` to `last`, and for each point of a cell the runs of points that may lie within reach;
`farthest` is the square of the reach. The points stand in the order of the cells.
"""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def _square(points, i, j):
    total = 0.0
    for axis in range(points.shape[1]):
        step = points[i, axis] - points[j, axis]
        total += step * step
    return total


@njit
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


@njit
@no_type_check
def _candidates(points, order, runs, cell):
    """Return what may lie within reach of a cell, by its number before sorting, ascending, and its coordinates."""
    total = 0
    for run in range(runs.shape[1]):
        total += runs[cell, run, 1] - runs[cell, run, 0]
    places = np.empty(total, dtype=np.int64)
    total = 0
    for run in range(runs.shape[1]):
        for j in range(runs[cell, run, 0], runs[cell, run, 1]):
            places[total] = j
            total += 1
    numbers = order[places]
    ascending = np.argsort(numbers)
    return numbers[ascending], points[places[ascending]]


@njit
@no_type_check
def fill(points, order, cells, runs, farthest, weights, rate, starts, columns, values, first, last):
    for cell in range(first, last):
        numbers, near = _candidates(points, order, runs, cell)
        for i in range(cells[cell], cells[cell + 1]):
            row = order[i]
            place = starts[row]
            for candidate in range(len(numbers)):
                square = 0.0
                for axis in range(points.shape[1]):
                    step = points[i, axis] - near[candidate, axis]
                    square += step * step
                if square <= farthest:
                    other = numbers[candidate]
                    columns[place] = other
                    values[place] = weights[row] * weights[other] * np.exp(-rate * square)
                    place += 1


@njit
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
