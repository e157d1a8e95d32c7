"""Compiled loops of `rigidity`: the best rotation at each vertex, and the rotated edges."""

import numpy as np

from eigenshape._compile import njit

# Most steps of a fit. Newton's method takes a few; the rest is for starts far from the maximum.
MOST_NEWTON_STEPS = 100
# A step that turns by less, in radians, is the last: Newton's next one would be of its square.
SETTLED = 1e-4
# Added to the Hessian, as a share of the largest covariance, so that a rotation which the edges do
# not determine keeps its value.
LEAST = 1e-9
# Length of the gradient, relative to the largest covariance, that is rounding: the fit is done.
GRADIENT_ROUNDING = 1e-15
# Most that one step turns, in radians: the tangent of half the angle has a pole at π.
HALFWAY = 3.0


@njit
def fit_rotations(vertices, starts, others, weights, rest, posed, turns):
    """Update the rotations of some vertices so that they fit the posed edges best.

    The rotation of vertex i maximizes Σ_j w_ij e'_ij · R e_ij. It is a unit quaternion, real part
    first, in `turns`, which also holds the start of the iteration. If the edges do not determine a
    rotation, it keeps its value. Returns the remaining energy, Σ_ij w_ij |R_i e_ij - e'_ij|² / 2.
    """
    covariance = np.empty((3, 3))
    left = 0.0
    for place in range(len(vertices)):
        i = vertices[place]
        lengths = 0.0
        for a in range(3):
            for b in range(3):
                covariance[a, b] = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, w = others[k], weights[k]
            u, v, t = (
                posed[j, 0] - posed[i, 0],
                posed[j, 1] - posed[i, 1],
                posed[j, 2] - posed[i, 2],
            )
            lengths += w * (u * u + v * v + t * t)
            for a in range(3):
                before = rest[j, a] - rest[i, a]
                lengths += w * before * before
                before *= w
                covariance[a, 0] += before * u
                covariance[a, 1] += before * v
                covariance[a, 2] += before * t
        left += lengths - 2 * _settle(covariance, turns, i)
    return left / 2


@njit
def _settle(covariance, turns, i):
    """Maximize by Newton steps, or by safe steps where it is not concave; return the maximum."""
    w, x, y, z = turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3]
    largest = 0.0
    for row in range(3):
        for column in range(3):
            largest = max(largest, abs(covariance[row, column]))
    if largest > 0.0:  # its cube is used below
        for row in range(3):
            for column in range(3):
                covariance[row, column] /= largest
    for _ in range(MOST_NEWTON_STEPS if largest > 0.0 else 0):
        m00, m01, m02 = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
        m10, m11, m12 = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
        m20, m21, m22 = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
        p00 = m00 * covariance[0, 0] + m01 * covariance[1, 0] + m02 * covariance[2, 0]
        p01 = m00 * covariance[0, 1] + m01 * covariance[1, 1] + m02 * covariance[2, 1]
        p02 = m00 * covariance[0, 2] + m01 * covariance[1, 2] + m02 * covariance[2, 2]
        p10 = m10 * covariance[0, 0] + m11 * covariance[1, 0] + m12 * covariance[2, 0]
        p11 = m10 * covariance[0, 1] + m11 * covariance[1, 1] + m12 * covariance[2, 1]
        p12 = m10 * covariance[0, 2] + m11 * covariance[1, 2] + m12 * covariance[2, 2]
        p20 = m20 * covariance[0, 0] + m21 * covariance[1, 0] + m22 * covariance[2, 0]
        p21 = m20 * covariance[0, 1] + m21 * covariance[1, 1] + m22 * covariance[2, 1]
        p22 = m20 * covariance[0, 2] + m21 * covariance[1, 2] + m22 * covariance[2, 2]
        u, v, t = p12 - p21, p20 - p02, p01 - p10
        size = np.sqrt(u * u + v * v + t * t)
        if size <= GRADIENT_ROUNDING:
            break
        a, b, c = p11 + p22 + LEAST, p00 + p22 + LEAST, p00 + p11 + LEAST
        d, e, f = -(p01 + p10) / 2, -(p02 + p20) / 2, -(p12 + p21) / 2
        second = a * b - d * d
        third = second * c - a * f * f + 2 * d * e * f - b * e * e
        if a > 0.0 and second > 0.0 and third > 0.0:
            u, v, t = (
                (u * (b * c - f * f) + v * (e * f - d * c) + t * (d * f - b * e)) / third,
                (u * (e * f - d * c) + v * (a * c - e * e) + t * (d * e - a * f)) / third,
                (u * (d * f - b * e) + v * (d * e - a * f) + t * second) / third,
            )
            angle = np.sqrt(u * u + v * v + t * t)
            u, v, t = u / 2, v / 2, t / 2
        else:
            along = (
                p00 * u * u + p11 * v * v + p22 * t * t - 2 * (d * u * v + e * u * t + f * v * t)
            ) / size**2
            angle = np.arctan2(size, p00 + p11 + p22 - along)  # the best about this axis
            half = np.tan(min(angle, HALFWAY) / 2) / size
            u, v, t = u * half, v * half, t * half
        # The quaternion of a turn is (1, tan(angle / 2) axis); small turns need no tangent.
        w, x, y, z = (
            w - u * x - v * y - t * z,
            x + u * w + v * z - t * y,
            y - u * z + v * w + t * x,
            z + u * y - v * x + t * w,
        )
        shrink = 1 / np.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * shrink, x * shrink, y * shrink, z * shrink
        if angle < SETTLED:
            break
    height = (1 - 2 * (y * y + z * z)) * covariance[0, 0] + 2 * (x * y - w * z) * covariance[1, 0]
    height += 2 * (x * z + w * y) * covariance[2, 0] + 2 * (x * y + w * z) * covariance[0, 1]
    height += (1 - 2 * (x * x + z * z)) * covariance[1, 1] + 2 * (y * z - w * x) * covariance[2, 1]
    height += 2 * (x * z - w * y) * covariance[0, 2] + 2 * (y * z + w * x) * covariance[1, 2]
    height += (1 - 2 * (x * x + y * y)) * covariance[2, 2]
    turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = w, x, y, z
    return height * largest


@njit
def turn_edges(vertices, starts, others, weights, rest, turns, sums):
    """Write Σ_j w_ij ((R_i + R_j)/2 - 1) (x_i - x_j) to `sums` for some vertices."""
    n = len(turns)
    spins = np.empty((n, 3, 3))  # (R - 1)/2
    for i in range(n):
        w, x, y, z = turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3]
        s = spins[i]
        s[0, 0], s[0, 1], s[0, 2] = -(y * y + z * z), x * y - w * z, x * z + w * y
        s[1, 0], s[1, 1], s[1, 2] = x * y + w * z, -(x * x + z * z), y * z - w * x
        s[2, 0], s[2, 1], s[2, 2] = x * z - w * y, y * z + w * x, -(x * x + y * y)
    for place in range(len(vertices)):
        i = vertices[place]
        sums[place, 0] = sums[place, 1] = sums[place, 2] = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, weight = others[k], weights[k]
            x, y, z = rest[i, 0] - rest[j, 0], rest[i, 1] - rest[j, 1], rest[i, 2] - rest[j, 2]
            p, q = spins[i], spins[j]
            for row in range(3):
                turned = (p[row, 0] + q[row, 0]) * x + (p[row, 1] + q[row, 1]) * y
                turned += (p[row, 2] + q[row, 2]) * z
                sums[place, row] += weight * turned
