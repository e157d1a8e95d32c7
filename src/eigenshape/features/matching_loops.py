"""Compiled loops of a maximum matching (Hopcroft and Karp 1973)."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def match_rows(starts, columns, n_columns, first):
    """Match as many rows as can be with a column each; entries `starts[i]` to `starts[i + 1]` are those of row i.

    `first` is a matching to begin with, the column of each row, or -1. Returned are that of the largest matching, and
    where a row is without column a depth ≥ 0 for the rows that alternating paths reach from such: these are more than
    the columns that they may have (Hall 1935).
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
@no_type_check
def _layer(starts, columns, row_of, column_of, depth, queue):
    """Count for each row the steps from a free one along alternating paths; whether a free column is reached."""
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
@no_type_check
def _augment(free, columns, starts, row_of, column_of, depth, following, path):
    """Walk down the layers from a free row to a free column, and turn the path over."""
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
