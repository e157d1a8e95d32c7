"""Compiled loops of a maximum matching (Hopcroft and Karp 1973)."""

import numpy as np

from eigenshape._compile import njit


@njit
def match_rows(starts, columns, n_columns, first):
    """Match as many rows as possible with a column each.

    The columns of row i are columns[starts[i]:starts[i + 1]]. `first` is a matching to start from:
    the column of each row, or -1. Returns the column of each row in a largest matching, and a depth
    for each row. If a row has no column, depths ≥ 0 mark the rows that alternating paths reach from
    such rows. These rows are more than the columns in their entries, which proves that no matching
    is larger (Hall 1935).
    """
    n = len(starts) - 1
    row_of, column_of = np.full(n_columns, -1), first.copy()
    depth, following = np.full(n, -1), np.empty(n, dtype=np.int64)
    queue, path = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    n_matched = 0
    for row in range(n):
        if column_of[row] >= 0:
            row_of[column_of[row]] = row
            n_matched += 1
    while n_matched < n and _layer(starts, columns, row_of, column_of, depth, queue):
        following[:] = starts[:-1]
        for row in range(n):
            if column_of[row] < 0 and _augment(
                row, columns, starts, row_of, column_of, depth, following, path
            ):
                n_matched += 1
    return column_of, depth


@njit
def _layer(starts, columns, row_of, column_of, depth, queue):
    """Fill the distance of each row from a free row; return whether a free column is reached.

    Distances are steps along alternating paths.
    """
    height = 0
    for row in range(len(depth)):
        depth[row] = -1
        if column_of[row] < 0:
            depth[row] = 0
            queue[height] = row
            height += 1
    place, last = 0, -1
    while place < height:
        row = queue[place]
        place += 1
        if depth[row] == last:
            break
        for entry in range(starts[row], starts[row + 1]):
            other = row_of[columns[entry]]
            if other < 0:
                last = depth[row] + 1
            elif depth[other] < 0:
                depth[other] = depth[row] + 1
                queue[height] = other
                height += 1
    return last >= 0


@njit
def _augment(free, columns, starts, row_of, column_of, depth, following, path):
    """Find a path through the layers from a free row to a free column, and flip its edges."""
    height = 1
    path[0] = free
    while height:
        row = path[height - 1]
        if following[row] == starts[row + 1]:
            height -= 1
            if height:
                following[path[height - 1]] += 1
            continue
        other = row_of[columns[following[row]]]
        if other < 0:
            for step in range(height - 1, -1, -1):
                column = columns[following[path[step]]]
                row_of[column], column_of[path[step]] = path[step], column
                following[path[step]] += 1
            return True
        if depth[other] == depth[row] + 1:
            path[height] = other
            height += 1
        else:
            following[row] += 1
    return False
