"""Compiled loop of `holes`: the cheapest triangulation of a closed chain of points."""

import numpy as np

from eigenshape._compile import njit

# Share of the squared sides of a triangle in its cost, beside the area. In a flat hole all
# triangulations have the same area, and this term chooses the one without slivers.
SHAPE = 0.01
# A triangle with at most this share of its squared sides as area counts as degenerate and is not
# used.
FLAT = 1e-7


@njit
def triangulate(points, taken):
    """Return the cheapest triangulation of the polygon 0..n-1; it is empty if there is none.

    This is dynamic programming over the chains i..j (Barequet and Sharir 1995). No side is drawn
    that is marked in `taken`.
    """
    n = len(points)
    costs, middles = np.full((n, n), np.inf), np.zeros((n, n), dtype=np.int64)
    for i in range(n - 1):
        costs[i, i + 1] = 0.0
    for span in range(2, n):
        for i in range(n - span):
            j = i + span
            if span < n - 1 and taken[i, j]:
                continue
            for m in range(i + 1, j):
                known = costs[i, m] + costs[m, j]
                if known < costs[i, j]:
                    total = known + _cost(points[i], points[m], points[j])
                    if total < costs[i, j]:
                        costs[i, j], middles[i, j] = total, m
    if not np.isfinite(costs[0, n - 1]):
        return np.empty((0, 3), np.int64)
    triangles = np.empty((n - 2, 3), np.int64)
    waiting = [(0, n - 1)]
    for place in range(n - 2):
        i, j = waiting.pop()
        m = middles[i, j]
        triangles[place] = j, m, i
        if m - i > 1:
            waiting.append((i, m))
        if j - m > 1:
            waiting.append((m, j))
    return triangles


@njit
def _cost(a, b, c):
    u, v = b - a, c - a
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    area, w = np.sqrt(x * x + y * y + z * z) / 2, c - b
    sides = (u * u).sum() + (v * v).sum() + (w * w).sum()
    return area + SHAPE * sides if area > FLAT * sides else np.inf
