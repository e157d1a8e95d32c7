"""One-to-one correspondences of two point sets: that of Theorem 4.2.1, and the one that moves points least."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_rows, frozen, positive_values
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.features.least_matching import least_perfect, near_pairs
from eigenshape.features.matching_loops import match_rows
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.surface_points import SurfacePoints
from eigenshape.stability.anchors import preimages, regions_met
from eigenshape.stability.perturbation import OUTSIDE, Perturbation


@dataclass(frozen=True, eq=False)
class MaximumMatching:
    """A matching of the rows of a bipartite graph with its columns that no other has more of.

    Attributes
    ----------
    partners : (n,) int
        Column of each row; -1 without.
    blocked : (b,) int
        Rows that together have fewer columns than they are, by as many as are without partner; none where all have one
        (Hall 1935).
    """

    partners: Int[np.ndarray, " n"]
    blocked: Int[np.ndarray, " b"]

    @property
    def n_matched(self) -> int:
        """Number of rows with a partner."""
        return int((self.partners >= 0).sum())

    @property
    def is_perfect(self) -> bool:
        """Whether every row has a partner."""
        return self.n_matched == len(self.partners)


@dataclass(frozen=True, eq=False)
class BottleneckMatching:
    """The one-to-one correspondence of two point sets whose longest move is shortest.

    Attributes
    ----------
    partners : (n,) int
        For each point of the first set its partner in the second.
    distance : float
        The longest distance of partners, in length.
    """

    partners: Int[np.ndarray, " n"]
    distance: float


def matching_reach(mu: float) -> float:
    """Return ρ = max(3, 8/μ + 2), how far Theorem 4.2.1 grows a region, in multiples of δ.

    Parameters
    ----------
    mu : float
        μ, the isoperimetric constant of the shape scaled to volume 1; without unit there.

    Raises
    ------
    InvalidParameterError
        If μ is not positive.
    """
    return max(3.0, 8 / float(positive_values(mu, "mu")[0]) + 2)


def correspondence_graph(
    perturbation: Perturbation,
    points_one: SurfacePoints,
    points_two: SurfacePoints,
    *,
    nodes: Float[np.ndarray, "a d"],
    delta: float,
    rho: float,
) -> sp.csr_array:
    """Join each point of M with those points of N to which Theorem 4.2.1 may send it (thesis 4.2.1).

    p is joined to all points of the witness region R_N⁺ of its nearest anchor-node (see `witness_region`). So partners
    are at most (ρ+3)δ apart outside the anomalous regions, where nodes cover M within δ (Claim 4.2.1). In a region Y_i
    it is (ρ+4)δ: the claim leans on Observation 4.2.2 (ii), which is short by δ there.

    Parameters
    ----------
    perturbation : Perturbation
        Of M into N.
    points_one, points_two : SurfacePoints
        n points of M, and k of N.
    nodes : (a, d) float
        Anchor-nodes, in length.
    delta : float
        δ, in length.
    rho : float
        ρ, without unit.

    Returns
    -------
    (n, k) sparse
        1 where joined; columns ascending. Memory grows with the number of joined pairs.

    Raises
    ------
    InvalidParameterError
        If δ or ρ is not positive, or a point of N lies in no simplex of it.
    """
    require_type(perturbation, Perturbation, "perturbation")
    require_type(points_one, SurfacePoints, "points_one")
    require_type(points_two, SurfacePoints, "points_two")
    reach = float((positive_values(rho, "rho")[0] + 1) * positive_values(delta, "delta")[0])
    used, node = np.unique(cKDTree(nodes).query(points_one.points)[1], return_inverse=True)
    witnessed = _witnessed(perturbation, points_two, nodes[used], reach)
    return sp.csr_array(witnessed[node])


def _witnessed(
    perturbation: Perturbation, points: SurfacePoints, nodes: Float[np.ndarray, "a d"], reach: float
) -> sp.csr_array:
    """Return for each node the points of N in its witness region."""
    labels, before = preimages(perturbation, points)
    near = near_pairs(nodes, before, reach, 2.0)
    rows, columns = [near.i], [np.flatnonzero(labels == OUTSIDE)[near.j]]
    meets = regions_met(perturbation, nodes, reach)
    for region in range(perturbation.n_regions):
        inside, met = np.flatnonzero(labels == region), np.flatnonzero(meets[:, region])
        rows.append(np.repeat(met, len(inside)))
        columns.append(np.tile(inside, len(met)))
    ends = np.concatenate(rows), np.concatenate(columns)
    graph = sp.csr_array(
        (np.ones(len(ends[0]), dtype=np.int8), ends), shape=(len(nodes), len(labels))
    )
    graph.sort_indices()
    return graph


def maximum_matching(graph: sp.sparray) -> MaximumMatching:
    """Match as many rows of a bipartite graph as can be, each with a column that it has an entry in.

    By alternating paths, all shortest ones at a time (Hopcroft and Karp 1973).

    Parameters
    ----------
    graph : (n, k) sparse
        Joined where it stores an entry that is not 0.

    Returns
    -------
    MaximumMatching
        With the rows that prove that no matching is larger.
    """
    joined = sp.csr_array(graph)
    if joined.data.size and not joined.data.all():
        joined = joined.copy()
        joined.eliminate_zeros()
    n, n_columns = joined.shape
    partners, depth = match_rows(joined.indptr, joined.indices, n_columns, np.full(n, -1))
    blocked = np.flatnonzero(depth >= 0) if (partners < 0).any() else np.empty(0, dtype=np.int64)
    return MaximumMatching(frozen(partners), frozen(blocked))


def bottleneck_matching(one: ArrayLike, two: ArrayLike) -> BottleneckMatching:
    """Find the one-to-one correspondence of two point sets whose largest Euclidean distance is least.

    Exact: maximum matchings tell which distances suffice, and the least of all distances of two points that does is
    searched for (Efrat, Itai and Katz 2001, with a tree of the points in place of their structures). Memory grows with
    the number of pairs within one and a half times the distance.

    Parameters
    ----------
    one, two : (n, d) float
        Points, in length.

    Returns
    -------
    BottleneckMatching

    Raises
    ------
    InvalidShapeError
        If a coordinate is not finite, or the pairs would not fit into half of the memory.
    InvalidParameterError
        If there are no points, or the two sets differ in number or dimension.
    """
    first, second = finite_rows(one, "points"), finite_rows(two, "points")
    if first.shape != second.shape or not first.size:
        raise InvalidParameterError(
            f"Two point sets must have the same shape (n, d), n ≥ 1, to correspond one to one; these are "
            f"{first.shape} and {second.shape}."
        )
    both, scale = size_one(np.stack([first, second]))
    distance, partners = least_perfect(both[0], both[1], 2.0)
    return BottleneckMatching(frozen(partners), scale * distance)
