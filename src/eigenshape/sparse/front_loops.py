"""Compiled loops of `elimination`: L D Lᵀ front by front, and solves with it.

The caller allocates all arrays: compiling an allocation takes longer than compiling a small loop.
"""

from typing import no_type_check

from eigenshape._compile import njit
from eigenshape.sparse.dense_loops import eliminate_blocked, eliminate_plain
from eigenshape.sparse.lane_loops import (
    add_row,
    copy_row,
    divide_row,
    subtract_four_sums,
    subtract_sum,
    write_four_negative_sums,
    write_negative_sum,
)

WIDE = 64  # columns in a panel of L: 32 of its rows are 16 KiB, half of the first-level cache
SMALL = 40  # rows of a front up to which plain loops are faster (measured)
NEAR = 32  # rows of a panel that fit into the first-level cache


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
    """Fill panels and pivots with L and D of a matrix; return whether all pivots are usable.

    The matrix is given by the columns of its lower triangle. This is the multifrontal method (Duff
    and Reid 1983) without pivoting: a front gathers the entries of its columns and the updates of
    its children, eliminates its columns, and passes the rest to its parent as an update.

    `room` is memory for the stack of updates, for two fronts, for one number per row (n) and one
    per front (s). `children` is the number of children of each front.
    """
    size = len(first) - 1
    stack, front, times, local, waiting = room
    n_waiting = top = 0
    for s in range(size):
        low, high, start = first[s], first[s + 1], begins[s]
        height, width = begins[s + 1] - start, high - low
        for i in range(height * height):
            front[i] = 0.0
        for i in range(height):
            local[rows[start + i]] = i
        for j in range(low, high):
            for at in range(lower_ptr[j], lower_ptr[j + 1]):
                front[local[lower_rows[at]] * height + j - low] += values[at]
        for _ in range(children[s]):
            n_waiting -= 1
            child = waiting[n_waiting]
            skip = begins[child] + first[child + 1] - first[child]
            count = begins[child + 1] - skip
            top -= count * count
            for i in range(count):
                target, given = local[rows[skip + i]] * height, top + i * count
                for j in range(i + 1):
                    front[target + local[rows[skip + j]]] += stack[given + j]
        if height <= SMALL:
            sound = eliminate_plain(front, height, width, pivots, low)
        else:
            sound = eliminate_blocked(front, height, width, pivots, low, times, blas)
        if not sound:
            return False
        at = places[s]
        for block in range(0, width, WIDE):
            end = min(block + WIDE, width)
            for i in range(block, height):
                for j in range(block, end):
                    panels[at] = front[i * height + j]
                    at += 1
        count = height - width
        for i in range(count):
            given = (width + i) * height + width
            for j in range(i + 1):
                stack[top + i * count + j] = front[given + j]
        top += count * count
        if above[s] >= 0:
            waiting[n_waiting] = s
            n_waiting += 1
    return True


@njit
@no_type_check
def solve_lower(order, first, begins, rows, places, panels, right, lanes, gathered):
    """Fill `lanes` (n, LANES) with L⁻¹ times the right-hand sides, in the order of elimination."""
    for i in range(len(order)):
        copy_row(right, order[i], lanes, i)
    for s in range(len(first) - 1):
        at = places[s]
        for mine in range(first[s], first[s + 1], WIDE):
            # A panel is a triangle in the rows of its own columns, and a rectangle below.
            columns = min(WIDE, first[s + 1] - mine)
            below = begins[s] + mine - first[s] + columns
            rest = begins[s + 1] - below
            for i in range(1, columns):
                subtract_sum(panels, at + i * columns, 1, 0, lanes, mine, i, lanes, mine + i)
            at += columns * columns
            four = rest // 4 * 4
            for i in range(0, four, 4):
                write_four_negative_sums(
                    panels, at + i * columns, 1, columns, lanes, mine, columns, gathered, i
                )
            for i in range(four, rest):
                write_negative_sum(
                    panels, at + i * columns, 1, 0, lanes, mine, columns, gathered, i
                )
            for i in range(rest):
                add_row(gathered, i, lanes, rows[below + i])
            at += rest * columns


@njit
@no_type_check
def solve_upper(
    order, first, begins, rows, places, panels, pivots, lanes, solution, gathered, near
):
    """Fill `solution` (n, LANES) with L⁻ᵀ D⁻¹ times the result of `solve_lower` in `lanes`.

    Rows are in the order of the matrix. `gathered` and `near` are scratch.
    """
    for i in range(len(order)):
        divide_row(lanes, i, pivots[i])
    for s in range(len(first) - 2, -1, -1):
        height, width = begins[s + 1] - begins[s], first[s + 1] - first[s]
        end = places[s + 1]
        for block in range((width - 1) // WIDE * WIDE, -1, -WIDE):
            columns, mine = min(WIDE, width - block), first[s] + block
            rest = height - block - columns
            below = end - rest * columns
            at = below - columns * columns
            for i in range(rest):
                copy_row(lanes, rows[begins[s + 1] - rest + i], gathered, i)
            four = columns // 4 * 4
            for low in range(0, rest, NEAR):
                count, corner = min(NEAR, rest - low), below + low * columns
                for i in range(count * columns):
                    near[i] = panels[corner + i]
                for j in range(0, four, 4):
                    subtract_four_sums(near, j, columns, 1, gathered, low, count, lanes, mine + j)
                for j in range(four, columns):
                    subtract_sum(near, j, columns, 0, gathered, low, count, lanes, mine + j)
            for j in range(columns - 2, -1, -1):
                count, given = columns - 1 - j, mine + j + 1
                place = at + (j + 1) * columns + j
                subtract_sum(panels, place, columns, 0, lanes, given, count, lanes, mine + j)
            end = at
    for i in range(len(order)):
        copy_row(lanes, i, solution, order[i])


@njit
@no_type_check
def add_sizes(first, begins, rows, places, panels, pivots, weights, sizes, terms):
    """Add the row sums of |L||D||L|ᵀ to `sizes`, and the number of entries per row of L to `terms`.

    All entries of a column are in one panel, so its sum |D||L|ᵀ 1 is complete before the rows of
    the panel are weighted by it. `weights` is scratch, filled with 0.
    """
    for s in range(len(first) - 1):
        at = places[s]
        for mine in range(first[s], first[s + 1], WIDE):
            columns = min(WIDE, first[s + 1] - mine)
            top = begins[s] + mine - first[s]
            height = begins[s + 1] - top
            for i in range(height):
                for j in range(columns):
                    weights[mine + j] += abs(panels[at + i * columns + j])
            for j in range(columns):
                weights[mine + j] *= abs(pivots[mine + j])
            for i in range(height):
                total = 0.0
                for j in range(columns):
                    total += abs(panels[at + i * columns + j]) * weights[mine + j]
                sizes[rows[top + i]] += total
                terms[rows[top + i]] += min(columns, i + 1)
            at += height * columns
