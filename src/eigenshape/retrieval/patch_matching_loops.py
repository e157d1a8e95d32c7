"""Compiled loops of `patch_matching`: which pairs of matched points keep their distance, and what agrees with most."""

from typing import no_type_check

import numpy as np
from numba import njit

ROUNDS = 20


@njit(cache=True, nogil=True)
@no_type_check
def nearest_of_each_other(apart):
    """Return the rows and columns of entries that are least in both their row and their column."""
    n_rows, n_columns = apart.shape
    of_column = np.empty(n_columns, dtype=np.int64)
    for column in range(n_columns):
        of_column[column] = apart[:, column].argmin()
    rows, columns = np.empty(n_rows, dtype=np.int64), np.empty(n_rows, dtype=np.int64)
    count = 0
    for row in range(n_rows):
        column = apart[row].argmin()
        if of_column[column] == row:
            rows[count], columns[count] = row, column
            count += 1
    return rows[:count], columns[:count]


@njit(cache=True, nogil=True)
@no_type_check
def leading(ours, theirs, shares, ratio, slack, least):
    """Return the largest eigenvalue, and its vector, of how well each two matches agree in their distance.

    `ours` and `theirs` are distances between matched points, `ratio` what the first are multiplied by. Two matches
    agree by 1 - (error / slack)^2, where the error is a share of the longer distance, and count by their shares.
    """
    count = len(ours)
    agreeing = np.zeros((count, count))
    for one in range(count):
        for two in range(one):
            a, b = ratio * ours[one, two], theirs[one, two]
            if np.isinf(a) or np.isinf(b):
                continue
            error = abs(a - b) / max(a, b, least) / slack
            if error < 1:
                agreeing[one, two] = (1 - error * error) * np.sqrt(shares[one] * shares[two])
                agreeing[two, one] = agreeing[one, two]
    vector, value = np.ones(count), 0.0
    for _ in range(ROUNDS):
        image = agreeing @ vector
        value = np.sqrt((image * image).sum())
        if value == 0:
            break
        vector = image / value
    return value, vector
