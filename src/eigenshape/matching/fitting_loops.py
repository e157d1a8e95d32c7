"""Compiled loops of `fitting`: the pull on frames, and their turns."""

import numpy as np

from eigenshape._compile import njit

MOST_TURNS = 30  # of one frame in one round; it ends at the first small turn
SMALLEST_TURN = 1e-4  # radians; the next round starts from there


@njit
def add_pulls(turns, carriers, portions, arms, pull, targets, right):
    """Add the pull of samples on the frames that carry them, in the current turns of the frames.

    Sample s lies at `arms[s, c]` from frame `carriers[s, c]`, which carries the share
    `portions[s, c]` of it.
    """
    rest = np.empty(3)
    for s in range(len(carriers)):
        for d in range(3):
            rest[d] = targets[s, d]
        for c in range(carriers.shape[1]):
            turn, share = turns[carriers[s, c]], portions[s, c]
            for d in range(3):
                for e in range(3):
                    rest[d] -= share * turn[d, e] * arms[s, c, e]
        for c in range(carriers.shape[1]):
            share = pull[s] * portions[s, c]
            for d in range(3):
                right[carriers[s, c], d] += share * rest[d]


@njit
def add_tensions(turns, one, two, arms, weight, right):
    """Add what edges between frames demand: minus `weight` times the arm in the mean turn."""
    for edge in range(len(one)):
        first, second = turns[one[edge]], turns[two[edge]]
        for d in range(3):
            turned = 0.0
            for e in range(3):
                turned += 0.5 * (first[d, e] + second[d, e]) * arms[edge, e]
            right[one[edge], d] -= weight * turned


@njit
def turn_frames(places, one, two, arms, least, most, turns):
    """Turn each frame to follow its edges, and give it the size that fits them best.

    The nearest rotation is found by small turns from the last one (Müller, Bender, Chentanez and
    Macklin 2016). Sizes are kept between `least` and `most`.
    """
    m = len(places)
    products, squares = np.zeros((m, 3, 3)), np.zeros(m)
    for edge in range(len(one)):
        i, j = one[edge], two[edge]
        for d in range(3):
            moved = places[j, d] - places[i, d]
            squares[i] += arms[edge, d] * arms[edge, d]
            for e in range(3):
                products[i, d, e] += moved * arms[edge, e]
    for i in range(m):
        turn, product = turns[i], products[i]
        size = 0.0
        for d in range(3):
            size += turn[d, 0] * turn[d, 0]
        size = np.sqrt(size)
        for d in range(3):
            for e in range(3):
                turn[d, e] /= size
        inner = _nearest_rotation(product, turn)
        size = min(max(inner / squares[i], least), most) if squares[i] > 0 else 1.0
        for d in range(3):
            for e in range(3):
                turn[d, e] *= size


@njit
def _nearest_rotation(product, turn):
    """Turn a rotation to the one nearest to a matrix, and return their inner product."""
    for _ in range(MOST_TURNS):
        x = y = z = inner = norm = 0.0
        for e in range(3):
            a, b, c = turn[0, e], turn[1, e], turn[2, e]
            u, v, w = product[0, e], product[1, e], product[2, e]
            x += b * w - c * v
            y += c * u - a * w
            z += a * v - b * u
            inner += a * u + b * v + c * w
            norm += u * u + v * v + w * w
        if norm == 0:
            return inner
        reach = abs(inner) + 1e-9 * np.sqrt(norm)
        x, y, z = x / reach, y / reach, z / reach
        angle = np.sqrt(x * x + y * y + z * z)
        if angle < SMALLEST_TURN:
            return inner
        x, y, z = x / angle, y / angle, z / angle
        cosine, sine = np.cos(angle), np.sin(angle)
        for e in range(3):
            a, b, c = turn[0, e], turn[1, e], turn[2, e]
            along = (x * a + y * b + z * c) * (1 - cosine)
            turn[0, e] = a * cosine + (y * c - z * b) * sine + x * along
            turn[1, e] = b * cosine + (z * a - x * c) * sine + y * along
            turn[2, e] = c * cosine + (x * b - y * a) * sine + z * along
    return inner
