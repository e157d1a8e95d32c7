"""Compiled loops of `coarse_space` and `coarse_refinement`: aggregates, their smoothed indicators, and their images."""

from typing import no_type_check

import numpy as np
from numba import njit

RELAXED = {"reassoc", "contract"}  # sums in any order: that of the lanes


@njit(cache=True, nogil=True)
@no_type_check
def grow_patches(starts, columns, weights, most):
    """Label points by patches, each grown around a first one ring by ring until its weight is `most`; count them.

    Points without weight belong to none, and have the label -1.
    """
    n = len(starts) - 1
    labels, members = np.full(n, -1, dtype=np.int32), np.empty(n, dtype=np.int32)
    count = 0
    for first in range(n):
        if labels[first] >= 0 or not weights[first]:
            continue
        labels[first] = count
        members[0] = first
        weight, height, at = weights[first], 1, 0
        while at < height and weight < most:
            i = members[at]
            at += 1
            for entry in range(starts[i], starts[i + 1]):
                j = columns[entry]
                if labels[j] < 0 and weights[j] and weight < most:
                    labels[j] = count
                    members[height] = j
                    weight += weights[j]
                    height += 1
        count += 1
    return labels, count


@njit(cache=True, nogil=True)
@no_type_check
def join_fragments(starts, columns, weights, labels, count, least):
    """Give the points of patches lighter than `least` to heavier neighbours, where there are; renumber, and count."""
    sizes = np.zeros(count)
    for i in range(len(labels)):
        if labels[i] >= 0:
            sizes[labels[i]] += weights[i]
    moved = True
    while moved:
        moved = False
        for i in range(len(labels)):
            if labels[i] < 0 or sizes[labels[i]] >= least:
                continue
            for entry in range(starts[i], starts[i + 1]):
                other = labels[columns[entry]]
                if other >= 0 and sizes[other] >= least:
                    labels[i] = other
                    moved = True
                    break
    numbers = np.full(count, -1, dtype=np.int32)
    left = 0
    for i in range(len(labels)):
        if labels[i] < 0:
            continue
        if numbers[labels[i]] < 0:
            numbers[labels[i]] = left
            left += 1
        labels[i] = numbers[labels[i]]
    return left


@njit(cache=True, nogil=True)
@no_type_check
def smooth_indicators(matrix, inverse, member_starts, members, steps):
    """Return the columns Π (1 - step D⁻¹A) of the patches' indicators: where each starts, its rows, its values.

    Each column is computed where it is not zero: a patch and one ring more for each step.
    """
    starts, columns, values = matrix
    n, count = len(starts) - 1, len(member_starts) - 1
    column, image = np.zeros(n), np.zeros(n)
    inside, active = np.zeros(n, dtype=np.bool_), np.empty(n, dtype=np.int32)
    rows, found = np.empty(12 * n, dtype=np.int32), np.empty(12 * n)
    first = np.zeros(count + 1, dtype=np.int64)
    total = 0
    for patch in range(count):
        height = 0
        for member in range(member_starts[patch], member_starts[patch + 1]):
            i = members[member]
            active[height] = i
            height += 1
            inside[i] = True
            column[i] = 1.0
        ring = 0
        for step in steps:
            end = height
            for place in range(ring, end):
                for entry in range(starts[active[place]], starts[active[place] + 1]):
                    j = columns[entry]
                    if not inside[j]:
                        inside[j] = True
                        active[height] = j
                        height += 1
            ring = end
            for place in range(height):
                i = active[place]
                total_here = 0.0
                for entry in range(starts[i], starts[i + 1]):
                    total_here += values[entry] * column[columns[entry]]
                image[i] = total_here * inverse[i]
            for place in range(height):
                column[active[place]] -= step * image[active[place]]
        if total + height > len(rows):
            rows, found = np.append(rows, np.empty_like(rows)), np.append(found, np.empty_like(found))
        for place in range(height):
            i = active[place]
            rows[total], found[total] = i, column[i]
            total += 1
            column[i] = 0.0
            inside[i] = False
        first[patch + 1] = total
    return first, rows[:total].copy(), found[:total].copy()


@njit(cache=True, nogil=True, fastmath=RELAXED)
@no_type_check
def multiply_rows(matrix, block, first, product):
    """Write rows `first` and following of a sparse matrix times a block of columns."""
    starts, columns, values = matrix
    width = block.shape[1]
    for row in range(len(product)):
        for c in range(width):
            product[row, c] = 0
        for entry in range(starts[first + row], starts[first + row + 1]):
            value, j = values[entry], columns[entry]
            for c in range(width):
                product[row, c] += value * block[j, c]


@njit(cache=True, nogil=True, fastmath=RELAXED)
@no_type_check
def apply_rows(matrix, rests, block, first, product):
    """Write rows `first` and following of A times a block, as Σ a_ij (x_j - x_i) + rest_i x_i.

    `rests` are the sums of the rows. In this form constants have no rounding in single precision either.
    """
    starts, columns, values = matrix
    width = block.shape[1]
    for row in range(len(product)):
        i = first + row
        for c in range(width):
            product[row, c] = rests[i] * block[i, c]
        for entry in range(starts[i], starts[i + 1]):
            value, j = values[entry], columns[entry]
            for c in range(width):
                product[row, c] += value * (block[j, c] - block[i, c])


@njit(cache=True, nogil=True, fastmath=RELAXED)
@no_type_check
def smoothing_step(matrix, diagonals, shifts, old, step, new, factors):
    """Write the next step of Chebyshev iteration for (A - θM) x = 0, and new = old + step.

    step = a step - b D⁻¹ (A - θM) old, with (a, b) = `factors`; `diagonals` are the sums of A's rows, M and D⁻¹.
    """
    starts, columns, values = matrix
    rests, mass, inverse = diagonals
    width = old.shape[1]
    image = np.empty(width, dtype=old.dtype)
    for i in range(len(starts) - 1):
        for c in range(width):
            image[c] = (rests[i] - mass[i] * shifts[c]) * old[i, c]
        for entry in range(starts[i], starts[i + 1]):
            value, j = values[entry], columns[entry]
            for c in range(width):
                image[c] += value * (old[j, c] - old[i, c])
        factor = inverse[i] * factors[1]
        for c in range(width):
            step[i, c] = factors[0] * step[i, c] - factor * image[c]
            new[i, c] = old[i, c] + step[i, c]
