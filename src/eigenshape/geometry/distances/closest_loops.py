"""Compiled loops of `closest` and of `carrying`: nearest faces of points, and how faces wind around them.

The corners of face i are `corners[i]`. Faces are in the order of the leaves of a `box_tree`.
"""

import numpy as np

from eigenshape._compile import njit

# A product of many complex numbers is brought back to size 1 beyond these sizes. One factor changes
# it by up to 1e±160, and floats end at 1e±308.
SMALL, LARGE = 1e-100, 1e100


@njit
def nearest_faces(points, corners, levels, nodes):
    """Return, for each point, its nearest face, the weights of the corners there, and distance².

    Boxes that are farther than the nearest point known so far are skipped; of two children the
    nearer one is opened first.
    """
    n, leaves = len(corners), 1 << levels
    faces, weights = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 3))
    squares = np.empty(len(points))
    waiting, away = np.empty(levels + 2, dtype=np.int64), np.empty(levels + 2)
    for p in range(len(points)):
        x, y, z = points[p]
        least, height = np.inf, 1
        waiting[0], away[0] = 0, 0.0
        while height:
            height -= 1
            node = waiting[height]
            if away[height] >= least:
                continue
            if node < leaves - 1:
                left, right = 2 * node + 1, 2 * node + 2
                to_left, to_right = _to_box(nodes, left, x, y, z), _to_box(nodes, right, x, y, z)
                if to_left < to_right:
                    left, right, to_left, to_right = right, left, to_right, to_left
                waiting[height], away[height] = left, to_left
                waiting[height + 1], away[height + 1] = right, to_right
                height += 2
                continue
            leaf = node - leaves + 1
            for face in range(leaf * n // leaves, (leaf + 1) * n // leaves):
                found, b, c = to_face(corners, face, x, y, z)
                if found < least:
                    least, faces[p] = found, face
                    weights[p, 0], weights[p, 1], weights[p, 2] = max(1.0 - b - c, 0.0), b, c
        squares[p] = least
    return faces, weights, squares


@njit
def nearest_around(points, middles, starts, reach, corners, neighbors):
    """Return, for three points each, the nearest of the faces around a start, and weights there.

    Faces are visited from neighbor to neighbor, as long as their squared distance to the middle
    is at most the reach.
    """
    faces = np.zeros((len(points), 3), dtype=np.int64)
    weights = np.zeros((len(points), 3, 3))
    visits, waiting = np.full(len(corners), -1), np.empty(len(corners), dtype=np.int64)
    least = np.empty(3)
    for p in range(len(points)):
        least[:] = np.inf
        waiting[0], visits[starts[p]] = starts[p], p
        first, last = 0, 1
        while first < last and least.max() > 0.0:
            face = waiting[first]
            first += 1
            for k in range(3):
                x, y, z = points[p, k]
                found, b, c = to_face(corners, face, x, y, z)
                if found < least[k]:
                    least[k], faces[p, k] = found, face
                    weights[p, k, 0], weights[p, k, 1] = max(1.0 - b - c, 0.0), b
                    weights[p, k, 2] = c
            for k in range(3):
                other = neighbors[face, k]
                x, y, z = middles[p]
                if visits[other] != p and to_face(corners, other, x, y, z)[0] <= reach[p]:
                    visits[other] = p
                    waiting[last] = other
                    last += 1
    return faces, weights


@njit
def _to_box(boxes, i, x, y, z):
    """Return the squared distance to a box."""
    along = max(boxes[i, 0] - x, 0.0, x - boxes[i, 3])
    across = max(boxes[i, 1] - y, 0.0, y - boxes[i, 4])
    up = max(boxes[i, 2] - z, 0.0, z - boxes[i, 5])
    return along * along + across * across + up * up


@njit
def to_face(corners, face, x, y, z):
    """Return the squared distance to a face, and the weights of corners 1 and 2 there.

    The nearest point is the foot of the perpendicular if that lies inside, else on a side. This
    also holds for faces without area, which have no inside.
    """
    ax, ay, az = corners[face, 0]
    ux, uy, uz = corners[face, 1, 0] - ax, corners[face, 1, 1] - ay, corners[face, 1, 2] - az
    vx, vy, vz = corners[face, 2, 0] - ax, corners[face, 2, 1] - ay, corners[face, 2, 2] - az
    wx, wy, wz = x - ax, y - ay, z - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    if square > 0.0:
        # Weights of the foot: n · (w × v) / n² of corner 1, n · (u × w) / n² of corner 2.
        b = nx * (wy * vz - wz * vy) + ny * (wz * vx - wx * vz) + nz * (wx * vy - wy * vx)
        c = nx * (uy * wz - uz * wy) + ny * (uz * wx - ux * wz) + nz * (ux * wy - uy * wx)
        if b > 0.0 and c > 0.0 and b + c < square:
            height = nx * wx + ny * wy + nz * wz
            return height * height / square, b / square, c / square
    least, first = _to_segment(ux, uy, uz, wx, wy, wz)
    second = 0.0
    found, share = _to_segment(vx, vy, vz, wx, wy, wz)
    if found < least:
        least, first, second = found, 0.0, share
    found, share = _to_segment(vx - ux, vy - uy, vz - uz, wx - ux, wy - uy, wz - uz)
    if found < least:
        least, first, second = found, 1.0 - share, share
    return least, first, second


@njit
def _to_segment(ux, uy, uz, wx, wy, wz):
    """Return the squared distance of w to the segment from 0 to u, and the share of u there."""
    square = ux * ux + uy * uy + uz * uz
    share = ux * wx + uy * wy + uz * wz
    share = min(max(share / square, 0.0), 1.0) if square > 0.0 else 0.0
    x, y, z = wx - share * ux, wy - share * uy, wz - share * uz
    return x * x + y * y + z * z, share


@njit
def windings(points, corners):
    """Return how often faces wind around each point: the sum of their solid angles over 4π.

    Half the solid angle of a face is the argument of a complex number (Van Oosterom and Strackee
    1983). Arguments are summed by multiplying the numbers, and full turns are counted where the
    product crosses the negative real axis; so only one arctangent is needed.
    """
    found = np.empty(len(points))
    for p in range(len(points)):
        x, y, z = points[p]
        real, imaginary, turns = 1.0, 0.0, 0
        for face in range(len(corners)):
            ax, ay, az = corners[face, 0, 0] - x, corners[face, 0, 1] - y, corners[face, 0, 2] - z
            bx, by, bz = corners[face, 1, 0] - x, corners[face, 1, 1] - y, corners[face, 1, 2] - z
            cx, cy, cz = corners[face, 2, 0] - x, corners[face, 2, 1] - y, corners[face, 2, 2] - z
            a = np.sqrt(ax * ax + ay * ay + az * az)
            b = np.sqrt(bx * bx + by * by + bz * bz)
            c = np.sqrt(cx * cx + cy * cy + cz * cz)
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            below = (
                a * b * c
                + (ax * bx + ay * by + az * bz) * c
                + (bx * cx + by * cy + bz * cz) * a
                + (cx * ax + cy * ay + cz * az) * b
            )
            if volume == 0.0 and below == 0.0:
                continue  # the point is a corner, or lies on a side
            upper = imaginary >= 0.0
            real, imaginary = real * below - imaginary * volume, real * volume + imaginary * below
            if upper and volume > 0.0 and imaginary < 0.0:
                turns += 1
            elif not upper and volume < 0.0 and imaginary >= 0.0:
                turns -= 1
            size = abs(real) + abs(imaginary)
            if size < SMALL or size > LARGE:
                real, imaginary = real / size, imaginary / size
        found[p] = turns + np.arctan2(imaginary, real) / (2 * np.pi)
    return found
