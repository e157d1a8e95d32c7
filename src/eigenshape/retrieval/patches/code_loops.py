"""Compiled loops of `distance` and `coarse`: codes of four bits, and distances of two descriptions or of short rows."""

import numpy as np

from eigenshape._compile import njit


@njit
def unpack(rows, codes):
    """Write the codes of packed rows: the first half of a code lies in the low half bytes."""
    half = rows.shape[1]
    eight, low = np.uint8(8), np.uint8(15)
    for row in range(len(rows)):
        packed = rows[row]
        first, second = codes[row, :half], codes[row, half:]
        for place in range(half):
            first[place] = np.int8((packed[place] & low) - eight)
        for place in range(half):
            second[place] = np.int8((packed[place] >> np.uint8(4)) - eight)


@njit
def dot(one, two):
    """Return the product of two codes.

    The sum fits 32 bits; said at the end, it is summed so, which is three times as fast.
    """
    total = np.int32(0)
    for place in range(len(one)):
        total += np.int32(np.int16(one[place])) * np.int32(np.int16(two[place]))
    return np.int32(total)


@njit
def lengths(codes, found):
    """Write the length of each code; 1 for a code of zeros, whose cosines are 0."""
    for row in range(len(codes)):
        squares = dot(codes[row], codes[row])
        found[row] = np.sqrt(np.float64(squares)) if squares > 0 else 1.0


@njit
def distance(one, one_lengths, two, two_lengths, n_sizes, price):
    """Return 1 - the mean cosine of two descriptions at the best relative size."""
    n_bases = len(one) // n_sizes
    best = -np.inf
    for step in range(1 - n_sizes, n_sizes):
        ours, theirs = max(-step, 0), max(step, 0)
        total = 0.0
        for base in range(n_bases):
            a, b = base * n_sizes + ours, base * n_sizes + theirs
            total += dot(one[a], two[b]) / (one_lengths[a] * two_lengths[b])
        best = max(best, total / n_bases - price * abs(step))
    return max(1.0 - best, 0.0)  # rounding may leave a cosine above 1


@njit
def distances_to(query, query_lengths, others, other_lengths, n_sizes, price, found):
    """Write the distance from one description to each of many, whose rows lie one after another."""
    m = len(query)
    for place in range(len(found)):
        rows = slice(place * m, (place + 1) * m)
        found[place] = distance(
            query, query_lengths, others[rows], other_lengths[rows], n_sizes, price
        )


@njit
def packed_view_distance(query, query_lengths, packed, codes, code_lengths, m, n_sizes, price):
    """Return the mean of two distances: to a whole, and to the nearest of it and its views.

    A description has `m` rows; those of the whole come first. If the other has no views, the views
    of the query serve in their place. `codes` and `code_lengths` are scratch memory.
    """
    n_rows = len(packed)
    unpack(packed, codes)
    lengths(codes[:n_rows], code_lengths)
    other, other_lengths = codes[:n_rows], code_lengths[:n_rows]
    own = distance(query[:m], query_lengths[:m], other[:m], other_lengths[:m], n_sizes, price)
    nearest = own
    for first in range(m, len(other), m):
        rows = slice(first, first + m)
        view = distance(
            query[:m], query_lengths[:m], other[rows], other_lengths[rows], n_sizes, price
        )
        nearest = min(nearest, view)
    if len(other) == m:
        for first in range(m, len(query), m):
            rows = slice(first, first + m)
            view = distance(query[rows], query_lengths[rows], other, other_lengths, n_sizes, price)
            nearest = min(nearest, view)
    return (own + nearest) / 2


@njit
def scan(query, rows, unit, price, found):
    """Write 1 - the best mean cosine over relative sizes, of one query with each shape.

    `query` is (s, d) int16 and `rows` (n, s, d) int8; `unit` is the mean cosine of a product of 1.
    """
    n_sizes = len(query)
    for place in range(len(rows)):
        best = -np.inf
        for step in range(1 - n_sizes, n_sizes):
            ours, theirs = query[max(-step, 0)], rows[place, max(step, 0)]
            total = np.int32(0)
            for number in range(len(ours)):
                total += np.int32(ours[number]) * np.int32(np.int16(theirs[number]))
            best = max(best, unit * np.float64(np.int32(total)) - price * abs(step))
        found[place] = 1.0 - best
