"""Compiled loops of `aggregation` and `vcycle`: aggregates, sparse products, and smoothing."""

import numpy as np

from eigenshape._compile import njit

STRONG = 0.25  # share of a row's strongest coupling below which points do not count as neighbors
FRAGMENT = 0.25  # share of the target size below which an aggregate is split among its neighbors


@njit
def grow_aggregates(starts, columns, values, size):
    """Label points by aggregates of about `size` points; return the labels and their number.

    Aggregates grow along strong negative couplings.
    """
    n = len(starts) - 1
    labels, strongest = np.full(n, -1, dtype=np.int32), np.zeros(n)
    for i in range(n):
        for entry in range(starts[i], starts[i + 1]):
            if columns[entry] != i and -values[entry] > strongest[i]:
                strongest[i] = -values[entry]
    members, counts = np.empty(size, dtype=np.int64), np.zeros(n, dtype=np.int64)
    n_aggregates = 0
    for first in range(n):
        if labels[first] >= 0:
            continue
        labels[first] = n_aggregates
        members[0] = first
        height, at = 1, 0
        while at < height < size:
            i = members[at]
            best, chosen = STRONG * strongest[i], -1
            for entry in range(starts[i], starts[i + 1]):
                if labels[columns[entry]] < 0 and -values[entry] > best:
                    best, chosen = -values[entry], columns[entry]
            if chosen < 0:
                at += 1
                continue
            labels[chosen] = n_aggregates
            members[height] = chosen
            height += 1
        counts[n_aggregates] = height
        n_aggregates += 1
    return _join_fragments(starts, columns, values, labels, counts[:n_aggregates], FRAGMENT * size)


@njit
def _join_fragments(starts, columns, values, labels, counts, least):
    """Move each point of a fragment to its most strongly coupled aggregate; renumber the others."""
    for i in range(len(labels)):
        if counts[labels[i]] >= least:
            continue
        best, chosen = 0.0, -1
        for entry in range(starts[i], starts[i + 1]):
            other = labels[columns[entry]]
            if counts[other] >= least and -values[entry] > best:
                best, chosen = -values[entry], other
        if chosen >= 0:
            labels[i] = chosen
    numbers = np.full(len(counts), -1, dtype=np.int32)
    n_left = 0
    for i in range(len(labels)):
        if numbers[labels[i]] < 0:
            numbers[labels[i]] = n_left
            n_left += 1
        labels[i] = numbers[labels[i]]
    return labels, n_left


@njit
def multiply_sparse(left, right, n_columns, begin, end):
    """Return rows begin to end - 1 of the product of two matrices by rows: their lengths, columns and values.

    Columns of a row come in any order, and in a row of `left` several times if need be.
    """
    (starts, columns, values), (right_starts, right_columns, right_values) = left, right
    lengths = np.empty(end - begin, dtype=np.int32)
    room = 2 * len(right_values) * (end - begin) // (len(starts) - 1)
    new_columns, new_values = np.empty(room, dtype=np.int32), np.empty(room)
    places, height = np.full(n_columns, -1, dtype=np.int64), 0
    for i in range(begin, end):
        first = height
        if height + n_columns > len(new_values):
            room = 0
            for entry in range(starts[i], starts[i + 1]):
                room += right_starts[columns[entry] + 1] - right_starts[columns[entry]]
            if height + room > len(new_values):
                new_columns, new_values = (
                    _double_array(new_columns, room),
                    _double_array(new_values, room),
                )
        for entry in range(starts[i], starts[i + 1]):
            j, share = columns[entry], values[entry]
            for place in range(right_starts[j], right_starts[j + 1]):
                c = right_columns[place]
                if places[c] < first:
                    places[c] = height
                    new_columns[height], new_values[height] = c, 0.0
                    height += 1
                new_values[places[c]] += share * right_values[place]
        lengths[i - begin] = height - first
    return lengths, new_columns[:height], new_values[:height]


@njit
def _double_array(array, more):
    longer = np.empty(2 * len(array) + more, dtype=array.dtype)
    longer[: len(array)] = array
    return longer


@njit
def multiply_rows(starts, columns, values, block, product, begin, end, first):
    """Write rows begin to end - 1 of a sparse matrix times columns to `product`, from row `first` on."""
    sums = np.empty(block.shape[1], dtype=product.dtype)
    for i in range(begin, end):
        _row_product(starts, columns, values, block, i, sums)
        for c in range(len(sums)):
            product[first + i - begin, c] = sums[c]


@njit
def _row_product(starts, columns, values, block, i, sums):
    """Write row i of the product to `sums`, in the order of the entries.

    Four entries at a time, and a row of its own in place of one of the product: the compiler then
    keeps more in registers, which takes 0.8 of the time.
    """
    width = len(sums)
    for c in range(width):
        sums[c] = 0
    entry, end = starts[i], starts[i + 1]
    while entry + 4 <= end:
        j, k, m, n = columns[entry], columns[entry + 1], columns[entry + 2], columns[entry + 3]
        v, w, x, y = values[entry], values[entry + 1], values[entry + 2], values[entry + 3]
        for c in range(width):
            total = sums[c] + v * block[j, c]
            total += w * block[k, c]
            total += x * block[m, c]
            sums[c] = total + y * block[n, c]
        entry += 4
    while entry < end:
        value, j = values[entry], columns[entry]
        for c in range(width):
            sums[c] += value * block[j, c]
        entry += 1


@njit
def smoothing_step(matrix, scales, terms, block, step, moved, old, new, begin, end):
    """Compute rows begin to end - 1 of one Chebyshev step in place, and of the block after it.

    step = old step + new D⁻¹ (r - (A - θ M) block), and moved = block + step. The diagonals M and
    D⁻¹ are in `scales`.
    """
    starts, columns, values = matrix
    weights, inverse = scales
    right, shifts = terms
    width = block.shape[1]
    sums = np.empty(width, dtype=block.dtype)
    for i in range(begin, end):
        _row_product(starts, columns, values, block, i, sums)
        weight, factor = weights[i, 0], inverse[i, 0] * new
        for c in range(width):
            rest = (right[i, c] - sums[c]) + (weight * shifts[c]) * block[i, c]
            step[i, c] = old * step[i, c] + factor * rest
            moved[i, c] = block[i, c] + step[i, c]
