"""Compiled loops of `triangulate_polygons`. Points in the plane are complex numbers of size 1."""

import numpy as np

from eigenshape._compile import njit

# Points nearer than this to a line lie on it, up to rounding of their coordinates.
ROUNDING = 64 * 2.0**-52
GONE = -2.0  # in place of the shape of a corner
STEPS = (
    2.0**20
)  # from 0 to 1; shapes that agree to a step are equal, so that rounding decides nothing


@njit
def clip_ears(points):
    """Cut a polygon into triangles; return them, and whether it does not cross itself.

    Corners are cut off one by one (ear clipping, Meisters 1975): always that of the best-shaped
    triangle, and one on a line with its neighbors only where there is no other.
    """
    triangles = np.empty((len(points) - 2, 3), np.int64)
    ring = np.arange(len(points))
    before, after = np.roll(ring, 1), np.roll(ring, -1)  # neighbors of each corner
    shapes = np.full(len(points), -1.0)  # of the triangles at corners
    for place in range(len(triangles)):
        best = shapes.argmax()
        if shapes[best] <= 0.0:
            # What was in the way of a corner may be gone.
            for corner in range(len(points)):
                if shapes[corner] != GONE:
                    shapes[corner] = _shape(points, before, after, corner)
            best = shapes.argmax()
        if shapes[best] < 0.0:
            return triangles, False
        start, end = before[best], after[best]
        triangles[place, 0], triangles[place, 1], triangles[place, 2] = start, best, end
        after[start], before[end], shapes[best] = end, start, GONE
        shapes[start] = _shape(points, before, after, start)
        shapes[end] = _shape(points, before, after, end)
    return triangles, not _crosses_itself(points)


@njit
def _shape(points, before, after, corner):
    """Return the area of the triangle at a corner over its longest side squared, in steps from 1.

    It is 0 if the triangle has no area, and -1 if it cannot be cut off: the corner turns right, or
    another one is in the triangle or on its sides.
    """
    a, b, c = points[before[corner]], points[corner], points[after[corner]]
    area, longest = _turn(a, b, c), max(abs(b - a), abs(c - b), abs(a - c))
    margin = ROUNDING * longest
    if area <= margin:
        return 0.0 if area >= -margin else -1.0
    at = after[after[corner]]
    while at != before[corner]:
        d = points[at]
        nearest = min(_turn(a, b, d), _turn(b, c, d), _turn(c, a, d))
        # A bridge to a hole has two corners at each of its ends.
        if nearest >= -margin and d not in (a, b, c):
            return -1.0
        at = after[at]
    return max(1.0, round(STEPS * area / longest**2))


@njit
def _turn(a, b, c):
    """Return twice the area of a triangle; it is positive if its corners turn left."""
    return ((b - a).conjugate() * (c - a)).imag


@njit
def _crosses_itself(points):
    """Return whether two sides of a polygon cross."""
    for i in range(len(points)):
        for j in range(i):
            a, b, c, d = points[i - 1], points[i], points[j - 1], points[j]
            if _parts(a, b, c, d) and _parts(c, d, a, b):
                return True
    return False


@njit
def _parts(a, b, c, d):
    """Return whether the line from a to b passes between c and d."""
    one, two = _turn(a, b, c), _turn(a, b, d)
    return min(one, two) < -ROUNDING and max(one, two) > ROUNDING
