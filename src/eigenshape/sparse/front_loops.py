"""Compiled loops of `elimination`: L D Lᵀ front by front, and solves with it."""

from typing import no_type_check

import numpy as np
from numba import njit

from eigenshape.sparse.lane_loops import LANES, subtract_four_sums, subtract_sum

WIDE = 64  # columns eliminated at once
SMALL = 40  # rows of a front up to which plain loops are the faster ones
TALL = 96  # rows of an update at once


@njit(cache=True, nogil=True)
@no_type_check
def panel_places(first, begins):
    """Return where the panels of each front begin among all entries: at most WIDE columns to a panel."""
    size = len(first) - 1
    places = np.zeros(size + 1, dtype=np.int64)
    for s in range(size):
        rows, columns = begins[s + 1] - begins[s], first[s + 1] - first[s]
        total = 0
        for start in range(0, columns, WIDE):
            total += (rows - start) * min(WIDE, columns - start)
        places[s + 1] = places[s] + total
    return places


@njit(cache=True, nogil=True)
@no_type_check
def stack_size(first, begins, above):
    """Return the most numbers that updates waiting for their parents take, and the rows of the largest front."""
    size = len(first) - 1
    waiting = np.zeros(size, dtype=np.int64)
    now = most = tallest = 0
    for s in range(size):
        rows = begins[s + 1] - begins[s]
        tallest = max(tallest, rows)
        now -= waiting[s]
        rest = rows - (first[s + 1] - first[s])
        now += rest * rest
        most = max(most, now)
        if above[s] >= 0:
            waiting[above[s]] += rest * rest
    return most, tallest


@njit(cache=True, nogil=True)
@no_type_check
def factor_fronts(lower_ptr, lower_rows, values, first, begins, rows, above, places, panels, pivots, room):
    """Fill panels and pivots with L and D of a matrix whose lower triangle is given by columns; tell if it could be.

    Multifrontal (Duff and Reid 1983), pivots in their order: a front gathers the entries of its columns and what its
    children left, eliminates its columns, and leaves the rest to its parent.
    """
    size = len(first) - 1
    stack = np.empty(room[0])
    space = np.empty(room[1] * room[1])
    local = np.empty(len(pivots), dtype=np.int64)
    n_children = np.zeros(size, dtype=np.int64)
    for s in range(size):
        if above[s] >= 0:
            n_children[above[s]] += 1
    waiting, n_waiting, top = np.empty(size, dtype=np.int64), 0, 0
    for s in range(size):
        low, high, start = first[s], first[s + 1], begins[s]
        height, width = begins[s + 1] - start, high - low
        front = space[: height * height].reshape(height, height)
        front[:] = 0.0
        for i in range(height):
            local[rows[start + i]] = i
        for j in range(low, high):
            for at in range(lower_ptr[j], lower_ptr[j + 1]):
                front[local[lower_rows[at]], j - low] += values[at]
        for _ in range(n_children[s]):
            n_waiting -= 1
            child = waiting[n_waiting]
            skip = begins[child] + first[child + 1] - first[child]
            count = begins[child + 1] - skip
            top -= count * count
            for i in range(count):
                target, given = local[rows[skip + i]], top + i * count
                for j in range(i + 1):
                    front[target, local[rows[skip + j]]] += stack[given + j]
        if height <= SMALL:
            sound = _eliminate_plain(front, width, pivots[low:high])
        else:
            sound = _eliminate_blocked(front, width, pivots[low:high])
        if not sound:
            return False
        at = places[s]
        for block in range(0, width, WIDE):
            end = min(block + WIDE, width)
            for i in range(block, height):
                for j in range(block, end):
                    panels[at] = front[i, j]
                    at += 1
        count = height - width
        for i in range(count):
            for j in range(i + 1):
                stack[top + i * count + j] = front[width + i, width + j]
        top += count * count
        if above[s] >= 0:
            waiting[n_waiting] = s
            n_waiting += 1
    return True


@njit(cache=True, nogil=True)
@no_type_check
def _eliminate_plain(front, width, pivots):
    height = len(front)
    for j in range(width):
        pivot = front[j, j]
        if pivot == 0 or not np.isfinite(pivot):
            return False
        pivots[j] = pivot
        front[j, j] = 1.0
        for i in range(j + 1, height):
            share = front[i, j] / pivot
            if share != 0:
                for k in range(j + 1, i + 1):
                    front[i, k] -= share * front[k, j]
        for i in range(j + 1, height):
            front[i, j] /= pivot
    return True


@njit(cache=True, nogil=True)
@no_type_check
def _eliminate_blocked(front, width, pivots):
    height = len(front)
    for block in range(0, width, WIDE):
        end = min(block + WIDE, width)
        columns = end - block
        panel = np.empty((height - block, columns))
        for i in range(height - block):
            for j in range(columns):
                panel[i, j] = front[block + i, block + j]
        for j in range(columns):
            pivot = panel[j, j]
            if pivot == 0 or not np.isfinite(pivot):
                return False
            pivots[block + j] = pivot
            for i in range(j + 1, columns):
                times_pivot = panel[i, j]
                panel[i, j] /= pivot
                for k in range(j + 1, i + 1):
                    panel[i, k] -= times_pivot * panel[k, j]
        # Row i of the rest: L_i = A_i L⁻ᵀ D⁻¹, the products L_ij D_j being kept until all are known.
        for i in range(columns, height - block):
            for j in range(columns):
                known = panel[i, j]
                for k in range(j):
                    known -= panel[i, k] * panel[j, k]
                panel[i, j] = known
        times = panel[columns:].copy()
        for i in range(columns, height - block):
            for j in range(columns):
                panel[i, j] /= pivots[block + j]
        for i in range(height - block):
            for j in range(min(i, columns)):
                front[block + i, block + j] = panel[i, j]
            if i < columns:
                front[block + i, block + i] = 1.0
        rest = panel[columns:]
        for start in range(0, len(rest), TALL):
            stop = min(start + TALL, len(rest))
            update = np.dot(rest[start:stop], times[:stop].T)
            for i in range(start, stop):
                for j in range(i + 1):
                    front[end + i, end + j] -= update[i - start, j]
    return True


@njit(cache=True, nogil=True)
@no_type_check
def solve_fronts(order, first, begins, rows, places, panels, pivots, right, solution):
    """Solve for LANES right-hand sides (n, LANES)."""
    n, size = len(pivots), len(first) - 1
    lanes = np.empty((n, LANES))
    gathered = np.empty((len(right), LANES))
    for i in range(n):
        for lane in range(LANES):
            lanes[i, lane] = right[order[i], lane]
    for s in range(size):
        at, start, height = places[s], begins[s], begins[s + 1] - begins[s]
        width = first[s + 1] - first[s]
        for block in range(0, width, WIDE):
            columns = min(WIDE, width - block)
            _forward(panels, at, columns, rows[start + block : start + height], lanes, gathered)
            at += (height - block) * columns
    for i in range(n):
        for lane in range(LANES):
            lanes[i, lane] /= pivots[i]
    for s in range(size - 1, -1, -1):
        start, height = begins[s], begins[s + 1] - begins[s]
        width = first[s + 1] - first[s]
        at = places[s + 1]
        for block in range((width - 1) // WIDE * WIDE, -1, -WIDE):
            columns = min(WIDE, width - block)
            at -= (height - block) * columns
            _backward(panels, at, columns, rows[start + block : start + height], lanes, gathered)
    for i in range(n):
        for lane in range(LANES):
            solution[order[i], lane] = lanes[i, lane]


@njit(cache=True, nogil=True)
@no_type_check
def _forward(panels, at, columns, rows, lanes, gathered):
    mine, height = rows[0], len(rows)
    for i in range(1, columns):
        subtract_sum(panels, at + i * columns, 1, 0, lanes, mine, i, lanes, mine + i)
    rest = height - columns
    gathered[:rest] = 0.0
    four = rest // 4 * 4
    for i in range(0, four, 4):
        subtract_four_sums(panels, at + (columns + i) * columns, 1, columns, lanes, mine, columns, gathered, i)
    for i in range(four, rest):
        subtract_sum(panels, at + (columns + i) * columns, 1, 0, lanes, mine, columns, gathered, i)
    for i in range(rest):
        row = rows[columns + i]
        for lane in range(LANES):
            lanes[row, lane] += gathered[i, lane]


@njit(cache=True, nogil=True)
@no_type_check
def _backward(panels, at, columns, rows, lanes, gathered):
    mine, height = rows[0], len(rows)
    rest = height - columns
    for i in range(rest):
        row = rows[columns + i]
        for lane in range(LANES):
            gathered[i, lane] = lanes[row, lane]
    below = at + columns * columns
    four = columns // 4 * 4
    for j in range(0, four, 4):
        subtract_four_sums(panels, below + j, columns, 1, gathered, 0, rest, lanes, mine + j)
    for j in range(four, columns):
        subtract_sum(panels, below + j, columns, 0, gathered, 0, rest, lanes, mine + j)
    for j in range(columns - 2, -1, -1):
        subtract_sum(
            panels, at + (j + 1) * columns + j, columns, 0, lanes, mine + j + 1, columns - 1 - j, lanes, mine + j
        )


@njit(cache=True, nogil=True)
@no_type_check
def column_sizes(first, begins, places, panels, sizes):
    """Fill the sums of the columns of |L|."""
    for s in range(len(first) - 1):
        at, height, width = places[s], begins[s + 1] - begins[s], first[s + 1] - first[s]
        for block in range(0, width, WIDE):
            columns = min(WIDE, width - block)
            sums = sizes[first[s] + block : first[s] + block + columns]
            sums[:] = 0.0
            for _ in range(block, height):
                for j in range(columns):
                    sums[j] += abs(panels[at + j])
                at += columns


@njit(cache=True, nogil=True)
@no_type_check
def row_sizes(first, begins, rows, places, panels, weights, sizes, terms):
    """Fill |L| weights, and how many entries of L each row has."""
    sizes[:] = 0.0
    terms[:] = 0
    for s in range(len(first) - 1):
        at, start, height, width = places[s], begins[s], begins[s + 1] - begins[s], first[s + 1] - first[s]
        for block in range(0, width, WIDE):
            columns = min(WIDE, width - block)
            mine = weights[first[s] + block : first[s] + block + columns]
            for i in range(block, height):
                total = 0.0
                for j in range(columns):
                    total += abs(panels[at + j]) * mine[j]
                sizes[rows[start + i]] += total
                terms[rows[start + i]] += min(columns, i - block + 1)
                at += columns
