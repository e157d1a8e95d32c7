"""Compiled loop over the rows of a sparse matrix."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


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
