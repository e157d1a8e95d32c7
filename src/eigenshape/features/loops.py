"""Essential loops of curves and surfaces, paired by extended persistence."""

from collections import defaultdict

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import breadth_first_order

from certeig.kit.arrays import record
from eigenshape._arrays import label_components
from eigenshape.features.merge_loops import spanning_forest
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.simplicial import Mesh


def extended_loops(mesh: Mesh, order: Int[np.ndarray, " n"]) -> Int[np.ndarray, "loops 2"] | None:
    """Pair the loops (classes of H₁ modulo 2) of a curve or a surface by extended persistence.

    As values rise, an edge that neither joins two components (it is not in a spanning tree) nor is
    dual to an edge of a spanning tree of faces begins a loop that lasts (tree-cotree decomposition,
    Eppstein 2003). The edge is dual to a cut: the edges that a path of faces crosses. The loops z_i
    of rising and w_k of falling values span H₁ in two orders. Cuts c_j with |z_i ∩ c_j| = δ_ij give
    the coordinates |w_k ∩ c_j| of the second basis in the first. The rows of these coordinates, in
    the order in which the w_k begin, are reduced to different last coordinates; these are the
    pairs.

    Parameters
    ----------
    mesh : TriangleMesh or SimplicialMesh
    order : (n,) int
        The vertices from the lowest to the highest.

    Returns
    -------
    (loops, 2) int, or None
        For each loop, the vertex where it begins as values rise, and the vertex where it begins as
        values fall. None if the mesh is neither a curve nor a surface, or if an edge has more than
        two faces.
    """
    complex_ = _build_complex(mesh)
    if complex_ is None:
        return None
    rising = _find_generators(complex_, order)
    falling = _find_generators(complex_, order[::-1])
    if not len(rising.edges):
        return np.empty((0, 2), dtype=np.int64)
    # Cut j consists of the edge that begins loop j and of the edges crossed on the path of faces
    # between its two sides. Each edge gets the cuts that contain it, cut j as bit j.
    crossing: dict[int, int] = defaultdict(int)
    forest = _root_forest(complex_.sides, rising.cotree, complex_.n_faces + 1)
    for number, edge in enumerate(rising.edges.tolist()):
        for step in (edge, *_path(forest, *complex_.sides[edge].tolist())):
            crossing[step] ^= 1 << number
    tree = _root_forest(complex_.edges, falling.tree, len(order))
    # A row is an integer: bit j says whether the loop crosses cut j. `last` holds reduced rows by
    # their highest bit.
    last: dict[int, int] = {}
    pairs = []
    for edge in falling.edges.tolist():
        row = crossing[edge]
        for step in _path(tree, *complex_.edges[edge].tolist()):
            row ^= crossing.get(step, 0)
        while row.bit_length() in last:
            row ^= last[row.bit_length()]
        last[row.bit_length()] = row
        pairs.append((rising.edges[row.bit_length() - 1], edge))
    place = np.argsort(order)
    ends = complex_.edges[np.array(pairs)]
    return np.column_stack(
        [order[place[ends[:, 0]].max(axis=1)], order[place[ends[:, 1]].min(axis=1)]]
    )


@record
class _Complex:
    """The two vertices and the two faces of each edge; `n_faces` stands for a missing face."""

    edges: Int[np.ndarray, "e 2"]
    sides: Int[np.ndarray, "e 2"]
    n_faces: int


def _build_complex(mesh: Mesh) -> _Complex | None:
    """Return the complex of a curve or surface, or None (see `extended_loops`)."""
    if mesh.dim == 1:
        edges = np.unique(np.sort(mesh.simplices, axis=1), axis=0)
        return _Complex(edges, np.zeros_like(edges), 0)
    if mesh.dim != 2:
        return None
    table = facet_table(mesh)
    edges, face_edges, counts = table.facets, table.simplex_facets, table.n_simplices
    if counts.max() > 2:
        return None
    sides = np.full((len(edges), 2), len(face_edges))
    order = np.argsort(face_edges.ravel(), kind="stable")
    starts = np.cumsum(counts) - counts
    sides[:, 0] = order[starts] // 3
    sides[counts == 2, 1] = order[starts[counts == 2] + 1] // 3
    return _Complex(edges, sides, len(face_edges))


@record
class _Generators:
    """Edges of the two spanning trees, and the other edges in the order of entry."""

    tree: Bool[np.ndarray, " e"]
    cotree: Bool[np.ndarray, " e"]
    edges: Int[np.ndarray, " loops"]


def _find_generators(complex_: _Complex, order: Int[np.ndarray, " n"]) -> _Generators:
    """Let the edges enter in the order of their later vertices; each other edge begins a loop."""
    place = np.argsort(order)[complex_.edges]
    entering = np.lexsort((place.min(axis=1), place.max(axis=1)))
    tree = spanning_forest(complex_.edges, entering, len(order))
    cotree = spanning_forest(complex_.sides, entering[::-1], complex_.n_faces + 1)
    return _Generators(tree, cotree, entering[~(tree | cotree)[entering]])


@record
class _RootedForest:
    """Trees below one common root.

    place: breadth-first number of each node, larger than that of its parent; parent: its parent;
    edge: the edge to it.
    """

    place: Int[np.ndarray, " n"]
    parent: Int[np.ndarray, " n"]
    edge: Int[np.ndarray, " n"]


def _root_forest(
    ends: Int[np.ndarray, "e 2"], kept: Bool[np.ndarray, " e"], n: int
) -> _RootedForest:
    edges = np.flatnonzero(kept)
    one, two = ends[edges].T
    _, labels = label_components(n, one, two)
    # The first node of each tree becomes a child of node n, the common root.
    _, firsts = np.unique(labels, return_index=True)
    rows, columns = np.append(one, firsts), np.append(two, np.full(len(firsts), n))
    graph = sp.coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n + 1, n + 1))
    order, parent = breadth_first_order(graph.tocsr(), n, directed=False)
    place, to_parent = np.argsort(order), np.full(n + 1, -1)
    up = parent[one] == two
    to_parent[np.where(up, one, two)] = edges
    return _RootedForest(place, parent, to_parent)


def _path(tree: _RootedForest, one: int, two: int) -> list[int]:
    """Return the edges on the path between two nodes of one tree."""
    steps = []
    while one != two:
        if tree.place[one] < tree.place[two]:
            one, two = two, one
        steps.append(int(tree.edge[one]))
        one = int(tree.parent[one])
    return steps
