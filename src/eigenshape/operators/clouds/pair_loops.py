"""Compiled loops over the pairs of points that `cells` finds.

Each loop visits the cells from `first` to `last` and, for each point of a cell, the runs of points
that may lie within reach. `farthest` is the square of the reach. Points are in the order of cells.
"""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit
from eigenshape.sparse.sort_loops import sort_part


@njit
@no_type_check
def _square(one, i, two, j):
    total = 0.0
    for axis in range(one.shape[1]):
        step = one[i, axis] - two[j, axis]
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
                    found += _square(points, i, points, j) <= farthest
            counts[order[i]] = found


@njit
@no_type_check
def fill(
    points,
    order,
    cells,
    runs,
    farthest,
    place,
    weights,
    rate,
    starts,
    columns,
    values,
    numbers,
    near,
    first,
    last,
):
    """Fill the columns and values of the rows of some cells.

    `numbers` and `near` are scratch, with one entry for each point that a cell may reach.
    """
    for cell in range(first, last):
        # The numbers of points that may lie within reach, before they were sorted into cells,
        # ascending. `place` is the inverse of `order`.
        total = 0
        for run in range(runs.shape[1]):
            for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                numbers[total] = order[j]
                total += 1
        sort_part(numbers, 0, total)
        for candidate in range(total):
            for axis in range(points.shape[1]):
                near[candidate, axis] = points[place[numbers[candidate]], axis]
        for i in range(cells[cell], cells[cell + 1]):
            row = order[i]
            entry = starts[row]
            for candidate in range(total):
                square = _square(points, i, near, candidate)
                if square <= farthest:
                    other = numbers[candidate]
                    columns[entry] = other
                    values[entry] = weights[row] * weights[other] * np.exp(-rate * square)
                    entry += 1


@njit
@no_type_check
def difference(points, cells, runs, farthest, weights, rate, values, sums, first, last):
    for cell in range(first, last):
        for i in range(cells[cell], cells[cell + 1]):
            sums[i] = 0.0
            for run in range(runs.shape[1]):
                for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                    square = _square(points, i, points, j)
                    if square <= farthest:
                        pair = weights[i] * weights[j] * np.exp(-rate * square)
                        for b in range(values.shape[1]):
                            sums[i, b] += pair * (values[i, b] - values[j, b])


@njit
@no_type_check
def component_labels(starts, columns):
    """Return the connected component of each row; components are numbered by their first rows."""
    n = len(starts) - 1
    labels = np.full(n, -1)
    stack = np.empty(n, dtype=np.int64)
    n_components = 0
    for first in range(n):
        if labels[first] >= 0:
            continue
        labels[first] = n_components
        stack[0] = first
        height = 1
        while height:
            height -= 1
            row = stack[height]
            for entry in range(starts[row], starts[row + 1]):
                other = columns[entry]
                if labels[other] < 0:
                    labels[other] = n_components
                    stack[height] = other
                    height += 1
        n_components += 1
    return labels
