"""Nested dissection of a graph: an order of elimination with few entries in the factor."""

import numpy as np
from jaxtyping import Int

from eigenshape.sparse.dissection_loops import (
    LEAF,
    WORD,
    breadth_first,
    cheapest_cut,
    find_pieces,
    order_leaf,
    take_sides,
    tell_apart,
)

Indices = Int[np.ndarray, " ..."]


def dissect(indptr: Indices, indices: Indices) -> Indices:
    """Return the points of a graph, separators after what they separate (George 1973).

    Two points far from each other are found, and every point is told by how much nearer it is to one than to the
    other, in edges; of all cuts at a value of that difference the shortest for its smaller side is taken. What is small
    is ordered by minimum degree.

    This runs once for each segment of some hundred points, so it need not be compiled; what it calls is.

    Parameters
    ----------
    indptr, indices : int64
        The neighbors of each point; the graph is symmetric.
    """
    n = len(indptr) - 1
    nodes, place = np.arange(n), np.arange(n)  # nodes[place[v]] = v
    owner = np.zeros(
        n, dtype=np.int64
    )  # the name of the segment that a point lies in; -1 when its place is final
    one, two, queue, key = (np.empty(n, dtype=np.int64) for _ in range(4))
    side = np.empty(n, dtype=np.int8)
    bits = np.empty(LEAF * -(-n // WORD), dtype=np.uint64)
    leaf = np.full(n, -1), np.empty(LEAF, dtype=np.int64), np.empty(LEAF, dtype=np.int64), bits
    waiting = [(0, n, False)]
    name = 0
    while waiting:
        start, stop, connected = waiting.pop()
        size = stop - start
        if size <= LEAF:
            order_leaf(indptr, indices, nodes, start, stop, owner, place, *leaf)
            continue
        segment = nodes[start:stop]
        name += 1
        owner[segment] = name
        if not connected:
            n_pieces = find_pieces(indptr, indices, segment, owner, name, one, queue, two)
            nodes[start:stop] = queue[:size]
            place[segment] = np.arange(start, stop)
            ends = [start, *(start + two[:n_pieces])]
            waiting += [(ends[i], ends[i + 1], True) for i in range(n_pieces)]
            name += n_pieces
            continue
        reached = breadth_first(indptr, indices, segment[0], owner, name, one, queue)
        reached = breadth_first(indptr, indices, queue[reached - 1], owner, name, one, queue)
        breadth_first(indptr, indices, queue[reached - 1], owner, name, two, queue)
        low, high = tell_apart(indptr, indices, segment, owner, name, one, two, key)
        scratch = np.zeros((3, high - low + 2), dtype=np.int64)
        level, above, full = cheapest_cut(indptr, indices, segment, owner, name, key, low, *scratch)
        n_first, n_cut = take_sides(indptr, indices, segment, owner, name, key, level, above, side)
        parted = n_first > 0 and n_first + n_cut < size
        if n_cut in (0, size) or (
            full and not parted
        ):  # a clique or nearly, or nothing left to cut
            owner[segment] = -1
            continue
        nodes[start:stop] = segment[np.argsort(side[segment], kind="stable")]
        place[segment] = np.arange(start, stop)
        middle, cut = start + n_first, stop - n_cut
        owner[nodes[cut:stop]] = -1
        waiting += [
            (first, last, False) for first, last in ((start, middle), (middle, cut)) if first < last
        ]
    return nodes
