"""Graphs of points and their nearest neighbors."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arrays import positive_number, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import adjacency_matrix, finite_rows
from eigenshape._vectors import size_one
from eigenshape.geometry.topology import unique_edges

SPARE = 8  # neighbors requested beyond those wanted, so that most ties are found in one query


def neighbor_graph(
    points: ArrayLike, n_neighbors: Integer, *, t: float | None = None
) -> sp.csr_array:
    """Build the graph of nearest neighbors of points.

    Two points are joined if one of them is among the nearest neighbors of the other. Weights are
    exp(-|x - y|²/4t) (Belkin and Niyogi 2003; thesis reference 5), or 1 if t is not given. Of
    points at the same distance the one with the lower index counts as nearer; duplicates of a point
    are neighbors at distance 0.

    Parameters
    ----------
    points : (n, d) float
    n_neighbors : int
        1 to n - 1.
    t : float, optional
        Heat time, in length².

    Returns
    -------
    (n, n) sparse
        Symmetric adjacency matrix with zero diagonal.

    Raises
    ------
    InvalidShapeError
        If a coordinate is not finite.
    InvalidParameterError
        If `n_neighbors` is not in 1..n - 1, or t is not positive or so small that a weight
        underflows.

    Examples
    --------
    >>> import eigenshape as es
    >>> graph = es.operators.neighbor_graph([[0.0], [1.0], [3.0]], 1)
    >>> graph.toarray().tolist()
    [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    """
    rows = finite_rows(points, "points")
    wanted = whole_number(n_neighbors, "n_neighbors", 1, len(rows) - 1)
    scaled, scale = size_one(rows)
    near = nearest_others(scaled, wanted)
    edges = unique_edges(np.repeat(np.arange(len(rows)), wanted), near.ravel(), len(rows))
    weights = np.ones(len(edges))
    if t is not None:
        time = positive_number(t, "t")
        squares = ((scaled[edges[:, 0]] - scaled[edges[:, 1]]) ** 2).sum(axis=1)
        with np.errstate(over="ignore"):  # what overflows here is a weight of 0, refused below
            weights = np.exp(-squares / 4 * scale / time * scale)
        bad = np.flatnonzero(weights == 0)
        if bad.size:
            raise InvalidParameterError(
                f"t must let every edge have weight; at t = {time:.4g} edge {tuple(edges[bad[0]].tolist())} of length "
                f"{squares[bad[0]] ** 0.5 * scale:.4g} has exp(-|x - y|²/4t) = 0 ({bad.size} such). Choose a larger t."
            )
    return adjacency_matrix(edges, weights, len(rows))


def nearest_others(points: Float[np.ndarray, "n d"], wanted: int) -> Int[np.ndarray, "n k"]:
    """Return the nearest others of each point, of equals the lower index first."""
    tree, n = cKDTree(points), len(points)
    nearest = np.empty((n, wanted), dtype=np.int64)
    rest, requested = np.arange(n), min(wanted + 1 + SPARE, n)
    while rest.size:
        distance, found = tree.query(points[rest], requested)
        distance[found == rest[:, None]] = -1.0  # itself goes first
        order = np.lexsort((found, distance), axis=1)[:, 1 : wanted + 1]
        nearest[rest] = np.take_along_axis(found, order, axis=1)
        # Where the last found is no farther than the last wanted, nearer indices may lie beyond.
        cut = distance.max(axis=1) <= np.take_along_axis(distance, order[:, -1:], axis=1)[:, 0]
        rest = rest[cut] if requested < n else rest[:0]
        requested = min(2 * requested, n)
    return nearest
