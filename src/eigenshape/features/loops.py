"""Loops of curves and surfaces that nothing fills, and where a function's level sets first and last have them."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import breadth_first_order, connected_components

from eigenshape.features.union_loops import spanning_forest
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import edge_table


def extended_loops(mesh: Mesh, order: Int[np.ndarray, " n"]) -> Int[np.ndarray, "loops 2"] | None:
    """Pair by extended persistence the classes of H₁ modulo 2: the vertex where each begins, and that where it ends.

    Where values rise, an edge that neither joins two components (a tree) nor is filled by a face (a tree of faces)
    begins a loop for good (Eppstein 2003 calls it tree-cotree decomposition). It is dual to a cut: faces crossed on
    the way around. Loops z_i of rising and w_k of falling values span H₁ in two orders; cuts c_j with |z_i ∩ c_j| =
    δ_ij give the coordinates |w_k ∩ c_j| of the second in the first. Reducing those rows, in the order in which the w_k
    begin, to different last coordinates pairs the two orders.

    Parameters
    ----------
    mesh : TriangleMesh or SimplicialMesh
    order : (n,) int
        The vertices from the lowest to the highest.

    Returns
    -------
    (loops, 2) int, or None
        None where the mesh is neither a curve nor a surface, or an edge has more than two faces.
    """
    complex_ = _complex(mesh)
    if complex_ is None:
        return None
    rising, falling = _generators(complex_, order), _generators(complex_, order[::-1])
    if not len(rising.edges):
        return np.empty((0, 2), dtype=np.int64)
    crossing = _cuts_at_edges(complex_, rising)
    tree = _rooted(complex_.edges, falling.tree, len(order))
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


@dataclass(frozen=True, eq=False)
class _Complex:
    """Edges by their vertices, and the two faces of each; where there is none, the outside, number `n_faces`."""

    edges: Int[np.ndarray, "e 2"]
    sides: Int[np.ndarray, "e 2"]
    n_faces: int


def _complex(mesh: Mesh) -> _Complex | None:
    if mesh.dim == 1:
        edges = np.unique(np.sort(mesh.simplices, axis=1), axis=0)
        return _Complex(edges, np.zeros_like(edges), 0)
    if mesh.dim != 2:
        return None
    edges, edge_of, counts = _edges(mesh)
    if counts.max() > 2:
        return None
    sides = np.full((len(edges), 2), len(edge_of))
    order = np.argsort(edge_of.ravel(), kind="stable")
    starts = np.cumsum(counts) - counts
    sides[:, 0] = order[starts] // 3
    sides[counts == 2, 1] = order[starts[counts == 2] + 1] // 3
    return _Complex(edges, sides, len(edge_of))


def _edges(
    mesh: Mesh,
) -> tuple[Int[np.ndarray, "e 2"], Int[np.ndarray, "f 3"], Int[np.ndarray, " e"]]:
    if isinstance(mesh, TriangleMesh):
        edges = edge_table(mesh)
        return edges.edges, edges.face_edges, edges.n_faces
    facets = facet_table(mesh)
    return facets.facets, facets.simplex_facets, facets.n_simplices


@dataclass(frozen=True, eq=False)
class _Generators:
    """Which edges join vertices, which join faces, and the others in the order in which they enter."""

    tree: Bool[np.ndarray, " e"]
    cotree: Bool[np.ndarray, " e"]
    edges: Int[np.ndarray, " loops"]


def _generators(complex_: _Complex, order: Int[np.ndarray, " n"]) -> _Generators:
    """Let edges enter with their later vertex in order."""
    place = np.argsort(order)[complex_.edges]
    entering = np.lexsort((place.min(axis=1), place.max(axis=1)))
    tree = spanning_forest(complex_.edges, entering, len(order))
    cotree = spanning_forest(complex_.sides, entering[::-1], complex_.n_faces + 1)
    return _Generators(tree, cotree, entering[~(tree | cotree)[entering]])


def _cuts_at_edges(complex_: _Complex, rising: _Generators) -> dict[int, int]:
    """Return for each edge the cuts that cross it, cut j as bit j: edge j and the way between its faces."""
    tree = _rooted(complex_.sides, rising.cotree, complex_.n_faces + 1)
    crossing: dict[int, int] = defaultdict(int)
    for number, edge in enumerate(rising.edges.tolist()):
        for step in (edge, *_path(tree, *complex_.sides[edge].tolist())):
            crossing[step] ^= 1 << number
    return defaultdict(int, crossing)


@dataclass(frozen=True, eq=False)
class _Rooted:
    """Trees under one root: the place of each node, later than that of its parent, the parent, and the edge to it."""

    place: Int[np.ndarray, " n"]
    parent: Int[np.ndarray, " n"]
    edge: Int[np.ndarray, " n"]


def _rooted(ends: Int[np.ndarray, "e 2"], kept: Bool[np.ndarray, " e"], n: int) -> _Rooted:
    edges = np.flatnonzero(kept)
    one, two = ends[edges].T
    graph = sp.coo_array((np.ones(len(edges), dtype=np.int8), (one, two)), shape=(n + 1, n + 1))
    _, labels = connected_components(graph, directed=False)
    _, firsts = np.unique(
        labels[:n], return_index=True
    )  # one of each tree, to hang from a root of all
    rows, columns = np.append(one, firsts), np.append(two, np.full(len(firsts), n))
    graph = sp.coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n + 1, n + 1))
    order, parent = breadth_first_order(graph.tocsr(), n, directed=False)
    place, to_parent = np.argsort(order), np.full(n + 1, -1)
    up = parent[one] == two
    to_parent[np.where(up, one, two)] = edges
    return _Rooted(place, parent, to_parent)


def _path(tree: _Rooted, one: int, two: int) -> list[int]:
    """Return the edges on the way between two nodes of one tree."""
    steps = []
    while one != two:
        if tree.place[one] < tree.place[two]:
            one, two = two, one
        steps.append(int(tree.edge[one]))
        one = int(tree.parent[one])
    return steps
