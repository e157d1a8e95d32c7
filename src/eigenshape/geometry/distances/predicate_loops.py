"""Compiled predicates with exact signs: on which side of a line or a plane a point lies.

A sum of rounded products is accepted if it exceeds the bound of its rounding error (Shewchuk 1997,
"Adaptive precision floating-point arithmetic and fast robust geometric predicates", figures 21 and
22). Otherwise it is computed exactly, as an expansion: floats that do not overlap, ascending in
size (section 2 there). Coordinates must be at most 2 in size and whole multiples of 2^-300, so that
no product of three underflows.
"""

import numpy as np

from eigenshape._compile import njit

UNIT = 2.0**-53  # unit roundoff: half the distance from 1 to the next float
# Largest rounding error of the two determinants, relative to the sum of the absolute products
# (Shewchuk 1997, bounds A of figures 21 and 22).
LINE_BOUND = (3 + 16 * UNIT) * UNIT
PLANE_BOUND = (7 + 56 * UNIT) * UNIT
SPLITTER = 2.0**27 + 1  # splits a float into halves of 26 bits, whose products are exact (Dekker)
# Most terms of an exact determinant: 6 products of three differences, each difference being two
# floats (8 products of three floats), each of these products being four floats.
MOST_TERMS = 192


@njit
def _two_sum(a, b):
    """Return the rounded sum a + b and its rounding error (Knuth)."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


@njit
def _two_product(a, b):
    """Return the rounded product a b and its rounding error (Dekker, Veltkamp)."""
    product = a * b
    wide_a, wide_b = SPLITTER * a, SPLITTER * b
    high_a, high_b = wide_a - (wide_a - a), wide_b - (wide_b - b)
    low_a, low_b = a - high_a, b - high_b
    return product, low_a * low_b - (
        ((product - high_a * high_b) - low_a * high_b) - high_a * low_b
    )


@njit
def _add(expansion, length, value):
    """Add a float to an expansion in place, without zeros; return its length.

    This is GROW-EXPANSION of Shewchuk (1997).
    """
    kept = 0
    for place in range(length):
        value, left = _two_sum(value, expansion[place])
        if left != 0.0:
            expansion[kept] = left
            kept += 1
    if value != 0.0:
        expansion[kept] = value
        kept += 1
    return kept


@njit
def _sign(value):
    return (value > 0.0) - (value < 0.0)


@njit
def side_of_line(points, u, v, a, b, c):
    """Return the sign of the area of a, b, c projected to axes u and v: 1 if they turn left."""
    left = (points[a, u] - points[c, u]) * (points[b, v] - points[c, v])
    right = (points[a, v] - points[c, v]) * (points[b, u] - points[c, u])
    difference, rounding = left - right, LINE_BOUND * (abs(left) + abs(right))
    if abs(difference) > rounding or rounding == 0.0:
        return _sign(difference)
    return _exact_side_of_line(points, u, v, a, b, c)


@njit
def _exact_side_of_line(points, u, v, a, b, c):
    expansion, length = np.empty(MOST_TERMS), 0
    for turn in (1.0, -1.0):
        for x in _two_sum(points[a, u], -points[c, u]):
            for y in _two_sum(points[b, v], -points[c, v]):
                for term in _two_product(turn * x, y):
                    length = _add(expansion, length, term)
        u, v = v, u
    return _sign(expansion[length - 1]) if length else 0


@njit
def side_of_plane(points, a, b, c, d):
    """Return the sign of det[a - d, b - d, c - d].

    It is 1 if a, b, c turn left as seen from the side of their plane away from d.
    """
    ax, ay, az = (
        points[a, 0] - points[d, 0],
        points[a, 1] - points[d, 1],
        points[a, 2] - points[d, 2],
    )
    bx, by, bz = (
        points[b, 0] - points[d, 0],
        points[b, 1] - points[d, 1],
        points[b, 2] - points[d, 2],
    )
    cx, cy, cz = (
        points[c, 0] - points[d, 0],
        points[c, 1] - points[d, 1],
        points[c, 2] - points[d, 2],
    )
    bxcy, cxby, cxay, axcy, axby, bxay = bx * cy, cx * by, cx * ay, ax * cy, ax * by, bx * ay
    volume = az * (bxcy - cxby) + bz * (cxay - axcy) + cz * (axby - bxay)
    size = (
        (abs(bxcy) + abs(cxby)) * abs(az)
        + (abs(cxay) + abs(axcy)) * abs(bz)
        + (abs(axby) + abs(bxay)) * abs(cz)
    )
    rounding = PLANE_BOUND * size
    if abs(volume) > rounding or rounding == 0.0:
        return _sign(volume)
    return _exact_side_of_plane(points, a, b, c, d)


@njit
def _exact_side_of_plane(points, a, b, c, d):
    if same_place(points, a, b) or same_place(points, a, c) or same_place(points, b, c):
        return 0
    expansion, length = np.empty(MOST_TERMS), 0
    for i in range(3):
        for turn in (1, -1):
            j, k = (i + turn) % 3, (i - turn) % 3
            for y in _two_sum(points[b, j], -points[d, j]):
                if y == 0.0:
                    continue
                for z in _two_sum(points[c, k], -points[d, k]):
                    if z == 0.0:
                        continue
                    for yz in _two_product(turn * y, z):
                        if yz == 0.0:
                            continue
                        for x in _two_sum(points[a, i], -points[d, i]):
                            if x == 0.0:
                                continue
                            for term in _two_product(x, yz):
                                length = _add(expansion, length, term)
    return _sign(expansion[length - 1]) if length else 0


@njit
def same_place(points, a, b):
    return (
        points[a, 0] == points[b, 0]
        and points[a, 1] == points[b, 1]
        and points[a, 2] == points[b, 2]
    )
