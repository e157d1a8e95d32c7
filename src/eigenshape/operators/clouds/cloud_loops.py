# mypy: allow-untyped-defs, allow-untyped-decorators, no-check-untyped-defs
"""Compiled loop: the Delaunay triangles around the middle of each neighborhood."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit(error_model="numpy")
@no_type_check
def local_rings(coordinates, rings):
    """Find the neighbors of the origin in the Delaunay triangulation of it and points around it.

    The inversion p -> p / |p|² takes circles through the origin to lines. So a circle through the
    origin and two points is empty if and only if all inverted points lie on one side of a line:
    the ring is the convex hull of the inverted points and the origin.

    `coordinates` are (n, k, 2). Each row of `rings`, (n, k + 1), receives the positions of the
    ring in counter-clockwise order, then -1. A position k stands for the origin itself: it is on
    the hull, and so the ring is open there.
    """
    n, k, _ = coordinates.shape
    x, y = np.empty(k + 1), np.empty(k + 1)
    hull = np.empty(2 * k + 4, dtype=np.int64)
    for i in range(n):
        scale = 0.0
        for j in range(k):
            scale = max(scale, abs(coordinates[i, j, 0]), abs(coordinates[i, j, 1]))
        for j in range(k):
            a, b = coordinates[i, j, 0] / scale, coordinates[i, j, 1] / scale
            square = max(a * a + b * b, 1e-300)
            x[j], y[j] = a / square, b / square
        x[k] = y[k] = 0.0
        order = np.argsort(x)
        # Points at one x are put in the order of y.
        for place in range(1, k + 1):
            at, node = place, order[place]
            while at > 0 and x[order[at - 1]] == x[node] and y[order[at - 1]] > y[node]:
                order[at] = order[at - 1]
                at -= 1
            order[at] = node
        size = 0
        for lower in range(2):
            start = size
            for step in range(k + 1):
                node = order[step] if lower == 0 else order[k - step]
                while size - start >= 2:
                    one, two = hull[size - 2], hull[size - 1]
                    left = (x[two] - x[one]) * (y[node] - y[one])
                    right = (y[two] - y[one]) * (x[node] - x[one])
                    if left > right:
                        break
                    size -= 1
                hull[size] = node
                size += 1
            size -= 1  # the last of each half begins the other
        for j in range(k + 1):
            rings[i, j] = hull[j] if j < size else -1
