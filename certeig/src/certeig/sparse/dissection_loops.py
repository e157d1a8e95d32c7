"""Kernels of `dissection`: operations on one segment of a graph.

A graph is given by int64 pointers and neighbors. The points of a segment are those whose `owner` is
its name.
"""

import numpy as np
from jaxtyping import Int8, Int64

from certeig.kit.kernels import Out, kernel

LEAF = 160  # most points of a segment that is ordered by minimum degree
WORD = 63  # bits of an int64 in a set of neighbors, without its sign

Pointers = Int64[np.ndarray, "n+1"]
Points = Int64[np.ndarray, " n"]
Some = Int64[np.ndarray, " _"]
Segment = Int64[np.ndarray, " size"]
Counts = Int64[np.ndarray, " count"]


@kernel()
def breadth_first(
    indptr: Pointers,
    indices: Some,
    root: int,
    owner: Out[Points],
    name: int,
    distance: Out[Points],
    queue: Out[Some],
) -> int:
    """Fill the distances from a root within a segment; return the number of points reached.

    `queue` is filled with these points by distance.
    """


@kernel("size")
def smooth_keys(
    indptr: Pointers,
    indices: Some,
    segment: Segment,
    owner: Points,
    name: int,
    key: Out[Points],
    smoothed: Out[Points],
) -> tuple[int, int]:
    """Smooth the keys within a segment, which shortens cuts; return the least and the largest.

    `smoothed` is scratch.
    """


@kernel("size")
def count_cuts(
    indptr: Pointers,
    indices: Some,
    segment: Segment,
    owner: Points,
    name: int,
    key: Points,
    low: int,
    below: Out[Counts],
    from_above: Out[Counts],
    from_below: Out[Counts],
) -> int:
    """Count the points below and on the cut at each value of the keys.

    `low` is the smallest key. The last three arrays come filled with 0 and have one entry for each
    value from `low` to the largest key plus 1. Their cumulative sums, which `cheapest_cut` takes, are
    the number of points below the value, and the number of points on the cut if it is taken from
    above or from below.

    Returns the number of entries of the adjacency matrix within the segment.
    """


@kernel("count")
def cheapest_cut(
    size: int, below: Counts, from_above: Counts, from_below: Counts
) -> tuple[int, bool, float]:
    """Return the place of the value at which a cut costs least, whether from above, and its cost.

    The cost is the points on the cut, and one more, over those on its smaller side, of `size` in
    all. The arrays are those of `count_cuts`.
    """


@kernel("size")
def take_sides(
    indptr: Pointers,
    indices: Some,
    segment: Segment,
    owner: Points,
    name: int,
    key: Points,
    level: int,
    above: bool,
    side: Out[Int8[np.ndarray, " size"]],
) -> None:
    """Fill the side of each point of a segment: 0 below the level, 1 above, 2 on the cut."""


@kernel("size")
def narrow_cut(
    indptr: Pointers,
    indices: Some,
    segment: Segment,
    owner: Points,
    name: int,
    sides: Out[Points],
    partner: Out[Points],
    via: Out[Points],
    queue: Out[Segment],
    side: Out[Int8[np.ndarray, " size"]],
) -> None:
    """Replace sides by some with a cut that costs as much or less, found by bipartite matchings (Liu 1989).

    Take the edges between the cut and one side. The fewest points that meet all of them are a cut as
    well: the other points of the old cut have no neighbor left on that side, and go to the opposite
    one. With a largest matching (Konig 1931) these points are those of the near side that alternating
    paths reach from points of the cut without a partner, and the points of the cut that they do not.
    The other arrays are scratch.
    """


@kernel()
def order_leaf(
    indptr: Pointers,
    indices: Some,
    nodes: Out[Points],
    start: int,
    stop: int,
    owner: Out[Points],
    place: Out[Points],
    local: Out[Points],
    order: Out[Int64[np.ndarray, " leaf"]],
    degree: Out[Int64[np.ndarray, " leaf"]],
    bits: Out[Some],
) -> None:
    """Order a leaf by minimum degree, with its outer neighbors counted in the degrees.

    The segment is nodes[start:stop]. The elimination graph is a matrix of bits. The other arrays
    are scratch: `local` has an entry for each point of the graph, -1 on entry and on return;
    `order` and `degree` have LEAF entries; `bits` has a bit for each of LEAF rows and each point of
    the graph. No neighbor is listed twice.
    """
