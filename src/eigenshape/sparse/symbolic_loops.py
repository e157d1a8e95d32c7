"""Compiled loops of `elimination`: which entries a factor has, before any is computed."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit

# A supernode joins the next one while few of the entries are zeros that the factor would not have (CHOLMOD's rule).
ALWAYS = 4  # columns
OFTEN, OFTEN_ZEROS = 16, 0.8
RARELY, RARELY_ZEROS = 48, 0.1
BEYOND_ZEROS = 0.05


@njit
@no_type_check
def elimination_tree(indptr, indices, order):
    """Return the parent of each column of the factor, columns in the order given; -1 at a root (Liu 1990)."""
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    for i in range(n):
        place[order[i]] = i
    parent, ancestor = np.full(n, -1), np.full(n, -1)
    for i in range(n):
        node = order[i]
        for at in range(indptr[node], indptr[node + 1]):
            k = place[indices[at]]
            while k != -1 and k < i:
                following = ancestor[k]
                ancestor[k] = i
                if following == -1:
                    parent[k] = i
                k = following
    return parent


@njit
@no_type_check
def postordered(parent):
    """Return the columns with every subtree in one piece, children before parents."""
    n = len(parent)
    first_child, sibling = np.full(n, -1), np.full(n, -1)
    for i in range(n - 1, -1, -1):
        if parent[i] >= 0:
            sibling[i] = first_child[parent[i]]
            first_child[parent[i]] = i
    order, stack, size = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        stack[0], top = root, 1
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
    return order


@njit
@no_type_check
def column_counts(indptr, indices, order, parent):
    """Return how many entries each column of the factor has, its diagonal among them."""
    n = len(order)
    place, mark = np.empty(n, dtype=np.int64), np.full(n, -1)
    for i in range(n):
        place[order[i]] = i
    counts = np.ones(n, dtype=np.int64)
    for i in range(n):
        node = order[i]
        mark[i] = i
        for at in range(indptr[node], indptr[node + 1]):
            k = place[indices[at]]
            while k < i and mark[k] != i:
                counts[k] += 1
                mark[k] = i
                k = parent[k]
    return counts


@njit
@no_type_check
def supernodes(parent, counts):
    """Return the first column of each run of columns with (nearly) the same entries, and n at the end."""
    n = len(parent)
    first = np.empty(n + 1, dtype=np.int64)
    size = 0
    for j in range(n):
        if j == 0 or parent[j - 1] != j or counts[j - 1] != counts[j] + 1:
            first[size] = j
            size += 1
    first[size] = n
    keep = np.ones(size, dtype=np.bool_)
    zeros = np.zeros(size)
    wide, tall = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    for s in range(size):
        wide[s], tall[s] = first[s + 1] - first[s], counts[first[s]]
    for s in range(size - 2, -1, -1):  # s + 1 is by now the first of what it has joined
        if (
            parent[first[s + 1] - 1] < first[s + 1]
            or parent[first[s + 1] - 1] >= first[s + 1] + wide[s + 1]
        ):
            continue
        columns = wide[s] + wide[s + 1]
        rows = wide[s] + tall[s + 1]
        lost = zeros[s + 1] + wide[s] * (rows - tall[s])
        share = lost / (columns * (columns + 1) / 2 + columns * (rows - columns))
        if (
            columns <= ALWAYS
            or lost == 0
            or (columns <= OFTEN and share < OFTEN_ZEROS)
            or (columns <= RARELY and share < RARELY_ZEROS)
            or share < BEYOND_ZEROS
        ):
            keep[s + 1] = False
            wide[s], tall[s], zeros[s] = columns, rows, lost
    kept = 0
    for s in range(size):
        if keep[s]:
            first[kept] = first[s]
            kept += 1
    first[kept] = n
    return first[: kept + 1].copy()


@njit
@no_type_check
def front_rows(indptr, indices, order, parent, first):
    """Return for each supernode the rows of its front, ascending: where they begin, the rows, its parent supernode.

    The rows of a front are its own columns, what they are joined with, and what its children pass on.
    """
    n, size = len(order), len(first) - 1
    place, home = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for s in range(size):
        for j in range(first[s], first[s + 1]):
            home[j] = s
            place[order[j]] = j
    above = np.full(size, -1)
    first_child, sibling = np.full(size, -1), np.full(size, -1)
    for s in range(size - 1, -1, -1):
        up = parent[first[s + 1] - 1]
        if up >= 0:
            above[s] = home[up]
            sibling[s] = first_child[above[s]]
            first_child[above[s]] = s
    begins = np.zeros(size + 1, dtype=np.int64)
    rows = np.empty(4 * n + 64, dtype=np.int64)
    mark, found = np.full(n, -1), np.empty(n, dtype=np.int64)
    for s in range(size):
        low, high, count = first[s], first[s + 1], 0
        for j in range(low, high):
            node = order[j]
            for at in range(indptr[node], indptr[node + 1]):
                i = place[indices[at]]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    found[count] = i
                    count += 1
        child = first_child[s]
        while child >= 0:
            for at in range(begins[child], begins[child + 1]):
                i = rows[at]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    found[count] = i
                    count += 1
            child = sibling[child]
        start = begins[s]
        stop = start + (high - low) + count
        if stop > len(rows):
            longer = np.empty(max(2 * len(rows), stop), dtype=np.int64)
            longer[:start] = rows[:start]
            rows = longer
        for j in range(low, high):
            rows[start + j - low] = j
        rows[start + high - low : stop] = np.sort(found[:count])
        begins[s + 1] = stop
    return begins, rows[: begins[size]].copy(), above
