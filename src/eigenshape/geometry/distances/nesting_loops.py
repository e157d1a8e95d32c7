"""Compiled loops of `nesting`: which points lie inside a closed piece.

The corners of face i are `points[3 i : 3 i + 3]`. Faces are in the order of the leaves of a
`box_tree`, and the points in question follow after all corners.
"""

import numpy as np

from eigenshape._compile import njit
from eigenshape.geometry.distances.predicate_loops import side_of_line, side_of_plane


@njit
def are_inside(points, boxes, levels, nodes):
    """Return whether each point lies inside: whether a ray from it crosses an odd number of faces.

    The ray goes up, along the last axis. No point may lie on a face.
    """
    n, leaves = len(boxes), 1 << levels
    inside = np.zeros(len(points) - 3 * n, dtype=np.bool_)
    waiting = np.empty(levels + 2, dtype=np.int64)
    for number in range(len(inside)):
        p = 3 * n + number
        x, y, z = points[p]
        waiting[0], height = 0, 1
        while height:
            height -= 1
            node = waiting[height]
            box = nodes[node]
            if x < box[0] or y < box[1] or x > box[3] or y > box[4] or z > box[5]:
                continue
            if node < leaves - 1:
                waiting[height], waiting[height + 1] = 2 * node + 1, 2 * node + 2
                height += 2
                continue
            leaf = node - leaves + 1
            for face in range(leaf * n // leaves, (leaf + 1) * n // leaves):
                if _crosses(points, 3 * face, p):
                    inside[number] = not inside[number]
    return inside


@njit
def _crosses(points, a, p):
    """Return whether the ray up from point p crosses face a, by exact signs."""
    turn = side_of_line(points, 0, 1, a, a + 1, a + 2)
    if turn == 0:
        return False  # upright: the ray, moved as below, passes it by
    for k in range(3):
        if _side(points, a + k, a + (k + 1) % 3, p) != turn:
            return False
    return side_of_plane(points, a, a + 1, a + 2, p) == turn


@njit
def _side(points, s, t, p):
    """Return on which side of the line from s to t the ray lies, seen from above; never 0.

    A ray that meets an edge or a corner is moved by an infinitely small step along the first axis,
    and by one smaller still along the second (Edelsbrunner and Mücke 1990). So it passes on the
    same side of an edge for both faces there.
    """
    side = side_of_line(points, 0, 1, s, t, p)
    if side == 0:
        side = np.sign(points[s, 1] - points[t, 1])
    if side == 0:
        side = np.sign(points[t, 0] - points[s, 0])
    return side
