"""Compiled loops of `cloud_measure`: Voronoi cells in the plane."""

import numpy as np

from eigenshape._compile import njit


@njit
def cell_areas(places):
    """Return the area of the origin's Voronoi cell within the convex hull, for each point set.

    Each set has k points, (k, 2), sorted by x, then y; the origin is one of them. The hull
    (Andrew's monotone chain) is cut by one bisector after the other.
    """
    n, k, _ = places.shape
    areas = np.zeros(n)
    room = 2 * k + 4
    x, y, new_x, new_y = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    for point in range(n):
        corners = 0
        for way in range(2):
            floor = corners
            for step in range(k):
                u, v = places[point, step if way == 0 else k - 1 - step]
                while corners >= floor + 2 and (
                    (x[corners - 1] - x[corners - 2]) * (v - y[corners - 2])
                    <= (y[corners - 1] - y[corners - 2]) * (u - x[corners - 2])
                ):
                    corners -= 1
                x[corners], y[corners] = u, v
                corners += 1
            corners -= 1  # the end of one chain begins the next
        for j in range(k):
            a, b = places[point, j]
            level = (a * a + b * b) / 2
            kept = 0
            for i in range(corners):
                following = (i + 1) % corners
                here = a * x[i] + b * y[i] - level
                there = a * x[following] + b * y[following] - level
                if here <= 0:
                    new_x[kept], new_y[kept] = x[i], y[i]
                    kept += 1
                if (here <= 0) != (there <= 0):
                    share = here / (here - there)
                    new_x[kept] = x[i] + share * (x[following] - x[i])
                    new_y[kept] = y[i] + share * (y[following] - y[i])
                    kept += 1
            corners = kept
            x, new_x, y, new_y = new_x, x, new_y, y
        for i in range(corners):
            following = (i + 1) % corners
            areas[point] += (x[i] * y[following] - y[i] * x[following]) / 2
    return areas
