"""Compiled loops of `spectral_refinement`: the nearest point of a few triangles in many dimensions."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
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
@no_type_check
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
