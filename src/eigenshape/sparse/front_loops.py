"""Compiled loops of `elimination`: L D Lᵀ front by front, and solves with it.

The caller allocates all arrays: compiling an allocation takes longer than compiling a small loop.
"""

from typing import no_type_check

from eigenshape._compile import njit
from eigenshape.sparse.dense_loops import LONG, NARROW, eliminate_blocked, eliminate_plain
from eigenshape.sparse.lane_loops import LANES, subtract_four_sums, subtract_sum

WIDE = 64  # columns to a panel of L: 32 rows of them are 16 KiB, half of the nearest cache
SMALL = 40  # rows of a front up to which plain loops are the faster ones (measured)
NEAR = 32  # rows of a panel that stay in the nearest cache


@njit
@no_type_check
def stack_size(first, begins, above, waiting):
    """Return the most numbers that updates waiting for their parents take, and the rows of the largest front.

    `waiting` is scratch, filled with 0.
    """
    now = most = tallest = 0
    for s in range(len(above)):
        rows = begins[s + 1] - begins[s]
        tallest = max(tallest, rows)
        now -= waiting[s]
        rest = rows - (first[s + 1] - first[s])
        now += rest * rest
        most = max(most, now)
        if above[s] >= 0:
            waiting[above[s]] += rest * rest
    return most, tallest


@njit
@no_type_check
def sum_lengths(first, begins, above, children, lengths):
    """Raise `lengths`, filled with LONG, to how many roundings a product may see in each front, on its way from below.

    A front adds what each child left; then halves of its columns update others, LONG terms at a time. `children` is
    scratch, filled with 0.
    """
    for s in range(len(lengths)):
        height, width = begins[s + 1] - begins[s], first[s + 1] - first[s]
        own = width
        if height > SMALL:
            own, span = width // LONG + 2, NARROW
            while span < width:
                own, span = own + 1, 2 * span
        lengths[s] += own + children[s]
        if above[s] >= 0:
            children[above[s]] += 1
            lengths[above[s]] = max(lengths[above[s]], lengths[s])


@njit
@no_type_check
def factor_fronts(
    lower_ptr,
    lower_rows,
    values,
    first,
    begins,
    rows,
    above,
    places,
    panels,
    pivots,
    room,
    children,
    blas,
):
    """Fill panels and pivots with L and D of a matrix whose lower triangle is given by columns; tell if it could be.

    Multifrontal (Duff and Reid 1983), pivots in their order: a front gathers the entries of its columns and what its
    children left, eliminates its columns, and leaves the rest to its parent.

    `room` is memory for the updates that wait, for two fronts, for a place of each row (n) and for the fronts that wait
    (s); `children` counts those of each front.
    """
    size = len(first) - 1
    stack, space, times, local, waiting = room
    n_waiting = top = 0
    for s in range(size):
        low, high, start = first[s], first[s + 1], begins[s]
        height, width = begins[s + 1] - start, high - low
        front = space[: height * height].reshape(height, height)
        for i in range(height):
            for j in range(height):
                front[i, j] = 0.0
        for i in range(height):
            local[rows[start + i]] = i
        for j in range(low, high):
            for at in range(lower_ptr[j], lower_ptr[j + 1]):
                front[local[lower_rows[at]], j - low] += values[at]
        for _ in range(children[s]):
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
            sound = eliminate_plain(front, width, pivots[low:high])
        else:
            sound = eliminate_blocked(
                front, width, pivots[low:high], times[: height * width].reshape(height, width), blas
            )
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


@njit
@no_type_check
def solve_fronts(order, first, begins, rows, places, panels, pivots, right, solution, room):
    """Solve for LANES right-hand sides (n, LANES); the solution may take the place of the right-hand sides."""
    n, size = len(pivots), len(first) - 1
    lanes, gathered, near = room
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
            _backward(
                panels, at, columns, rows[start + block : start + height], lanes, gathered, near
            )
    for i in range(n):
        for lane in range(LANES):
            solution[order[i], lane] = lanes[i, lane]


@njit
@no_type_check
def _forward(panels, at, columns, rows, lanes, gathered):
    mine, height = rows[0], len(rows)
    for i in range(1, columns):
        subtract_sum(panels, at + i * columns, 1, 0, lanes, mine, i, lanes, mine + i)
    rest = height - columns
    for i in range(rest):
        for lane in range(LANES):
            gathered[i, lane] = 0.0
    four = rest // 4 * 4
    for i in range(0, four, 4):
        subtract_four_sums(
            panels, at + (columns + i) * columns, 1, columns, lanes, mine, columns, gathered, i
        )
    for i in range(four, rest):
        subtract_sum(panels, at + (columns + i) * columns, 1, 0, lanes, mine, columns, gathered, i)
    for i in range(rest):
        row = rows[columns + i]
        for lane in range(LANES):
            lanes[row, lane] += gathered[i, lane]


@njit
@no_type_check
def _backward(panels, at, columns, rows, lanes, gathered, near):
    mine, height = rows[0], len(rows)
    rest = height - columns
    for i in range(rest):
        row = rows[columns + i]
        for lane in range(LANES):
            gathered[i, lane] = lanes[row, lane]
    below, four = at + columns * columns, columns // 4 * 4
    for low in range(0, rest, NEAR):
        count, corner = min(NEAR, rest - low), below + low * columns
        for i in range(count * columns):
            near[i] = panels[corner + i]
        for j in range(0, four, 4):
            subtract_four_sums(near, j, columns, 1, gathered, low, count, lanes, mine + j)
        for j in range(four, columns):
            subtract_sum(near, j, columns, 0, gathered, low, count, lanes, mine + j)
    for j in range(columns - 2, -1, -1):
        subtract_sum(
            panels,
            at + (j + 1) * columns + j,
            columns,
            0,
            lanes,
            mine + j + 1,
            columns - 1 - j,
            lanes,
            mine + j,
        )


@njit
@no_type_check
def column_sizes(first, begins, places, panels, sizes):
    """Fill the sums of the columns of |L|."""
    for s in range(len(first) - 1):
        at, height, width = places[s], begins[s + 1] - begins[s], first[s + 1] - first[s]
        for block in range(0, width, WIDE):
            columns = min(WIDE, width - block)
            mine = first[s] + block
            for j in range(columns):
                sizes[mine + j] = 0.0
            for _ in range(block, height):
                for j in range(columns):
                    sizes[mine + j] += abs(panels[at + j])
                at += columns


@njit
@no_type_check
def row_sizes(first, begins, rows, places, panels, weights, sizes, terms):
    """Add |L| weights to `sizes`, and how many entries of L each row has to `terms`."""
    for s in range(len(first) - 1):
        at, start, height, width = (
            places[s],
            begins[s],
            begins[s + 1] - begins[s],
            first[s + 1] - first[s],
        )
        for block in range(0, width, WIDE):
            columns = min(WIDE, width - block)
            mine = first[s] + block
            for i in range(block, height):
                total = 0.0
                for j in range(columns):
                    total += abs(panels[at + j]) * weights[mine + j]
                sizes[rows[start + i]] += total
                terms[rows[start + i]] += min(columns, i - block + 1)
                at += columns
