"""Compiled loops of `elimination`: L D Lᵀ front by front, and solves with it.

The caller allocates all arrays: compiling an allocation takes longer than compiling a small loop.
"""

from eigenshape._compile import njit
from eigenshape.sparse.dense_loops import eliminate_blocked, eliminate_plain
from eigenshape.sparse.lane_loops import (
    LANES,
    add_row,
    clear_row,
    copy_row,
    divide_row,
    fetch_row,
    subtract_four_sums,
    subtract_sum,
    write_four_negative_sums,
    write_negative_sum,
)

WIDE = 64  # columns in a panel of L: 32 of its rows are 16 KiB, half of the first-level cache
SMALL = 40  # rows of a front up to which plain loops are faster (measured)
NEAR = 32  # rows of a panel that fit into the first-level cache
SOON = 64  # cache lines of the next panel that are asked for ahead (measured)


@njit
def factor_fronts(tree, lower, panels, pivots, updates, room, begin, end, top, blas):
    """Fill panels and pivots with L and D of the fronts begin to end - 1, which are one task.

    This is the multifrontal method (Duff and Reid 1983) without pivoting: a front gathers the
    entries of its columns and the updates of its children, eliminates its columns, and passes the
    rest to its parent as an update.

    `tree` is the elimination, `lower` the matrix by the columns of its lower triangle, `updates`
    memory for updates and the place of each, `room` memory for two fronts and a number for each
    row. The updates of a task are a stack of lower triangles, row by row, from `top` on. Returns
    whether all pivots are finite and not zero.
    """
    first, begins, rows, last_child, older, panel_places = tree
    lower_ptr, lower_rows, values = lower
    stack, places = updates
    front, times, local = room
    for s in range(begin, end):
        height, width = begins[s + 1] - begins[s], first[s + 1] - first[s]
        for i in range(height * height):
            front[i] = 0.0
        for i in range(height):
            local[rows[begins[s] + i]] = i
        for j in range(first[s], first[s + 1]):
            for at in range(lower_ptr[j], lower_ptr[j + 1]):
                front[local[lower_rows[at]] * height + j - first[s]] += values[at]
        child = last_child[s]
        while child >= 0:
            skip = begins[child] + first[child + 1] - first[child]
            count = begins[child + 1] - skip
            for i in range(count):
                target = local[rows[skip + i]] * height
                given = places[child] + i * (i + 1) // 2
                for j in range(i + 1):
                    front[target + local[rows[skip + j]]] += stack[given + j]
            if child >= begin:
                top -= count * (count + 1) // 2
            child = older[child]
        if height <= SMALL:
            sound = eliminate_plain(front, height, width, pivots, first[s])
        else:
            sound = eliminate_blocked(front, height, width, pivots, first[s], times, blas)
        if not sound:
            return False
        at = panel_places[s]
        for block in range(0, width, WIDE):
            stop = min(block + WIDE, width)
            for i in range(block, height):
                for j in range(block, stop):
                    panels[at] = front[i * height + j]
                    at += 1
        count = height - width
        places[s] = top
        for i in range(count):
            given, to = (width + i) * height + width, top + i * (i + 1) // 2
            for j in range(i + 1):
                stack[to + j] = front[given + j]
        top += count * (count + 1) // 2
    return True


@njit
def solve_lower(tree, tasks, panels, right, lanes, gathered, begin, end):
    """Fill rows of `lanes` with L⁻¹ times the right-hand sides, in the order of elimination.

    The rows of tasks begin to end - 1; `tree` and `tasks` are the elimination and its tasks.
    """
    order, first, begins, places = tree
    fronts, rows, own_rows, fetches, fetched, to = tasks
    for task in range(begin, end):
        for i in range(first[fronts[task]], first[fronts[task + 1]]):
            copy_row(right, order[i], lanes, i)
        for row in range(own_rows[task], own_rows[task + 1]):
            clear_row(lanes, row)
        for i in range(fetches[task], fetches[task + 1]):
            add_row(lanes, fetched[i], lanes, to[i])
        for s in range(fronts[task], fronts[task + 1]):
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
def solve_upper(tree, rows, fronts, panels, pivots, lanes, solution, gathered, begin, end):
    """Fill rows of `solution` with L⁻ᵀ D⁻¹ times the result of `solve_lower` in `lanes`.

    The rows of tasks begin to end - 1, in the order of the matrix. `gathered` is
    scratch.
    """
    order, first, begins, places = tree
    for task in range(end - 1, begin - 1, -1):
        for i in range(first[fronts[task]], first[fronts[task + 1]]):
            divide_row(lanes, i, pivots[i])
        for s in range(fronts[task + 1] - 1, fronts[task] - 1, -1):
            height, width = begins[s + 1] - begins[s], first[s + 1] - first[s]
            stop = places[s + 1]
            # Memory is read backward, which processors do not foresee.
            soon = places[max(s - 1, 0)] // LANES
            for line in range(soon, min(soon + SOON, stop // LANES)):
                fetch_row(panels, line)
            for block in range((width - 1) // WIDE * WIDE, -1, -WIDE):
                columns, mine = min(WIDE, width - block), first[s] + block
                rest = height - block - columns
                below = stop - rest * columns
                at = below - columns * columns
                for i in range(rest):
                    copy_row(lanes, rows[begins[s + 1] - rest + i], gathered, i)
                four = columns // 4 * 4
                for low in range(0, rest, NEAR):
                    count, corner = min(NEAR, rest - low), below + low * columns
                    for j in range(0, four, 4):
                        subtract_four_sums(
                            panels, corner + j, columns, 1, gathered, low, count, lanes, mine + j
                        )
                    for j in range(four, columns):
                        subtract_sum(
                            panels, corner + j, columns, 0, gathered, low, count, lanes, mine + j
                        )
                # Row by row, so that rows above do not wait for one another.
                for i in range(columns - 1, 0, -1):
                    row, four = at + i * columns, i // 4 * 4
                    for j in range(0, four, 4):
                        subtract_four_sums(
                            panels, row + j, 0, 1, lanes, mine + i, 1, lanes, mine + j
                        )
                    for j in range(four, i):
                        subtract_sum(panels, row + j, 0, 0, lanes, mine + i, 1, lanes, mine + j)
                stop = at
        for i in range(first[fronts[task]], first[fronts[task + 1]]):
            copy_row(lanes, i, solution, order[i])


@njit
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
            # Above the diagonal, panels of large fronts keep numbers that are not of L.
            for i in range(height):
                for j in range(min(columns, i + 1)):
                    weights[mine + j] += abs(panels[at + i * columns + j])
            for j in range(columns):
                weights[mine + j] *= abs(pivots[mine + j])
            for i in range(height):
                total = 0.0
                for j in range(min(columns, i + 1)):
                    total += abs(panels[at + i * columns + j]) * weights[mine + j]
                sizes[rows[top + i]] += total
                terms[rows[top + i]] += min(columns, i + 1)
            at += height * columns
