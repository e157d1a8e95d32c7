# mypy: allow-untyped-defs, allow-untyped-decorators, no-check-untyped-defs
"""Compiled loops over the sides of an intrinsic triangulation.

The sides of triangle f are 3f, 3f + 1, 3f + 2, in order around it. Side h starts at the vertex
`tails[h]`, has length `lengths[h]`, and is glued to side `twins[h]` of another triangle or the
same.
"""

import numpy as np

from eigenshape._compile import njit


@njit(error_model="numpy")
def next_side(side):
    return side - 2 if side % 3 == 2 else side + 1


@njit(error_model="numpy")
def area_of(a, b, c):
    # Heron's formula in Kahan's order, which is accurate for needles too.
    low, high = min(a, b), max(a, b)
    small, middle, large = min(low, c), max(low, min(high, c)), max(high, c)
    product = (large + (middle + small)) * (small - (large - middle))
    product *= (small + (large - middle)) * (large + (middle - small))
    return 0.25 * np.sqrt(max(product, 0.0))


@njit(error_model="numpy")
def areas(lengths):
    found = np.empty(len(lengths) // 3)
    for f in range(len(found)):
        found[f] = area_of(lengths[3 * f], lengths[3 * f + 1], lengths[3 * f + 2])
    return found


@njit(error_model="numpy")
def cotangent(lengths, side):
    """Return the cotangent of the angle opposite to a side, and the size of its terms."""
    a = lengths[side]
    b = lengths[next_side(side)]
    c = lengths[next_side(next_side(side))]
    four_areas = 4 * area_of(a, b, c)
    return (b * b + c * c - a * a) / four_areas, (a * a + b * b + c * c) / four_areas


@njit(error_model="numpy")
def cotangents(lengths):
    found = np.empty(len(lengths))
    for side in range(len(lengths)):
        found[side] = cotangent(lengths, side)[0]
    return found


@njit(error_model="numpy")
def _apex(lengths, side):
    """Return the coordinates of the opposite corner, along a side and perpendicular to it."""
    a = lengths[side]
    b = lengths[next_side(side)]
    c = lengths[next_side(next_side(side))]
    return (a * a + c * c - b * b) / (2 * a), 2 * area_of(a, b, c) / a


@njit(error_model="numpy")
def flip_to_delaunay(tails, twins, lengths, tolerance, most):
    """Flip edges in place until all are Delaunay; return the number of flips.

    Edges are flipped in the order in which they are found. Returns -1 after more than `most` flips.
    """
    n = len(tails)
    queue, waiting = np.empty(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    first, length, flips = 0, 0, 0
    for side in range(n):
        if side < twins[side]:
            queue[length], waiting[side] = side, True
            length += 1
    while length:
        side = queue[first]
        first, length = (first + 1) % n, length - 1
        waiting[side] = False
        one, size_one = cotangent(lengths, side)
        two, size_two = cotangent(lengths, twins[side])
        if not one + two < -tolerance * (size_one + size_two):
            continue
        flips += 1
        if flips > most:
            return -1
        # Triangles (u, v, w) and (v, u, x) become (x, w, u) and (w, x, v): outer sides move one place.
        twin = twins[side]
        # The length of the other diagonal of the two triangles, unfolded.
        along, above = _apex(lengths, side)
        back, below = _apex(lengths, twin)
        crossing = np.hypot(lengths[side] - along - back, above + below)
        new = np.array(
            [
                next_side(side),
                next_side(next_side(side)),
                next_side(twin),
                next_side(next_side(twin)),
            ]
        )
        old = np.array([new[1], new[2], new[3], new[0]])
        from_old, of_old, old_lengths = tails[old], twins[old], lengths[old]
        for k in range(4):
            other = of_old[k]
            for j in range(4):
                if other == old[j]:
                    other = new[j]
                    break
            tails[new[k]], lengths[new[k]] = from_old[k], old_lengths[k]
            twins[new[k]] = other
            twins[other] = new[k]
        tails[side], tails[twin] = tails[new[2]], tails[new[0]]
        lengths[side] = lengths[twin] = crossing
        for outer in new:
            if not (waiting[outer] or waiting[twins[outer]]):
                queue[(first + length) % n], waiting[outer] = outer, True
                length += 1
    return flips
