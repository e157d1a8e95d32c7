"""Kernels of merge trees and diagrams: join faces over edges, and points over links, in order.

Here the number of a vertex is its rank; the lowest vertex is 0. Sides are grouped by the higher
vertex of their edge, so a loop over falling ranks visits the edges in falling order, and only the
few sides at one vertex must be sorted.
"""

import numpy as np
from jaxtyping import Bool, Int, Int32, Int64

from eigenshape._kernels import Out, kernel


@kernel("f")
def find_corners(
    faces: Int64[np.ndarray, "f 3"],
    rank: Int32[np.ndarray, " n"],
    corners: Out[Int32[np.ndarray, "f 3"]],
) -> None:
    """Fill the ranks of each face's corners, highest first."""


@kernel("f")
def file_sides(
    corners: Int32[np.ndarray, "f 3"],
    place: Out[Int64[np.ndarray, " n"]],
    lower: Out[Int32[np.ndarray, " 3*f"]],
    owner: Out[Int32[np.ndarray, " 3*f"]],
) -> None:
    """Group the three sides of each face by their higher vertex.

    Fills the lower vertex and the face of each side. The sides of vertex v begin at place[v], which
    is moved to their end.
    """


@kernel("n_starts - 1")
def join_faces(
    corners: Int32[np.ndarray, "f 3"],
    starts: Int64[np.ndarray, " n_starts"],
    lower: Out[Int32[np.ndarray, " 3*f"]],
    owner: Out[Int32[np.ndarray, " 3*f"]],
    climbs_to: Out[Int32[np.ndarray, " f"]],
    highest: Out[Int32[np.ndarray, " f"]],
    ended: Out[Int32[np.ndarray, "f 4"]],
) -> int:
    """Join faces across edges in falling order; return the number of basins that end.

    `climbs_to` is filled with the face to which each face climbs. For each basin that ends, `ended`
    is filled with the basin, the edge and the neighbor. On entry, `climbs_to` and `highest` hold
    the number of each face; `highest` is scratch.

    A face whose highest edge leads to a higher face joins its basin at once. Basins are joined as
    in Kruskal's algorithm: the one with the lower maximum ends.
    """


def join_points(
    starts: Int[np.ndarray, " n1"], neighbors: Int[np.ndarray, " k"], order: Int64[np.ndarray, " n"]
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, "e 2"]]:
    """Add points in the given order, and join each to its neighbors that are already there.

    Returns the first point of each point's component and, for each component that was joined to an
    earlier one, its first point and the point that joined them.
    """
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    root, ended = np.arange(n), np.empty((n, 2), dtype=np.int64)
    links = np.asarray(starts, dtype=np.int64), np.asarray(neighbors, dtype=np.int32)
    n_ended = add_points(*links, np.ascontiguousarray(order), place, root, ended)
    return root, ended[:n_ended].copy()


@kernel("n")
def add_points(
    starts: Int64[np.ndarray, " n_starts"],
    neighbors: Int32[np.ndarray, " k"],
    order: Int64[np.ndarray, " n_starts-1"],
    place: Int64[np.ndarray, " n"],
    root: Out[Int64[np.ndarray, " n"]],
    ended: Out[Int64[np.ndarray, "n 2"]],
) -> int:
    """Fill the results of `join_points`, and return how many components were joined.

    `place` is the inverse of `order`; `root` holds the number of each point on entry.
    """


def spanning_forest(
    ends: Int64[np.ndarray, "e 2"], order: Int64[np.ndarray, " e"], n: int
) -> Bool[np.ndarray, " e"]:
    """Return, for each edge, whether it joins two components when edges are added in order."""
    joins = np.empty(len(ends), dtype=bool)
    add_edges(ends, np.ascontiguousarray(order), np.arange(n), joins)
    return joins


@kernel("e")
def add_edges(
    ends: Int64[np.ndarray, "e 2"],
    order: Int64[np.ndarray, " e"],
    root: Out[Int64[np.ndarray, " n"]],
    joins: Out[Bool[np.ndarray, " e"]],
) -> None:
    """Fill the result of `spanning_forest`; `root` holds the number of each point on entry."""
