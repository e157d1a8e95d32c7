"""Compiled loops over clouds: pairs of points within reach, and the triangles around a point.

A loop over pairs visits the cells from `first` to `last` and, for each point of a cell, the runs of points
that may lie within reach. `farthest` is the square of the reach. Points are in the order of cells.
"""

import numpy as np

from eigenshape._compile import njit


@njit
def sort_part(values, start, stop):
    """Sort a part of an array in place, by Shell sort with Knuth's gaps (1973)."""
    gap = 1
    while 3 * gap < stop - start:
        gap = 3 * gap + 1
    while gap:
        for i in range(start + gap, stop):
            value = values[i]
            into = i
            while into >= start + gap and values[into - gap] > value:
                values[into] = values[into - gap]
                into -= gap
            values[into] = value
        gap //= 3


@njit
def _square(one, i, two, j):
    total = 0.0
    for axis in range(one.shape[1]):
        step = one[i, axis] - two[j, axis]
        total += step * step
    return total


@njit
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


@njit(error_model="numpy")
def local_rings(coordinates, rings):
    """Find the neighbors of the origin in the Delaunay triangulation of it and points around it.

    The inversion p -> p / |p|² takes circles through the origin to lines. So a circle through the
    origin and two points is empty if and only if all inverted points lie on one side of a line:
    the ring is the convex hull of the inverted points and the origin.

    `coordinates` are (n, k, 2). Each row of `rings`, (n, k + 1), receives the positions of the
    ring in counter-clockwise order, then -1. A position k stands for the origin itself: it is on
    the hull, and so the ring is open there.
    """
    n, k, _ = coordinates.shape
    x, y = np.empty(k + 1), np.empty(k + 1)
    hull = np.empty(2 * k + 4, dtype=np.int64)
    for i in range(n):
        scale = 0.0
        for j in range(k):
            scale = max(scale, abs(coordinates[i, j, 0]), abs(coordinates[i, j, 1]))
        for j in range(k):
            a, b = coordinates[i, j, 0] / scale, coordinates[i, j, 1] / scale
            square = max(a * a + b * b, 1e-300)
            x[j], y[j] = a / square, b / square
        x[k] = y[k] = 0.0
        order = np.argsort(x)
        # Points at one x are put in the order of y.
        for place in range(1, k + 1):
            at, node = place, order[place]
            while at > 0 and x[order[at - 1]] == x[node] and y[order[at - 1]] > y[node]:
                order[at] = order[at - 1]
                at -= 1
            order[at] = node
        size = 0
        for lower in range(2):
            start = size
            for step in range(k + 1):
                node = order[step] if lower == 0 else order[k - step]
                while size - start >= 2:
                    one, two = hull[size - 2], hull[size - 1]
                    left = (x[two] - x[one]) * (y[node] - y[one])
                    right = (y[two] - y[one]) * (x[node] - x[one])
                    if left > right:
                        break
                    size -= 1
                hull[size] = node
                size += 1
            size -= 1  # the last of each half begins the other
        for j in range(k + 1):
            rings[i, j] = hull[j] if j < size else -1
