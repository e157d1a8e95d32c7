"""Nested dissection of a graph: an order of elimination with few entries in the factor."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import chain, count, pairwise

import numpy as np
from jaxtyping import Int

from certeig.kit.threads import SpareMemory, free_threads, map_in_threads
from certeig.sparse.dissection_loops import (
    LEAF,
    WORD,
    breadth_first,
    cheapest_cut,
    count_cuts,
    narrow_cut,
    order_leaf,
    smooth_keys,
    take_sides,
)

Indices = Int[np.ndarray, " ..."]
# Units of distance per edge: smoothing needs values between whole edges.
FINE = 64
# Segments into which a graph is cut before threads share them,
SEGMENTS_TO_SHARE = 16
# and points of a segment that is worth a thread.
WORTH_A_THREAD = 4000
# Neighbors a point, itself included, from which on a graph may be that of a solid: surfaces have 7,
# tetrahedra 14. It is one if the square of the points on a cut exceeds these neighbors times the
# points that are cut: on surfaces it is half as much, however far their neighbors reach. The
# separators of a solid are most of its factor, so that other cuts compete there and the best is
# narrowed: 0.4 of the multiplications are left. On surfaces 0.9 would be (measured), which costs
# more than it saves.
DENSE = 10
# Points far apart whose distances make the keys in a solid. In a cube these are corners, and the cut
# across the diagonal of the first two is larger than others.
SOLID_ENDS = 4
CUT = 2  # a side of a segment, as `take_sides` numbers them


@dataclass(frozen=True)
class _Segment:
    """Points nodes[start:stop] that are still to be ordered.

    Also whether they are known to be connected, and to be part of a solid.
    """

    start: int
    stop: int
    connected: bool
    solid: bool

    @property
    def size(self) -> int:
        """Number of points."""
        return self.stop - self.start


def dissect(indptr: Indices, indices: Indices, leaf: int = LEAF) -> Indices:
    """Return an order of the points of a graph in which separators come last (George 1973).

    Each segment of the graph is cut in two. The key of a point is the difference of its distances,
    in edges, from two points that are far apart. Of all cuts at a value of the key, the one with
    the fewest points relative to its smaller side is taken. In solids several keys compete, and the
    cut is narrowed. Small segments are ordered by minimum degree. Threads share the segments: what
    becomes of one does not depend on the others.

    Segments are taken one after the other, some hundred points each, so only the functions that do
    something to all points of one are in C.

    Parameters
    ----------
    indptr, indices : int64
        The neighbors of each point; the graph is symmetric.
    leaf : int
        Most points of a segment that is ordered by minimum degree, LEAF or fewer.
    """
    n = len(indptr) - 1
    dissection = _Dissection(indptr, indices, leaf)
    waiting, name = [_Segment(0, n, False, False)], 1
    # Rounds of cuts side by side, until there are segments for all threads; names may be any that
    # are not in use.
    while free_threads() > 1 and 0 < len(waiting) < SEGMENTS_TO_SHARE:
        if max(segment.size for segment in waiting) < WORTH_A_THREAD:
            break
        named = list(zip(waiting, count(name), strict=False))
        name += len(named)
        parts = map_in_threads(lambda each: dissection.cut(*each), named)
        waiting = list(chain.from_iterable(parts))
    waiting.sort(key=lambda segment: -segment.size)
    names = range(name, name + (n + 1) * len(waiting), n + 1)
    map_in_threads(lambda each: dissection.finish(*each), zip(waiting, names, strict=True))
    return dissection.nodes


class _Dissection:
    """The order so far, and memory in which segments have places of their own."""

    def __init__(self, indptr: Indices, indices: Indices, leaf: int) -> None:
        n = len(indptr) - 1
        self.graph, self.leaf = (indptr, indices), leaf
        neighbors = len(indices) / max(n, 1)
        # Points on a cut, squared, over the points that it cuts, from which on these are of a solid
        self.solid_cut = neighbors if neighbors >= DENSE else np.inf
        self.nodes, self.place = np.arange(n), np.arange(n)  # nodes[place[v]] = v
        # The name of the segment that a point lies in; -1 when its place is final.
        self.owner = np.zeros(n, dtype=np.int64)
        self.one, self.queue, self.key, self.via = np.empty((4, n), dtype=np.int64)
        bits = LEAF * -(-n // WORD)
        self.leaf_memory = SpareMemory(
            lambda: (
                np.full(n, -1),
                np.empty(LEAF, dtype=np.int64),
                np.empty(LEAF, dtype=np.int64),
                np.empty(bits, dtype=np.int64),
            )
        )

    def finish(self, segment: _Segment, name: int) -> None:
        """Order all points of a segment; names from the given one on are free."""
        waiting = [segment]
        while waiting:
            waiting += self.cut(waiting.pop(), name)
            name += 1

    def cut(self, segment: _Segment, name: int) -> list[_Segment]:
        """Order a small segment, or give a large one its name and cut it; return what is left of it."""
        start, stop, graph = segment.start, segment.stop, self.graph
        if segment.size <= self.leaf:
            with self.leaf_memory.lend() as memory:
                order_leaf(*graph, self.nodes, start, stop, self.owner, self.place, *memory)
            return []
        points, owner = self.nodes[start:stop], self.owner
        owner[points] = name
        queue = self.queue[start:stop]
        if not segment.connected:
            measure = partial(breadth_first, *graph)
            ends = _find_pieces(measure, points, owner, name, self.one, queue)
            points[:] = queue
            self.place[points] = np.arange(start, stop)
            return [
                _Segment(start + low, start + high, True, segment.solid)
                for low, high in pairwise([0, *ends])
            ]
        numbers = self._sort_by_sides(points, name, queue, segment.solid)
        if numbers is None:
            owner[points] = -1
            return []
        n_first, n_cut, solid = numbers
        self.place[points] = np.arange(start, stop)
        middle, cut = start + n_first, stop - n_cut
        owner[points[segment.size - n_cut :]] = -1
        halves = _Segment(start, middle, False, solid), _Segment(middle, cut, False, solid)
        return [half for half in halves if half.size]

    def _sort_by_sides(
        self, points: Indices, name: int, queue: Indices, solid: bool
    ) -> tuple[int, int, bool] | None:
        """Sort a segment: below the cheapest cut, above it, on it.

        Return the first and the last number, and whether the segment is part of a solid.
        None where it is nearly a clique, or nothing would be left beside the cut.
        """
        graph, owner, key, one = self.graph, self.owner, self.key, self.one
        size = len(points)
        side = np.empty(size, dtype=np.int8)
        lowest = np.inf
        # A search from any point ends far away, one from there farther, and so on. The distances
        # from two of these ends make a key. The first search has found this piece, and left its
        # points in the order in which it came to them.
        queue[-1] = points[-1]
        distances: list[Indices] = []
        for n_before in range(SOLID_ENDS):
            end = points[np.min(distances, axis=0).argmax()] if n_before > 1 else queue[-1]
            breadth_first(*graph, end, owner, name, one, queue)
            latest = one[points]
            for earlier in distances:
                key[points] = FINE * (earlier - latest)
                low, high = smooth_keys(*graph, points, owner, name, key, one)
                counts = np.zeros((3, high - low + 2), dtype=np.int64)
                n_joined = count_cuts(*graph, points, owner, name, key, low, *counts)
                cut_at, from_above, cost = cheapest_cut(size, *counts)
                if n_before == 1 or cost < lowest:
                    lowest = cost
                    take_sides(*graph, points, owner, name, key, low + cut_at, from_above, side)
            distances.append(latest)
            n_cut = int(np.count_nonzero(side == CUT))
            solid = solid or bool(n_cut**2 > self.solid_cut * size)
            if n_before == 1 and not solid:
                break
        else:
            narrow_cut(*graph, points, owner, name, key, one, self.via, queue, side)
        n_first, _, n_cut = np.bincount(side, minlength=3).tolist()
        # If half of all pairs are joined, no order saves much, and cuts of one point each take
        # long.
        full = 2 * n_joined >= size * size
        parted = n_first > 0 and n_first + n_cut < size
        if n_cut in (0, size) or (full and not parted):
            return None
        points[:] = points[np.argsort(side, kind="stable")]
        return n_first, n_cut, solid


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
