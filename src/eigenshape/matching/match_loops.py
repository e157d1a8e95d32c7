"""Compiled loops of `matching`: agreement of pairs, and points placed by distances to pairs."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def couple_pairs(points, images, part, whole, slack, least, longer, couplings):
    """Write how two pairs support each other: a complex number for each pair of pairs.

    `part` and `whole` hold distances and directions (unit complex numbers in the frame of the first
    point). The modulus is 1 if the two distances agree, and 0 from a share `slack` on; the argument
    is the turn from the direction on the part to that on the whole, in the frames of the first
    pair. A longer distance on the part counts `longer` times.
    """
    ours, our_ways = part
    theirs, their_ways = whole
    for i in range(len(points)):
        p, q = points[i], images[i]
        couplings[i, i] = 0
        for j in range(i):
            couplings[i, j] = couplings[j, i] = 0
            r, s = points[j], images[j]
            if p == r:
                continue
            one, two = ours[p, r], theirs[q, s]
            if not (np.isfinite(one) and np.isfinite(two)):
                continue
            error = abs(one - two) / max(one, two, least)
            if one > two:
                error *= longer
            if error < slack:
                share = error / slack
                value = 1 - share * share
                couplings[i, j] = value * their_ways[q, s] * np.conj(our_ways[p, r])
                couplings[j, i] = value * their_ways[s, q] * np.conj(our_ways[r, p])


@njit
@no_type_check
def nearest_rows(rows, count):
    """Return, for each column of a table, the rows of the least entries, the least first.

    Where there are fewer rows than `count`, the rest is -1.
    """
    m, n = rows.shape
    found = np.full((n, count), -1)
    least = np.empty(count)
    for v in range(n):
        filled = 0
        for i in range(m):
            value = rows[i, v]
            if filled == count and value >= least[count - 1]:
                continue
            place = min(filled, count - 1)
            while place > 0 and least[place - 1] > value:
                least[place] = least[place - 1]
                found[v, place] = found[v, place - 1]
                place -= 1
            least[place] = value
            found[v, place] = i
            filled = min(filled + 1, count)
    return found


@njit
@no_type_check
def place_by_distances(rows, partners, columns, near, starts, softness, cap, longer, misfits):
    """Return, for each point of a part, the vertex of the whole that keeps its distances best.

    Row i of `rows` holds distances from the point of pair i to the points that are placed, and row
    w of `columns` those from vertex w of the whole to the points that `partners` number. Squared
    errors to the pairs `near` are capped, weigh 1 / (distance + softness)², and count `longer`
    times where the distance on the part is the longer one. `starts` are first guesses: a good one
    ends most sums early. Mean squared errors go to `misfits`.
    """
    n_points, count = near.shape
    found = np.empty(n_points, dtype=np.int64)
    lengths, weights = np.empty(count), np.empty(count)
    ends = np.empty(count, dtype=np.int64)
    for v in range(n_points):
        k, total = 0, 0.0
        for place in range(count):
            i = near[v, place]
            if i >= 0 and np.isfinite(rows[i, v]):
                lengths[k], ends[k] = rows[i, v], partners[i]
                weights[k] = 1 / (lengths[k] + softness) ** 2
                total += weights[k]
                k += 1
        best, at = np.inf, starts[v]
        # The first guess comes first, then every vertex.
        for number in range(-1, len(columns)):
            w = starts[v] if number < 0 else number
            value = 0.0
            for j in range(k):
                error = columns[w, ends[j]] - lengths[j]
                if error < 0:
                    error *= longer
                value += weights[j] * min(error * error, cap)
                if value >= best:
                    break
            if value < best:
                best, at = value, w
        found[v] = at
        misfits[v] = best / total if k > 0 else np.inf
    return found
