"""Compiled loops of `elimination`: symbolic analysis, which finds the entries of a factor.

The caller allocates all arrays, also scratch, and sorts them: compiling an allocation or NumPy's
sort takes longer than compiling the loop that uses it.
"""

from eigenshape._compile import njit

# Supernodes are merged if the merged one stores few zeros that the factor does not need. The
# numbers are the columns of the merged supernode and the largest share of such zeros, the defaults
# of CHOLMOD (`nrelax`, `zrelax`).
ALWAYS = 4
OFTEN, OFTEN_ZEROS = 16, 0.8
RARELY, RARELY_ZEROS = 48, 0.1
BEYOND_ZEROS = 0.05


@njit
def find_dominated(indptr, indices, order, leader, mark):
    """Fill the place, in an order of points, of the first that dominates each other point.

    Point v dominates its neighbor u if it is joined to all neighbors of u; of two points that
    dominate each other, the first in the order does. A point that is dominated itself is passed
    over: what dominates it dominates all that it does. `leader` and `mark` come filled with -1;
    `mark` is scratch.
    """
    for place in range(len(order)):
        v = order[place]
        if leader[v] >= 0:
            continue
        mark[v] = v
        for at in range(indptr[v], indptr[v + 1]):
            mark[indices[at]] = v
        for at in range(indptr[v], indptr[v + 1]):
            u = indices[at]
            if u == v or leader[u] >= 0:
                continue
            inside = True
            for other in range(indptr[u], indptr[u + 1]):
                if mark[indices[other]] != v:
                    inside = False
                    break
            if inside:
                leader[u] = place


@njit
def find_parents(indptr, indices, order, place, parent, ancestor):
    """Fill the elimination tree: the parent of each column, -1 at a root (Liu 1990).

    Columns are numbered in the given order; `place` is its inverse. `parent` and `ancestor` come
    filled with -1; `ancestor` is scratch.
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
def postorder(parent, first_child, sibling, stack, order):
    """Fill `order` with a postorder of the columns: children first, each subtree contiguous.

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
def count_entries(indptr, indices, order, place, parent, mark, counts):
    """Count the entries of each column of the factor, with the diagonal.

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
def join_runs(parent, first, heights, widths, zeros, keep):
    """Merge supernodes with nearly the same entries; `keep` tells which ones remain.

    Each supernode is a run of columns. It begins at column `first` and has `heights` rows and
    `widths` columns, which grow when it absorbs the next one. `keep` becomes False for a supernode
    that is absorbed. `zeros` is scratch, filled with 0; `keep` comes filled with True.
    """
    for s in range(len(first) - 2, -1, -1):  # s + 1 has already absorbed those after it
        up = parent[first[s + 1] - 1]
        if up < first[s + 1] or up >= first[s + 1] + widths[s + 1]:
            continue
        columns = widths[s] + widths[s + 1]
        rows = widths[s] + heights[s + 1]  # exact: all other rows of s are also rows of its parent
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
def find_front_rows(
    indptr, indices, order, place, first, begins, above, rows, first_child, sibling, mark
):
    """Fill the rows of the front of each supernode s, from rows[begins[s]] on.

    Its own columns come first. Then follow, in any order, the rows of its columns' entries and
    those that its children pass on. `first_child`, `sibling` and `mark` are scratch, filled with
    -1.
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
