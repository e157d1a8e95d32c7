"""Region merging by persistence: how the maxima of a function on a surface merge into each other (thesis 5.2.2)."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from eigenshape._arrays import frozen, vertex_values
from eigenshape.features.merge_loops import file_sides, find_corners, join_faces
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh


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


def merge_tree(mesh: MeshLike, values: ArrayLike) -> MergeTree:
    """Merge the faces of a mesh into the basins of the function's maxima, and pair each maximum with its saddle.

    The order is total (simulation of simplicity): vertices by (value, index), edges by (higher, lower vertex),
    triangles by (highest, middle, lowest vertex). Boundary edges are ignored, which equals sealing each boundary loop
    by a vertex lower than all. Faces at an edge with more than two faces are all neighbours there, so that what hangs
    together stays one region; the homology modulo 2 of the thesis says this of two faces only, and else differs.

    The merge is that of the dual graph: an edge joins the basins of its faces, highest edge first, and the basin
    with the lower maximum ends there. A face whose highest edge leads to a higher face ends at once. A million
    vertices take about a second on one core, most of it to wait for memory.

    Parameters
    ----------
    mesh : MeshLike
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
    mesh = as_mesh(mesh)
    height = vertex_values(values, "values", mesh.n_vertices)
    return _gather(height, _joined(mesh, height))


@dataclass(frozen=True, eq=False)
class _Joined:
    """What the walk over falling edges found; vertices and faces by their old numbers.

    climbs_to: (f,) the highest face of each face's basin; roots: (r,) those faces, lowest first; tops: (r,) their
    highest vertices; ended: (e, 4) of each basin that ends its face, the higher and the lower vertex of the edge, and
    the face of the basin across.
    """

    climbs_to: Int[np.ndarray, " f"]
    roots: Int[np.ndarray, " r"]
    tops: Int[np.ndarray, " r"]
    ended: Int[np.ndarray, "e 4"]


def _joined(mesh: TriangleMesh, height: Float[np.ndarray, " n"]) -> _Joined:
    n, n_faces = mesh.n_vertices, mesh.n_faces
    kind = np.int32 if max(n, n_faces) < 2**31 else np.int64  # half the memory to wait for, where it fits
    vertex = np.argsort(height, kind="stable")
    rank = np.empty(n, dtype=kind)
    rank[vertex] = np.arange(n)
    corners = np.empty((n_faces, 3), dtype=kind)
    find_corners(mesh.faces, rank, corners)
    # Each face has two sides whose higher vertex is its highest, and one whose higher vertex is its middle one.
    n_sides = 2 * np.bincount(corners[:, 0], minlength=n) + np.bincount(corners[:, 1], minlength=n)
    starts = np.concatenate([[0], np.cumsum(n_sides)])
    lower, owner = np.empty(3 * n_faces, dtype=kind), np.empty(3 * n_faces, dtype=kind)
    file_sides(corners, starts[:-1].copy(), lower, owner)
    climbs_to, ended = np.arange(n_faces, dtype=kind), np.empty((n_faces, 4), dtype=kind)
    n_ended = join_faces(corners, starts, lower, owner, climbs_to, climbs_to.copy(), ended)
    ended = ended[:n_ended].astype(np.int64)
    roots = np.flatnonzero(climbs_to == np.arange(mesh.n_faces))
    highest, middle, lowest = corners[roots].T
    order = np.lexsort((lowest, middle, highest))
    ended[:, 1:3] = vertex[ended[:, 1:3]]
    return _Joined(climbs_to, roots[order], vertex[highest[order]], ended)


def _gather(height: Float[np.ndarray, " n"], joined: _Joined) -> MergeTree:
    """Fold what persists for no time at all into its neighbours, and sort the rest."""
    roots, count = joined.roots, len(joined.roots)
    place = np.empty(len(joined.climbs_to), dtype=np.int64)
    place[roots] = np.arange(count)
    edges, neighbour = np.full((count, 2), -1), np.arange(count)
    ends = place[joined.ended[:, 0]]
    edges[ends], neighbour[ends] = joined.ended[:, 1:3], place[joined.climbs_to[joined.ended[:, 3]]]
    values = height[joined.tops]
    persistence = np.full(count, np.inf)
    persistence[ends] = values[ends] - height[edges[ends, 0]]
    region = merged_regions(neighbour, persistence <= 0)
    kept = np.flatnonzero(persistence > 0)
    kept = kept[np.lexsort((-kept, -persistence[kept]))]
    number = np.empty(count, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    place[roots] = number[region]
    return MergeTree(
        maxima=frozen(joined.tops[kept]),
        values=frozen(values[kept]),
        saddles=frozen(edges[kept]),
        persistence=frozen(persistence[kept]),
        parent=frozen(np.where(edges[kept, 0] < 0, -1, number[region[neighbour[kept]]])),
        basins=frozen(place[joined.climbs_to]),
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
