"""One-to-one correspondences of two point sets: Theorem 4.2.1, and bottleneck matchings."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, positive_number, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._vectors import size_one
from eigenshape.geometry.samples.surface_points import SurfacePoints
from eigenshape.stability.anchors import preimages, regions_met
from eigenshape.stability.bipartite_loops import match_rows
from eigenshape.stability.least_matching import least_perfect, near_pairs
from eigenshape.stability.perturbation import OUTSIDE, Perturbation


@record
class MaximumMatching(ReadOnly):
    """A largest matching of the rows of a bipartite graph with its columns.

    Attributes
    ----------
    partners : (n,) int
        Column of each row; -1 for a row without partner.
    blocked : (b,) int
        Proof that no matching is larger (Hall 1935): rows that together have entries in fewer
        columns than their number, by the number of rows without partner. Empty if all rows have a
        partner.

    See Also
    --------
    maximum_matching : Compute a matching.

    Examples
    --------
    Two rows can only have the same column:

    >>> import scipy.sparse as sp
    >>> import eigenshape as es
    >>> matching = es.stability.maximum_matching(sp.csr_array([[1, 0], [1, 0]]))
    >>> matching.n_matched, matching.is_perfect, sorted(matching.blocked.tolist())
    (1, False, [0, 1])
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


@record
class BottleneckMatching(ReadOnly):
    """The one-to-one correspondence of two point sets with the smallest largest distance.

    Attributes
    ----------
    partners : (n,) int
        For each point of the first set, its partner in the second.
    distance : float
        Largest distance of two partners, in length.

    See Also
    --------
    bottleneck_matching : Compute the correspondence.

    Examples
    --------
    >>> import eigenshape as es
    >>> matching = es.stability.bottleneck_matching([[0, 0], [1, 0]], [[1, 0.5], [0, 0.25]])
    >>> matching.partners.tolist(), matching.distance
    ([1, 0], 0.5)
    """

    partners: Int[np.ndarray, " n"]
    distance: float


def matching_reach(mu: float) -> float:
    """Return ρ = max(3, 8/μ + 2), by which Theorem 4.2.1 grows a region, in multiples of δ.

    Parameters
    ----------
    mu : float
        μ, the isoperimetric constant of the shape scaled to volume 1, without unit.

    Returns
    -------
    float

    Raises
    ------
    InvalidParameterError
        If μ is not positive.

    See Also
    --------
    cheeger_estimate : Estimate μ.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.stability.matching_reach(2.0)
    6.0
    """
    return max(3.0, 8 / positive_number(mu, "mu") + 2)


def correspondence_graph(
    perturbation: Perturbation,
    points_one: SurfacePoints,
    points_two: SurfacePoints,
    *,
    nodes: Float[np.ndarray, "a d"],
    delta: float,
    rho: float,
) -> sp.csr_array:
    """Join each point of M with its possible partners on N (thesis 4.2.1).

    A point is joined with all points of the witness region R_N⁺ of its nearest anchor node (see
    `witness_region`). If the nodes cover M within δ, partners outside the anomalous regions are at
    most (ρ+3)δ apart (Claim 4.2.1). In a region Y_i the bound is (ρ+4)δ, because Observation 4.2.2
    (ii), on which the claim rests, is too small by δ there.

    Parameters
    ----------
    perturbation : Perturbation
        Of M into N.
    points_one, points_two : SurfacePoints
        n points of M, and k points of N.
    nodes : (a, d) float
        Anchor nodes, in length.
    delta : float
        δ, in length.
    rho : float
        ρ, without unit.

    Returns
    -------
    (n, k) sparse
        1 for each joined pair; columns ascend. Memory grows with the number of pairs.

    Raises
    ------
    InvalidParameterError
        If δ or ρ is not positive, or a point is in no simplex of N.

    See Also
    --------
    maximum_matching : Find a one-to-one correspondence in the graph.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> longer = es.TriangleMesh(mesh.vertices * [1, 1, 1.1], mesh.faces)
    >>> perturbation = es.stability.measure_perturbation(mesh, longer)
    >>> rng = np.random.default_rng(0)
    >>> one, two = (es.geometry.sample_surface(shape, 50, rng=rng) for shape in (mesh, longer))
    >>> nodes = es.stability.anchor_nodes(mesh, 0.3).points
    >>> graph = es.stability.correspondence_graph(
    ...     perturbation, one, two, nodes=nodes, delta=0.3, rho=2.0
    ... )
    >>> es.stability.maximum_matching(graph).n_matched
    50
    """
    require_type(perturbation, Perturbation, "perturbation")
    require_type(points_one, SurfacePoints, "points_one")
    require_type(points_two, SurfacePoints, "points_two")
    reach = (positive_number(rho, "rho") + 1) * positive_number(delta, "delta")
    used, node = np.unique(cKDTree(nodes).query(points_one.points)[1], return_inverse=True)
    nodes = nodes[used]
    # The points of N in the witness region of each node, as rows of a matrix.
    labels, before = preimages(perturbation, points_two)
    near = near_pairs(nodes, before, reach)
    rows, columns = [near.i], [np.flatnonzero(labels == OUTSIDE)[near.j]]
    meets = regions_met(perturbation, nodes, reach)
    for region in range(perturbation.n_regions):
        inside, met = np.flatnonzero(labels == region), np.flatnonzero(meets[:, region])
        rows.append(np.repeat(met, len(inside)))
        columns.append(np.tile(inside, len(met)))
    ends = np.concatenate(rows), np.concatenate(columns)
    witnesses = sp.csr_array(
        (np.ones(len(ends[0]), dtype=np.int8), ends), shape=(len(nodes), len(labels))
    )
    witnesses.sort_indices()
    return sp.csr_array(witnesses[node])


def maximum_matching(graph: sp.sparray) -> MaximumMatching:
    """Find a largest matching of a bipartite graph (Hopcroft and Karp 1973).

    Parameters
    ----------
    graph : (n, k) sparse
        Row i may be matched with column j if entry (i, j) is not zero.

    Returns
    -------
    MaximumMatching
        With the rows that prove that no matching is larger.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> import eigenshape as es
    >>> matching = es.stability.maximum_matching(csr_array([[1, 1, 0], [1, 0, 0], [1, 1, 0]]))
    >>> matching.n_matched, matching.blocked
    (2, array([0, 1, 2]))
    """
    joined = sp.csr_array(graph)
    if joined.data.size and not joined.data.all():
        joined = joined.copy()
        joined.eliminate_zeros()
    n, n_columns = joined.shape
    partners, depth = match_rows(joined.indptr, joined.indices, n_columns, np.full(n, -1))
    blocked = np.flatnonzero(depth >= 0) if (partners < 0).any() else np.empty(0, dtype=np.int64)
    return MaximumMatching(partners, blocked)


def bottleneck_matching(one: ArrayLike, two: ArrayLike) -> BottleneckMatching:
    """Find the one-to-one correspondence with the smallest largest Euclidean distance.

    The result is exact. A maximum matching decides whether a distance is sufficient, and bisection
    among the distances of two points finds the smallest sufficient one (Efrat, Itai and Katz 2001,
    with a tree of the points in place of their structures). Memory grows with the number of pairs
    within 1.5 times the distance.

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
        If a coordinate is not finite, or the pairs do not fit into half of the memory.
    InvalidParameterError
        If there are no points, or the two sets differ in number or dimension.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.stability.bottleneck_matching([[0.0], [1.0]], [[1.5], [0.0]])
    BottleneckMatching(partners=array([1, 0]), distance=0.5)
    """
    first, second = finite_rows(one, "points"), finite_rows(two, "points")
    if first.shape != second.shape or not first.size:
        raise InvalidParameterError(
            "Two point sets must have the same shape (n, d), n ≥ 1, to correspond one to one; "
            f"these are {first.shape} and {second.shape}."
        )
    both, scale = size_one(np.stack([first, second]))
    distance, partners = least_perfect(both[0], both[1])
    return BottleneckMatching(partners, scale * distance)
