"""Region merging by persistence: how the maxima of a function on a surface merge into each other (thesis 5.2.2)."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from eigenshape._arrays import frozen, vertex_values
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table


@dataclass(frozen=True, eq=False)
class MergeTree:
    """The maxima of a function, each with the saddle over which its region merges into a neighbour.

    Maxima stand in the order of falling persistence, ties by falling height; only those that persist at all are here.

    Attributes
    ----------
    maxima : (m,) int
        Vertex of each maximum.
    values : (m,) float
        Function there.
    saddles : (m, 2) int
        The edge over which the maximum merges, its higher vertex first; (-1, -1) where it never does.
    persistence : (m,) float
        Value at the maximum minus value at the saddle's higher vertex; infinite once in each component.
    parent : (m,) int
        The maximum whose basin lies across the saddle; -1 where it never merges.
    basins : (f,) int
        For each face, the maximum that it climbs to.
    """

    maxima: Int[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    saddles: Int[np.ndarray, "m 2"]
    persistence: Float[np.ndarray, " m"]
    parent: Int[np.ndarray, " m"]
    basins: Int[np.ndarray, " f"]


def merge_tree(mesh: TriangleMesh, values: ArrayLike) -> MergeTree:
    """Merge the faces of a mesh into the basins of the function's maxima, and pair each maximum with its saddle.

    The order is total (simulation of simplicity): vertices by (value, index), edges by (higher, lower vertex),
    triangles by (highest, middle, lowest vertex). Boundary edges are ignored, which equals sealing each boundary loop
    by a vertex lower than all. Faces at an edge with more than two faces are all neighbours there, so that what hangs
    together stays one region; the homology modulo 2 of the thesis says this of two faces only, and else differs.

    The merge is that of the dual graph: an edge joins the basins of its faces, highest edge first, and the basin
    with the lower maximum ends there. A face whose highest edge leads to a higher face ends at once, so only
    what is left, some share of the faces, is merged one by one.

    Parameters
    ----------
    mesh : TriangleMesh
    values : (n,) float
        The function at the vertices.

    Returns
    -------
    MergeTree

    Raises
    ------
    InvalidParameterError
        If there is not one finite value a vertex.
    """
    height = vertex_values(values, "values", mesh.n_vertices)
    dual = _dual_graph(mesh, height)
    climbs_to = _climb(dual)
    saddle, across = _pair(dual, climbs_to)
    return _gather(height, dual, climbs_to, saddle, across)


@dataclass(frozen=True, eq=False)
class _Dual:
    """Faces, renumbered by rank, and the pairs of faces that share an edge.

    faces: (f,) old number of each face; corners: (f, 3) vertices, highest first; pairs: (a, 2) lower and higher
    face at an edge; edges: (a, 2) its vertices, higher first. Pairs stand highest edge first.
    """

    faces: Int[np.ndarray, " f"]
    corners: Int[np.ndarray, "f 3"]
    pairs: Int[np.ndarray, "a 2"]
    edges: Int[np.ndarray, "a 2"]


def _dual_graph(mesh: TriangleMesh, height: Float[np.ndarray, " n"]) -> _Dual:
    n = mesh.n_vertices
    vertex = np.argsort(height, kind="stable")
    rank = np.argsort(vertex)
    ranks = -np.sort(-rank[mesh.faces], axis=1)
    faces = np.lexsort((ranks[:, 1] * n + ranks[:, 2], ranks[:, 0]))
    place = np.argsort(faces)
    # Sides in the order of edge, then face: neighbours in this list are the pairs of faces at an edge.
    table = edge_table(mesh)
    ends = -np.sort(-rank[table.edges], axis=1)
    order = np.argsort(np.argsort(ends[:, 0] * n + ends[:, 1]))
    side_edge, side_face = table.face_edges.ravel(), np.repeat(place, 3)
    sides = np.argsort(side_face - order[side_edge] * len(faces))
    edge, face = side_edge[sides], side_face[sides]
    paired = np.flatnonzero(edge[1:] == edge[:-1])
    pairs = np.column_stack([face[paired], face[paired + 1]])
    return _Dual(faces, vertex[ranks[faces]], pairs, vertex[ends[edge[paired]]])


def _climb(dual: _Dual) -> Int[np.ndarray, " f"]:
    """Return for each face the face that it climbs to over highest edges, itself where there is no way up."""
    lower, upper = dual.pairs.T
    top = (dual.edges == dual.corners[lower, :2]).all(axis=1)
    target = np.arange(len(dual.faces))
    target[lower[top]] = upper[top]
    while True:
        further = target[target]
        if np.array_equal(further, target):
            return target
        target = further


def _pair(dual: _Dual, climbs_to: Int[np.ndarray, " f"]) -> tuple[dict[int, int], dict[int, int]]:
    """Merge the basins over falling edges: for each that ends, the pair of faces and the basin across."""
    basins = climbs_to[dual.pairs]
    open_pairs = np.flatnonzero(basins[:, 0] != basins[:, 1])
    low, high = np.sort(basins[open_pairs], axis=1).T
    _, first = np.unique(low * len(climbs_to) + high, return_index=True)
    open_pairs = open_pairs[np.sort(first)]
    highest = {root: root for root in np.unique(climbs_to).tolist()}

    def find(basin: int) -> int:
        while highest[basin] != basin:
            highest[basin] = basin = highest[highest[basin]]
        return basin

    saddle: dict[int, int] = {}
    across: dict[int, int] = {}
    for pair, (one, two) in zip(open_pairs.tolist(), basins[open_pairs].tolist(), strict=True):
        root_one, root_two = find(one), find(two)
        if root_one != root_two:
            ends, stays = min(root_one, root_two), max(root_one, root_two)
            highest[ends] = stays
            saddle[ends] = pair
            across[ends] = two if ends == root_one else one
    return saddle, across


def _gather(
    height: Float[np.ndarray, " n"],
    dual: _Dual,
    climbs_to: Int[np.ndarray, " f"],
    saddle: dict[int, int],
    across: dict[int, int],
) -> MergeTree:
    """Fold what persists for no time at all into its neighbours, and sort the rest."""
    roots = np.unique(climbs_to)
    pair = np.array([saddle.get(root, -1) for root in roots.tolist()], dtype=np.int64)
    neighbour = np.searchsorted(roots, [across.get(root, root) for root in roots.tolist()])
    edges = np.concatenate([dual.edges, [[-1, -1]]])[pair]
    values = height[dual.corners[roots, 0]]
    persistence = np.where(pair < 0, np.inf, values - height[edges[:, 0]])
    region = merged_regions(neighbour, persistence <= 0)
    kept = np.flatnonzero(persistence > 0)
    kept = kept[np.lexsort((-kept, -persistence[kept]))]
    number = np.empty(len(roots), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    basins = np.empty(len(dual.faces), dtype=np.int64)
    basins[dual.faces] = number[region[np.searchsorted(roots, climbs_to)]]
    return MergeTree(
        maxima=frozen(dual.corners[roots[kept], 0]),
        values=frozen(values[kept]),
        saddles=frozen(edges[kept]),
        persistence=frozen(persistence[kept]),
        parent=frozen(np.where(pair[kept] < 0, -1, number[region[neighbour[kept]]])),
        basins=frozen(basins),
    )


def merged_regions(neighbour: Int[np.ndarray, " m"], ends: Bool[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
    """Merge each basin that ends into its neighbour's region: for each basin, the one of its region that stays."""
    m = len(neighbour)
    links = (np.flatnonzero(ends), neighbour[ends])
    graph = sp.coo_array((np.ones(len(links[0]), dtype=np.int8), links), shape=(m, m))
    _, region = connected_components(graph, directed=False)
    stays = np.empty(m, dtype=np.int64)
    stays[region[~ends]] = np.flatnonzero(~ends)
    return stays[region]
