"""Compiled loops of `triangulate_polygons`. Points in the plane are complex numbers of size 1."""

from eigenshape._compile import njit

# Points nearer than this to a line lie on it, up to rounding of their coordinates.
ROUNDING = 64 * 2.0**-52


@njit
def clip_ears(points, before, after, shapes, triangles):
    """Cut a polygon into triangles; return whether that is possible.

    Corners are cut off one by one (ear clipping, Meisters 1975): always that of the best-shaped
    triangle, and one on a line with its neighbors only where there is no other. `before` and
    `after` hold the neighbors of each corner. `shapes`, filled with -1, holds those of triangles.
    """
    n_left, at = len(points), 0
    for place in range(len(triangles)):
        best = _best_corner(shapes, after, at)
        if shapes[best] <= 0.0:
            # What was in the way of a corner may be gone.
            for _ in range(n_left):
                shapes[at] = _shape(points, before, after, at)
                at = after[at]
            best = _best_corner(shapes, after, at)
        if shapes[best] < 0.0:
            return False
        at, end = before[best], after[best]
        triangles[place, 0], triangles[place, 1], triangles[place, 2] = at, best, end
        after[at], before[end] = end, at
        shapes[at] = _shape(points, before, after, at)
        shapes[end] = _shape(points, before, after, end)
        n_left -= 1
    return True


@njit
def _best_corner(shapes, after, start):
    best, at = start, after[start]
    while at != start:
        if shapes[at] > shapes[best]:
            best = at
        at = after[at]
    return best


@njit
def _shape(points, before, after, corner):
    """Return the area of the triangle at a corner over its longest side squared.

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
        other = points[at]
        if (
            _turn(a, b, other) >= -margin
            and _turn(b, c, other) >= -margin
            and _turn(c, a, other) >= -margin
            # A bridge to a hole has two corners at each of its ends.
            and other not in (a, b, c)
        ):
            return -1.0
        at = after[at]
    return area / longest**2


@njit
def _turn(a, b, c):
    """Return twice the area of a triangle; it is positive if its corners turn left."""
    return ((b - a).conjugate() * (c - a)).imag


@njit
def crosses_itself(points):
    """Return whether two sides of a polygon cross."""
    n = len(points)
    for i in range(n):
        for j in range(i + 2, n):
            a, b, c, d = points[i], points[i + 1], points[j], points[(j + 1) % n]
            if _parts(a, b, c, d) and _parts(c, d, a, b):
                return True
    return False


@njit
def _parts(a, b, c, d):
    """Return whether the line from a to b passes between c and d."""
    one, two = _turn(a, b, c), _turn(a, b, d)
    return min(one, two) < -ROUNDING and max(one, two) > ROUNDING
