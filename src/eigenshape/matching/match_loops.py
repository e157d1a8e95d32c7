"""Compiled loops of `matching`: agreement of pairs, points placed by distances, and nearest points of faces."""

import numpy as np

from eigenshape._compile import njit


@njit
def couple_pairs(points, images, part, whole, slack, least, longer, couplings):
    """Write how two pairs support each other: a complex number for each pair of pairs.

    `part` and `whole` hold distances, the same transposed, and directions (unit complex numbers in
    the frame of the first point). The modulus is 1 if the two distances agree, and 0 from a share
    `slack` on; the argument is the turn from the direction on the part to that on the whole, in the
    frames of the first pair. A longer distance on the part counts `longer` times. The distance of
    two pairs is that from the later one. Each row is written from left to right: to write both
    entries of two pairs at once, a column apart, takes three times as long.
    """
    ours, ours_back, our_ways = part
    theirs, theirs_back, their_ways = whole
    for i in range(len(points)):
        p, q = points[i], images[i]
        for j in range(len(points)):
            couplings[i, j] = 0
            r, s = points[j], images[j]
            if p == r:
                continue
            if j < i:
                one, two = ours[p, r], theirs[q, s]
            else:
                one, two = ours_back[p, r], theirs_back[q, s]
            if not (np.isfinite(one) and np.isfinite(two)):
                continue
            error = abs(one - two) / max(one, two, least)
            if one > two:
                error *= longer
            if error < slack:
                share = error / slack
                value = 1 - share * share
                couplings[i, j] = value * their_ways[q, s] * np.conj(our_ways[p, r])


@njit
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
def place_by_distances(rows, partners, theirs, near, starts, softness, cap, longer, misfits):
    """Return, for each point of a part, the vertex of the whole that keeps its distances best.

    Row i of `rows` holds distances from the point of pair i to the points that are placed, and row
    p of `theirs` those from the point of the whole that `partners` number to its vertices. Squared
    errors to the pairs `near` are capped, weigh 1 / (distance + softness)², and count `longer`
    times where the distance on the part is the longer one. `starts` are first guesses: with a good
    one few vertices are left to try. Mean squared errors go to `misfits`.
    """
    n_points, count = near.shape
    n_vertices = theirs.shape[1]
    found = np.empty(n_points, dtype=np.int64)
    lengths, weights = np.empty(count), np.empty(count)
    ends = np.empty(count, dtype=np.int64)
    tried = np.empty(n_vertices, dtype=np.int64)
    for v in range(n_points):
        k, total = 0, 0.0
        for place in range(count):
            i = near[v, place]
            if i >= 0 and np.isfinite(rows[i, v]):
                lengths[k], ends[k] = rows[i, v], partners[i]
                weights[k] = 1 / (lengths[k] + softness) ** 2
                total += weights[k]
                k += 1
        found[v], misfits[v], best = starts[v], np.inf, np.inf
        if k == 0:
            continue
        tried[0], n_tried = starts[v], 1
        for is_guess in (True, False):
            for number in range(n_tried):
                w, value = tried[number], 0.0
                for j in range(k):
                    error = theirs[ends[j], w] - lengths[j]
                    if error < 0:
                        error *= longer
                    value += weights[j] * min(error * error, cap)
                    if value >= best:
                        break
                if value < best:
                    best, found[v] = value, w
            if is_guess:
                # A vertex is no better if its error to the first pair alone is as large, give or
                # take rounding.
                reach = np.sqrt(best / weights[0]) if best < weights[0] * cap else np.inf
                low, high = lengths[0] - 1.0001 * reach / longer, lengths[0] + 1.0001 * reach
                firsts, n_tried = theirs[ends[0]], 0
                for w in range(n_vertices):
                    tried[n_tried] = w
                    n_tried += (low <= firsts[w]) & (firsts[w] <= high)
        misfits[v] = best / total
    return found


@njit
def nearest_face_points(points, corners, faces, starts, around, places):
    """Return the face at a given vertex that comes nearest to each point, and the weights there.

    `points` and `corners` are in k dimensions; `around[starts[v]:starts[v + 1]]` are the faces at
    vertex v, and `places` holds the vertex of each point.
    """
    n, k = points.shape
    found = np.empty(n, dtype=np.int64)
    weights = np.empty((n, 3))
    for v in range(n):
        best = np.inf
        for entry in range(starts[places[v]], starts[places[v] + 1]):
            face = around[entry]
            a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
            # Inner products of the sides from corner a, and of the point from there
            one_one = one_two = two_two = one_point = two_point = point_point = 0.0
            for d in range(k):
                one, two = corners[b, d] - corners[a, d], corners[c, d] - corners[a, d]
                point = points[v, d] - corners[a, d]
                one_one += one * one
                one_two += one * two
                two_two += two * two
                one_point += one * point
                two_point += two * point
                point_point += point * point
            s, t = _foot(one_one, one_two, two_two, one_point, two_point)
            value = (
                point_point
                - 2 * (s * one_point + t * two_point)
                + s * s * one_one
                + 2 * s * t * one_two
                + t * t * two_two
            )
            if value < best:
                best, found[v] = value, face
                weights[v, 0], weights[v, 1], weights[v, 2] = max(1 - s - t, 0.0), s, t
    return found, weights


@njit
def _foot(one_one, one_two, two_two, one_point, two_point):
    """Return the place (s, t) in a triangle, s, t >= 0 and s + t <= 1, nearest to a point."""
    area = one_one * two_two - one_two * one_two
    if area > 1e-12 * one_one * two_two:
        s = (two_two * one_point - one_two * two_point) / area
        t = (one_one * two_point - one_two * one_point) / area
        if s >= 0 and t >= 0 and s + t <= 1:
            return s, t
    # Otherwise the nearest point lies on a side: try all three.
    best_s = min(max(one_point / one_one, 0.0), 1.0) if one_one > 0 else 0.0
    best_t = 0.0
    best = best_s * best_s * one_one - 2 * best_s * one_point
    t = min(max(two_point / two_two, 0.0), 1.0) if two_two > 0 else 0.0
    value = t * t * two_two - 2 * t * two_point
    if value < best:
        best, best_s, best_t = value, 0.0, t
    across = one_one - 2 * one_two + two_two
    if across > 0:
        t = (one_one - one_two + two_point - one_point) / across
        t = min(max(t, 0.0), 1.0)
        s = 1 - t
        value = s * s * one_one + 2 * s * t * one_two + t * t * two_two
        value -= 2 * (s * one_point + t * two_point)
        if value < best:
            best_s, best_t = s, t
    return best_s, best_t
