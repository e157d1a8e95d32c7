"""Compiled loops of `crossings`: a tree of boxes, and whether two faces cross.

The corners of face i are `points[3 i : 3 i + 3]`. Faces are in the order of the tree's leaves.
"""

import numpy as np

from eigenshape._compile import njit
from eigenshape.geometry.distances.predicate_loops import same_place, side_of_line, side_of_plane

LEAF = 4  # most faces of a leaf; more means fewer nodes but more pairs of faces to compare


@njit
def face_boxes(points):
    """Return the least and the largest coordinates of each face, (f, 6)."""
    boxes = np.empty((len(points) // 3, 6))
    for face in range(len(boxes)):
        for axis in range(3):
            x, y, z = points[3 * face, axis], points[3 * face + 1, axis], points[3 * face + 2, axis]
            boxes[face, axis], boxes[face, 3 + axis] = min(x, y, z), max(x, y, z)
    return boxes


@njit
def curve_places(boxes):
    """Return the place of each box center on Morton's curve through 2^20 cells per side."""
    places = np.zeros(len(boxes), dtype=np.int64)
    lowest = np.array([boxes[:, axis].min() for axis in range(3)])
    extent = max([boxes[:, 3 + axis].max() - lowest[axis] for axis in range(3)])
    per_length = (2**20 - 1) / extent if extent > 0.0 else 0.0
    for face in range(len(boxes)):
        for axis in range(3):
            middle = boxes[face, axis] / 2 + boxes[face, 3 + axis] / 2
            cell = np.int64((middle - lowest[axis]) * per_length)
            for bit in range(20):
                places[face] |= ((cell >> bit) & 1) << (3 * bit + axis)
    return places


@njit
def box_tree(boxes):
    """Return the boxes of a complete binary tree of 2^levels leaves.

    The children of node k are 2 k + 1 and 2 k + 2.
    """
    n, levels = len(boxes), 0
    while (LEAF << levels) < n:
        levels += 1
    leaves = 1 << levels
    nodes = np.empty((2 * leaves - 1, 6))
    for leaf in range(leaves):
        node = nodes[leaves - 1 + leaf]
        node[:] = boxes[leaf * n // leaves]
        for face in range(leaf * n // leaves + 1, (leaf + 1) * n // leaves):
            _widen(node, boxes[face])
    for place in range(leaves - 2, -1, -1):
        nodes[place] = nodes[2 * place + 1]
        _widen(nodes[place], nodes[2 * place + 2])
    return levels, nodes


@njit
def _widen(box, other):
    for axis in range(3):
        box[axis], box[3 + axis] = min(box[axis], other[axis]), max(box[3 + axis], other[3 + axis])


@njit
def _box(boxes, i):
    return boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3], boxes[i, 4], boxes[i, 5]


@njit
def _meet(one, other):
    return (
        one[0] <= other[3]
        and other[0] <= one[3]
        and one[1] <= other[4]
        and other[1] <= one[4]
        and one[2] <= other[5]
        and other[2] <= one[5]
    )


@njit
def crossing_pairs(points, boxes):
    """Return the pairs of faces that cross, (p, 2), in no particular order.

    Nodes are compared with nodes of the same level, from the root down to the leaves.
    """
    levels, nodes = box_tree(boxes)
    n, leaves, axes = len(boxes), 1 << levels, _axes(points)
    waiting, height = np.zeros((3 * levels + 4, 2), dtype=np.int64), 1  # the root with itself
    pairs, found = np.empty((64, 2), dtype=np.int64), 0
    while height:
        height -= 1
        a, b = waiting[height]
        if a < leaves - 1:
            for one in (2 * a + 1, 2 * a + 2):
                box = _box(nodes, one)
                for other in (2 * b + 1, 2 * b + 2):
                    if one == other or (
                        not (a == b and one > other) and _meet(box, _box(nodes, other))
                    ):
                        waiting[height, 0], waiting[height, 1] = one, other
                        height += 1
            continue
        a, b = a - leaves + 1, b - leaves + 1
        for i in range(a * n // leaves, (a + 1) * n // leaves):
            box = _box(boxes, i)
            for j in range(i + 1 if a == b else b * n // leaves, (b + 1) * n // leaves):
                some_area = axes[i] >= 0 or axes[j] >= 0
                if some_area and _meet(box, _box(boxes, j)) and _cross(points, axes, i, j):
                    if found == len(pairs):
                        pairs = np.concatenate((pairs, np.empty_like(pairs)))
                    pairs[found, 0], pairs[found, 1] = i, j
                    found += 1
    return pairs[:found].copy()


@njit
def _axes(points):
    """Return, for each face, an axis along which its projection has area; -1 if the face has none."""
    axes = np.empty(len(points) // 3, dtype=np.int64)
    for face in range(len(axes)):
        axes[face], a = -1, 3 * face
        for axis in range(3):
            if side_of_line(points, (axis + 1) % 3, (axis + 2) % 3, a, a + 1, a + 2) != 0:
                axes[face] = axis
                break
    return axes


@njit
def _cross(points, axes, i, j):
    """Return whether the interior of one of two faces meets the other; at least one has area.

    The planes meet in a line, and each face cuts this line in an interval. An end of the interval
    is the point where a side of the face meets the line. This side starts at `alone`, the corner
    that is alone on its side of the other plane. The sign of the volume spanned by two such sides,
    one of each face, gives the order of their ends on the line, up to one common sign (Guigue and
    Devillers 2003, section 3).
    """
    a, b = 3 * i, 3 * j
    if axes[i] < 0:
        return _enters(points, axes[j], a, b)
    if axes[j] < 0:
        return _enters(points, axes[i], b, a)
    apex = _beyond_shared_side(points, a, b)
    if apex >= 0 and side_of_plane(points, a, a + 1, a + 2, apex) != 0:
        return False
    low_b, high_b, alone_b = _sides(points, a, b)
    if low_b == high_b:
        u, v = (axes[i] + 1) % 3, (axes[i] + 2) % 3
        return low_b == 0 and not (
            _is_apart(points, u, v, a, b, b + 1, b + 2)
            or _is_apart(points, u, v, b, a, a + 1, a + 2)
        )
    low_a, high_a, alone_a = _sides(points, b, a)
    if low_a == high_a or (low_a * high_a == 0 and low_b * high_b == 0):
        return False  # one misses the line, or only their borders touch it
    least, most = 1, -1
    for p in (a + (alone_a + 1) % 3, a + (alone_a + 2) % 3):
        for q in (b + (alone_b + 1) % 3, b + (alone_b + 2) % 3):
            side = side_of_plane(points, a + alone_a, p, b + alone_b, q)
            least, most = min(least, side), max(most, side)
    return least < 0 and most > 0


@njit
def _beyond_shared_side(points, a, b):
    """Return the corner of face b opposite to a side that it shares with face a, or -1."""
    shared, apex = 0, -1
    for q in range(b, b + 3):
        if same_place(points, a, q) or same_place(points, a + 1, q) or same_place(points, a + 2, q):
            shared += 1
        else:
            apex = q
    return apex if shared == 2 else -1


@njit
def _sides(points, a, b):
    """Return on which sides of face a's plane b has corners, and the corner alone on its side.

    The sides are the smallest and the largest sign of the three corners.
    """
    x = side_of_plane(points, a, a + 1, a + 2, b)
    y = side_of_plane(points, a, a + 1, a + 2, b + 1)
    z = side_of_plane(points, a, a + 1, a + 2, b + 2)
    if x != 0 and x * y <= 0 and x * z <= 0:
        alone = 0
    elif y != 0 and y * x <= 0 and y * z <= 0:
        alone = 1
    elif z != 0 and z * x <= 0 and z * y <= 0:
        alone = 2
    else:  # one side has no corner: take the corner in the plane, if any
        alone = 0 if x == 0 else 1 if y == 0 else 2
    return min(x, y, z), max(x, y, z), alone


@njit
def _is_apart(points, u, v, a, p, q, r):
    """Return whether a side of face a separates it from p, q, r, projected to axes u and v.

    Points on the side count as separated.
    """
    turn = side_of_line(points, u, v, a, a + 1, a + 2)
    for k in range(3):
        s, t = a + k, a + (k + 1) % 3
        if (
            turn * side_of_line(points, u, v, s, t, p) <= 0
            and turn * side_of_line(points, u, v, s, t, q) <= 0
            and turn * side_of_line(points, u, v, s, t, r) <= 0
        ):
            return True
    return False


@njit
def _enters(points, axis, a, b):
    """Return whether face a, a segment or a point, has a point inside face b.

    The projection of b along `axis` has area.
    """
    p, q = _ends(points, a)
    from_p, from_q = (
        side_of_plane(points, b, b + 1, b + 2, p),
        side_of_plane(points, b, b + 1, b + 2, q),
    )
    if from_p * from_q > 0:
        return False
    if from_p != 0 or from_q != 0:
        x, y = side_of_plane(points, p, q, b, b + 1), side_of_plane(points, p, q, b + 1, b + 2)
        return x != 0 and x == y and x == side_of_plane(points, p, q, b + 2, b)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    if _is_apart(points, u, v, b, p, q, q):
        return False
    x, y = side_of_line(points, u, v, p, q, b), side_of_line(points, u, v, p, q, b + 1)
    z = side_of_line(points, u, v, p, q, b + 2)
    return same_place(points, p, q) or min(x, y, z) * max(x, y, z) < 0


@njit
def _ends(points, a):
    """Return the first and the last of three corners on a line, by x, then y, then z."""
    first, last = a, a
    for corner in (a + 1, a + 2):
        if _is_before(points, corner, first):
            first = corner
        if _is_before(points, last, corner):
            last = corner
    return first, last


@njit
def _is_before(points, p, q):
    for axis in range(3):
        if points[p, axis] != points[q, axis]:
            return points[p, axis] < points[q, axis]
    return False
