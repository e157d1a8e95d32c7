"""Compiled loops of union-find: components that form as points or edges enter in a given order."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def join_points(starts, neighbors, order):
    """Add points in the given order, and join each to its neighbors that are already there.

    Returns the first point of each point's component and, for each component that was joined to an
    earlier one, its first point and the point that joined them.
    """
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    root = np.arange(n)
    ended = np.empty((n, 2), dtype=np.int64)
    n_ended = 0
    for point in order:
        for entry in range(starts[point], starts[point + 1]):
            if place[neighbors[entry]] >= place[point]:
                continue
            one, two = find_root(root, point), find_root(root, neighbors[entry])
            if one == two:
                continue
            if place[one] < place[two]:
                one, two = two, one
            root[one] = two
            if one != point:
                ended[n_ended, 0], ended[n_ended, 1] = one, point
                n_ended += 1
    for point in order:
        root[point] = root[root[point]]
    return root, ended[:n_ended].copy()


@njit
@no_type_check
def spanning_forest(ends, order, n):
    """Return, for each edge, whether it joins two components when edges are added in order."""
    root = np.arange(n)
    joins = np.zeros(len(ends), dtype=np.bool_)
    for edge in order:
        one, two = find_root(root, ends[edge, 0]), find_root(root, ends[edge, 1])
        if one != two:
            root[max(one, two)] = min(one, two)
            joins[edge] = True
    return joins


@njit
@no_type_check
def find_root(root, point):
    """Return the root of a point's tree, with path halving (Tarjan and van Leeuwen 1984)."""
    while root[point] != point:
        root[point] = root[root[point]]
        point = root[point]
    return point
