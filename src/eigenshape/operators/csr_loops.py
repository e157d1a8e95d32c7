"""Compiled loops over sparse matrices by rows; the columns of each row ascend."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def worst_asymmetry(starts, columns, values):
    """Return the largest |M_ij - M_ji| with its i and j, in one pass.

    Rows are visited in order. So the mirror image of an entry of row i in a later row is always the
    next entry there that was not visited, and one number per row has to be stored.
    """
    n = len(starts) - 1
    following = starts[:-1].copy()
    worst, row, column = 0.0, 0, 0
    for i in range(n):
        for entry in range(starts[i], starts[i + 1]):
            j = columns[entry]
            if j <= i:
                if (
                    j < i and entry >= following[i] and abs(values[entry]) > worst
                ):  # it has no mirror image
                    worst, row, column = abs(values[entry]), i, j
                continue
            place = following[j]
            while place < starts[j + 1] and columns[place] < i:
                if abs(values[place]) > worst:
                    worst, row, column = abs(values[place]), j, columns[place]
                place += 1
            mirrored = 0.0
            if place < starts[j + 1] and columns[place] == i:
                mirrored = values[place]
                place += 1
            following[j] = place
            if abs(values[entry] - mirrored) > worst:
                worst, row, column = abs(values[entry] - mirrored), i, j
    return worst, row, column


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
