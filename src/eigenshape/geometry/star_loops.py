"""Compiled loops of `cloud_measure`: the Delaunay triangles at one point of the plane."""

from typing import no_type_check

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
@no_type_check
def star_areas(neighbors):
    """Return for each set of neighbours (k, 2), nearest first, the area of the Delaunay triangles at the origin.

    The origin's Voronoi cell is cut out of a square by one bisector after the other; two neighbours whose edges meet in
    a corner of the cell make a triangle with the origin. Triangles whose circle is wider than the square, as slivers
    along a boundary, are none.
    """
    n, k, _ = neighbors.shape
    areas = np.zeros(n)
    room = k + 8
    x, y, label = np.empty(room), np.empty(room), np.empty(room, dtype=np.int64)
    new_x, new_y, new_label = np.empty(room), np.empty(room), np.empty(room, dtype=np.int64)
    for point in range(n):
        reach = 2 * np.hypot(neighbors[point, k - 1, 0], neighbors[point, k - 1, 1])
        x[0], x[1], x[2], x[3] = -reach, reach, reach, -reach
        y[0], y[1], y[2], y[3] = -reach, -reach, reach, reach
        label[:4] = -1
        corners = 4
        for j in range(k):
            a, b = neighbors[point, j, 0], neighbors[point, j, 1]
            level = (a * a + b * b) / 2
            kept = 0
            for i in range(corners):
                following = (i + 1) % corners
                here = a * x[i] + b * y[i] - level
                there = a * x[following] + b * y[following] - level
                if here <= 0:
                    new_x[kept], new_y[kept], new_label[kept] = x[i], y[i], label[i]
                    kept += 1
                if (here <= 0) != (there <= 0):
                    share = here / (here - there)
                    new_x[kept] = x[i] + share * (x[following] - x[i])
                    new_y[kept] = y[i] + share * (y[following] - y[i])
                    new_label[kept] = j if here <= 0 else label[i]  # leaving, the cell goes on along the bisector
                    kept += 1
            corners = kept
            x, new_x, y, new_y, label, new_label = new_x, x, new_y, y, new_label, label
        for i in range(corners):
            one, two = label[i], label[(i + 1) % corners]
            if one >= 0 and two >= 0 and one != two:
                areas[point] += (
                    neighbors[point, one, 0] * neighbors[point, two, 1]
                    - neighbors[point, one, 1] * neighbors[point, two, 0]
                ) / 2
    return areas
