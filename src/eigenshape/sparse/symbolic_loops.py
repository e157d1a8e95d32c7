"""Compiled loops of `elimination`: which entries a factor has, before any is computed.

The caller allocates all arrays, also those that a loop needs only while it runs, and sorts: compiling an allocation, or
NumPy's sort, takes longer than compiling the loop that uses it.
"""

from typing import no_type_check

from eigenshape._compile import njit

# A supernode joins the next one while few of the entries are zeros that the factor would not have. The numbers are
# columns of both together, and the largest share of such zeros; they are the defaults of CHOLMOD (`nrelax`, `zrelax`).
ALWAYS = 4
OFTEN, OFTEN_ZEROS = 16, 0.8
RARELY, RARELY_ZEROS = 48, 0.1
BEYOND_ZEROS = 0.05


@njit
@no_type_check
def find_parents(indptr, indices, order, place, parent, ancestor):
    """Fill the parent of each column of the factor, columns in the order given; -1 at a root (Liu 1990).

    `place` is the inverse of `order`; `parent` and `ancestor` come filled with -1, and the second is scratch.
    """
    for i in range(len(order)):
        node = order[i]
        for at in range(indptr[node], indptr[node + 1]):
            k = place[indices[at]]
            while k != -1 and k < i:
                following = ancestor[k]
                ancestor[k] = i
                if following == -1:
                    parent[k] = i
                k = following


@njit
@no_type_check
def postorder(parent, first_child, sibling, stack, order):
    """Fill `order` with the columns, every subtree in one piece, children before parents.

    `first_child` and `sibling` come filled with -1; both and `stack` are scratch.
    """
    n = len(parent)
    for i in range(n - 1, -1, -1):
        if parent[i] >= 0:
            sibling[i] = first_child[parent[i]]
            first_child[parent[i]] = i
    size = 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        stack[0] = root
        top = 1
        while top:
            node = stack[top - 1]
            child = first_child[node]
            if child >= 0:
                first_child[node] = sibling[child]
                stack[top] = child
                top += 1
            else:
                order[size] = node
                size += 1
                top -= 1


@njit
@no_type_check
def count_entries(indptr, indices, order, place, parent, mark, counts):
    """Count the entries of each column of the factor, its diagonal among them.

    `mark` comes filled with -1 and is scratch; `counts` comes filled with 1.
    """
    for i in range(len(order)):
        node = order[i]
        mark[i] = i
        for at in range(indptr[node], indptr[node + 1]):
            k = place[indices[at]]
            while k < i and mark[k] != i:
                counts[k] += 1
                mark[k] = i
                k = parent[k]


@njit
@no_type_check
def join_runs(parent, first, heights, widths, zeros, keep):
    """Join runs of columns with (nearly) the same entries, and say of each run whether it stays the first of its front.

    A run begins at column `first`, and has so many rows (`heights`) and columns (`widths`), which grow where others
    join it. `zeros` is scratch, filled with 0; `keep` comes filled with True.
    """
    for s in range(len(first) - 2, -1, -1):  # s + 1 is by now the first of what it has joined
        up = parent[first[s + 1] - 1]
        if up < first[s + 1] or up >= first[s + 1] + widths[s + 1]:
            continue
        columns = widths[s] + widths[s + 1]
        rows = widths[s] + heights[s + 1]  # exactly: all other rows of s are rows of its parent too
        lost = zeros[s + 1] + widths[s] * (rows - heights[s])
        share = lost / (columns * (columns + 1) / 2 + columns * (rows - columns))
        if (
            columns <= ALWAYS
            or lost == 0
            or (columns <= OFTEN and share < OFTEN_ZEROS)
            or (columns <= RARELY and share < RARELY_ZEROS)
            or share < BEYOND_ZEROS
        ):
            keep[s + 1] = False
            widths[s] = columns
            heights[s] = rows
            zeros[s] = lost


@njit
@no_type_check
def find_front_rows(
    indptr, indices, order, place, first, begins, above, rows, first_child, sibling, mark
):
    """Fill for each supernode the rows of its front, from rows[begins[s]] on: its own columns first.

    The others are those that it is joined with, and what its children pass on, in any order. `first_child`, `sibling`
    and `mark` come filled with -1 and are scratch.
    """
    for s in range(len(above)):
        high, stop = first[s + 1], begins[s]
        for j in range(first[s], high):
            rows[stop] = j
            stop += 1
        for j in range(first[s], high):
            node = order[j]
            for at in range(indptr[node], indptr[node + 1]):
                i = place[indices[at]]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    rows[stop] = i
                    stop += 1
        child = first_child[s]
        while child >= 0:
            for at in range(begins[child], begins[child + 1]):
                i = rows[at]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    rows[stop] = i
                    stop += 1
            child = sibling[child]
        if above[s] >= 0:
            sibling[s] = first_child[above[s]]
            first_child[above[s]] = s
