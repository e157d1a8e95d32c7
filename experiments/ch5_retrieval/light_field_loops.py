"""Compiled loops of `light_field`: silhouettes, moments, outlines, pairings of views."""

import numpy as np
from numba import njit

# The eight neighbors of a pixel, row and column, clockwise from the left
ROW = np.array([0, -1, -1, -1, 0, 1, 1, 1])
COLUMN = np.array([-1, -1, 0, 1, 1, 1, 0, -1])


@njit(nogil=True, cache=True)
def silhouette(points, faces, size, slack, thinnest):
    """Return which pixel centers of a square picture lie in a face; points are in pixels."""
    image = np.zeros((size, size), dtype=np.bool_)
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        ax, ay = points[a, 0], points[a, 1]
        bx, by = points[b, 0] - ax, points[b, 1] - ay
        cx, cy = points[c, 0] - ax, points[c, 1] - ay
        doubled = bx * cy - by * cx
        if abs(doubled) <= thinnest:
            continue
        left = max(int(np.ceil(ax + min(0.0, bx, cx) - 0.5)), 0)
        right = min(int(np.floor(ax + max(0.0, bx, cx) - 0.5)), size - 1)
        top = max(int(np.ceil(ay + min(0.0, by, cy) - 0.5)), 0)
        bottom = min(int(np.floor(ay + max(0.0, by, cy) - 0.5)), size - 1)
        for row in range(top, bottom + 1):
            y = row + 0.5 - ay
            for column in range(left, right + 1):
                x = column + 0.5 - ax
                one, two = (cy * x - cx * y) / doubled, (bx * y - by * x) / doubled
                if one >= -slack and two >= -slack and 1 - one - two >= -slack:
                    image[row, column] = True
    return image


@njit(nogil=True, cache=True)
def power_sums(x, y, order):
    """Return the sums of z^m |z|^2j over points z = x + iy, for m + 2j up to the order."""
    sums = np.zeros((order + 1, order // 2 + 1), dtype=np.complex128)
    for point in range(len(x)):
        z = complex(x[point], y[point])
        square = x[point] ** 2 + y[point] ** 2
        power = complex(1.0, 0.0)
        for m in range(order + 1):
            term = power
            for j in range((order - m) // 2 + 1):
                sums[m, j] += term
                term *= square
            power *= z
    return sums


@njit(nogil=True, cache=True)
def outline(image, row, column):
    """Return the rows and columns of the pixels passed by Moore's boundary tracing, clockwise.

    The walk starts at the uppermost, and there leftmost, pixel, and ends when its first step would
    be repeated.
    """
    height, width = image.shape
    path = np.empty((4 * height * width, 2), dtype=np.int64)
    path[0] = row, column
    length = 1
    came, first = 0, -1  # the direction to where the walk looks from, and its first step
    here_row, here_column = row, column
    while length < len(path):
        step = -1
        for turn in range(1, 9):
            direction = (came + turn) % 8
            next_row, next_column = here_row + ROW[direction], here_column + COLUMN[direction]
            if 0 <= next_row < height and 0 <= next_column < width and image[next_row, next_column]:
                step = direction
                break
        if step < 0 or (here_row == row and here_column == column and step == first):
            break
        if first < 0:
            first = step
        here_row, here_column = here_row + ROW[step], here_column + COLUMN[step]
        # The last pixel looked at before the step is behind the new one: look on from there.
        came = (step + 5) % 8 if step % 2 else (step + 6) % 8
        path[length] = here_row, here_column
        length += 1
    return path[:length].copy()


@njit(nogil=True, cache=True)
def least_difference(first, second, pairings):
    """Return the least sum of L1 distances of paired views, over light fields and pairings.

    `first` and `second` are (fields, views, numbers), `pairings` (p, views).
    """
    views, numbers = first.shape[1], first.shape[2]
    table = np.empty((views, views))
    best = np.inf
    for one in range(len(first)):
        for two in range(len(second)):
            for i in range(views):
                for j in range(views):
                    total = 0.0
                    for number in range(numbers):
                        total += abs(first[one, i, number] - second[two, j, number])
                    table[i, j] = total
            for pairing in range(len(pairings)):
                total = 0.0
                for i in range(views):
                    total += table[i, pairings[pairing, i]]
                best = min(best, total)
    return best
