"""Kernels of `merge_tree`: sort the sides of faces by edge, and join faces across them.

Here the number of a vertex is its rank; the lowest vertex is 0. Sides are grouped by the higher
vertex of their edge, so a loop over falling ranks visits the edges in falling order, and only the
few sides at one vertex must be sorted.
"""

import numpy as np
from jaxtyping import Bool, Int, Int32, Int64

from certeig.kit.kernels import Out, kernel

Corners = Int32[np.ndarray, "f 3"]
FaceNumbers = Int32[np.ndarray, " f"]
Sides = Int32[np.ndarray, " f*3"]
Points = Int64[np.ndarray, " n"]
Indices = Int64[np.ndarray, " _"]


@kernel("f")
def find_corners(
    faces: Int64[np.ndarray, "f 3"],
    rank: Int32[np.ndarray, " n"],
    corners: Out[Corners],
) -> None:
    """Fill the ranks of each face's corners, highest first."""


@kernel("f")
def file_sides(
    corners: Corners,
    place: Out[Points],
    lower: Out[Sides],
    owner: Out[Sides],
) -> None:
    """Group the three sides of each face by their higher vertex.

    Fills the lower vertex and the face of each side. The sides of vertex v begin at place[v], which
    is moved to their end.
    """


@kernel("n")
def join_faces(
    corners: Corners,
    starts: Int64[np.ndarray, "n+1"],
    lower: Out[Sides],
    owner: Out[Sides],
    climbs_to: Out[FaceNumbers],
    highest: Out[FaceNumbers],
    ended: Out[Int32[np.ndarray, "_ 4"]],
) -> int:
    """Join faces across edges in falling order; return the number of basins that end.

    `climbs_to` is filled with the face to which each face climbs. For each basin that ends, `ended`
    is filled with the basin, the edge and the neighbor. On entry, `climbs_to` and `highest` hold
    the number of each face; `highest` is scratch.

    A face whose highest edge leads to a higher face joins its basin at once. Basins are joined as
    in Kruskal's algorithm: the one with the lower maximum ends.
    """


def join_points(
    starts: Int[np.ndarray, " _"], neighbors: Int[np.ndarray, " _"], order: Points
) -> tuple[Points, Int64[np.ndarray, "ended 2"]]:
    """Add points in the given order, and join each to its neighbors that are already there.

    Returns the first point of each point's component and, for each component that was joined to an
    earlier one, its first point and the point that joined them.
    """
    n = len(order)
    place, root = np.empty(n, dtype=np.int64), np.arange(n)
    place[order] = root
    ended = np.empty((n, 2), dtype=np.int64)
    graph = starts.astype(np.int64, copy=False), neighbors.astype(np.int64, copy=False)
    n_ended = add_points(*graph, np.ascontiguousarray(order), place, root, ended)
    return root, ended[:n_ended].copy()


@kernel("n")
def add_points(
    starts: Int64[np.ndarray, "n+1"],
    neighbors: Indices,
    order: Points,
    place: Points,
    root: Out[Points],
    ended: Out[Int64[np.ndarray, "n 2"]],
) -> int:
    """Fill roots and endings of `join_points`; return the number of endings.

    `place` is the inverse of the order. On entry, `root` holds the number of each point.
    """


def spanning_forest(
    ends: Int64[np.ndarray, "m 2"], order: Int64[np.ndarray, " m"], n: int
) -> Bool[np.ndarray, " m"]:
    """Return, for each edge, whether it joins two components when edges are added in order."""
    joins = np.zeros(len(ends), dtype=np.bool_)
    add_edges(ends, np.ascontiguousarray(order), np.arange(n), joins)
    return joins


@kernel("m")
def add_edges(
    ends: Int64[np.ndarray, "m 2"],
    order: Int64[np.ndarray, " m"],
    root: Out[Points],
    joins: Out[Bool[np.ndarray, " m"]],
) -> None:
    """Mark the edges that join two components; on entry, `root` holds the number of each point."""
