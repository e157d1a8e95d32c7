"""Nested dissection of a graph: an order of elimination with few entries in the factor."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from jaxtyping import Int

from eigenshape.sparse.dissection_loops import (
    LEAF,
    WORD,
    breadth_first,
    count_cuts,
    order_leaf,
    smooth_keys,
    take_sides,
)

Indices = Int[np.ndarray, " ..."]
# Units of distance per edge: smoothing needs values between whole edges.
FINE = 64


def dissect(indptr: Indices, indices: Indices) -> Indices:
    """Return an order of the points of a graph in which separators come last (George 1973).

    Each segment of the graph is cut in two. The key of a point is the difference of its distances,
    in edges, from two points that are far apart. Of all cuts at a value of the key, the one with
    the fewest points relative to its smaller side is taken. Small segments are ordered by minimum
    degree.

    This loop runs once per segment of some hundred points, so only the functions that it calls are
    compiled.

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
    bits = np.empty(LEAF * -(-n // WORD), dtype=np.int64)
    leaf = np.full(n, -1), np.empty(LEAF, dtype=np.int64), np.empty(LEAF, dtype=np.int64), bits
    measure_distances = partial(breadth_first, indptr, indices)
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
            ends = _find_pieces(measure_distances, segment, owner, name, one, queue)
            nodes[start:stop] = queue[:size]
            place[segment] = np.arange(start, stop)
            waiting += [(start + low, start + high, True) for low, high in pairwise([0, *ends])]
            continue
        reached = measure_distances(segment[0], owner, name, one, queue)
        reached = measure_distances(queue[reached - 1], owner, name, one, queue)
        measure_distances(queue[reached - 1], owner, name, two, queue)
        key[segment] = FINE * (one[segment] - two[segment])
        smooth_keys(indptr, indices, segment, owner, name, key, one)
        low, high = key[segment].min(), key[segment].max()
        counts = np.zeros((3, high - low + 2), dtype=np.int64)
        n_joined = count_cuts(indptr, indices, segment, owner, name, key, low, *counts)
        cut_at, above = _cheapest_cut(counts.cumsum(axis=1))
        # If half of all pairs are joined, no order saves much, and cuts of one point each take
        # long.
        full = 2 * n_joined >= size * size
        side = np.empty(size, dtype=np.int8)
        level = low + cut_at
        take_sides(indptr, indices, segment, owner, name, key, level, above, side)
        n_first, _, n_cut = np.bincount(side, minlength=3)
        parted = n_first > 0 and n_first + n_cut < size
        if n_cut in (0, size) or (
            full and not parted
        ):  # nearly a clique, or nothing is left to cut
            owner[segment] = -1
            continue
        nodes[start:stop] = segment[np.argsort(side, kind="stable")]
        place[segment] = np.arange(start, stop)
        middle, cut = start + n_first, stop - n_cut
        owner[nodes[cut:stop]] = -1
        waiting += [
            (first, last, False) for first, last in ((start, middle), (middle, cut)) if first < last
        ]
    return nodes


def _find_pieces(
    measure_distances: Callable[..., int],
    segment: Indices,
    owner: Indices,
    name: int,
    distance: Indices,
    queue: Indices,
) -> list[int]:
    """Fill `queue` with the points of one connected piece of a segment after the other.

    Returns the ends of the pieces in it. `measure_distances` is `breadth_first` on the graph;
    `distance` is scratch.
    """
    ends = []
    total = 0
    for root in segment:
        if total == len(segment):
            break
        if owner[root] == name:
            rest = queue[total:]
            found = measure_distances(root, owner, name, distance, rest)
            owner[rest[:found]] = 0  # no segment's name
            total += found
            ends.append(total)
    return ends


def _cheapest_cut(counts: Int[np.ndarray, "3 v"]) -> tuple[int, bool]:
    """Return the value of the cheapest cut, and whether the cut is taken from above.

    A cut separates key < value from key ≥ value. For each value, `counts` has the number of points
    below it, on the cut from above, and on the cut from below. The cheapest cut has the fewest
    points relative to its smaller side.
    """
    smaller = np.minimum(counts[0], counts[0, -1] - counts[0])
    costs = np.full((len(smaller), 2), np.inf)
    np.divide(counts[1:].T + 1, smaller[:, None], out=costs, where=smaller[:, None] > 0)
    value, from_below = divmod(int(costs.argmin()), 2)
    return value, not from_below
