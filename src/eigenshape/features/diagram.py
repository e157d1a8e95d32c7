"""Persistence diagrams: where components of level sets begin and end."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from eigenshape._arrays import frozen, vertex_values
from eigenshape._typing import ArrayLike
from eigenshape.features.loops import extended_loops
from eigenshape.features.union_loops import join_points
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.operators.graph import edge_graph
from eigenshape.operators.neighbors import neighbor_graph

N_NEIGHBORS = 10


@dataclass(frozen=True, eq=False)
class PersistencePairs:
    """Pairs of vertices at which something begins and ends, most persistent first, ties by the vertex of birth.

    Attributes
    ----------
    birth_vertices, death_vertices : (p,) int
    births, deaths : (p,) float
        The function there.
    """

    birth_vertices: Int[np.ndarray, " p"]
    death_vertices: Int[np.ndarray, " p"]
    births: Float[np.ndarray, " p"]
    deaths: Float[np.ndarray, " p"]

    @property
    def persistence(self) -> Float[np.ndarray, " p"]:
        """|birth - death|, in the function's unit."""
        return np.abs(self.births - self.deaths)


@dataclass(frozen=True, eq=False)
class PersistenceDiagram:
    """How a function on a shape rises and falls, in dimension 0, with the essential loops where they are known.

    Attributes
    ----------
    maxima : PersistencePairs
        Where values fall from infinity, a component of {f ≥ a} is born at a maximum and dies at the saddle where it
        meets one with a higher maximum.
    minima : PersistencePairs
        The same of {f ≤ a}, where values rise: from a minimum to the saddle where it meets one with a lower minimum.
    components : PersistencePairs
        One for each component of the shape, from its lowest to its highest vertex: they never end, and are paired by
        extended persistence.
    loops : PersistencePairs or None
        One for each independent loop that nothing fills (modulo 2; twice the genus on a closed orientable surface):
        born where {f ≤ a} first has it, paired with where {f ≥ a} last has it. None for solids, for surfaces with an
        edge of more than two faces, and for point clouds.
    """

    maxima: PersistencePairs
    minima: PersistencePairs
    components: PersistencePairs
    loops: PersistencePairs | None


def persistence_diagram(
    shape: ShapeLike, values: ArrayLike, *, n_neighbors: int = N_NEIGHBORS
) -> PersistenceDiagram:
    """Pair the maxima and minima of a function with the saddles where they merge.

    The function is that of the vertices, linear on simplices; what is connected, edges tell alone (Edelsbrunner and
    Harer 2010, VII). The order is total: vertices by (value, index). Maxima and minima that persist for no time are
    left out, so what is left does not depend on the indices. Essential classes are paired by extended persistence
    (Cohen-Steiner, Edelsbrunner and Harer 2009).

    `merge_tree` differs from `maxima` by its saddles: it joins faces over edges, with the value of an edge that of its
    higher vertex, as the thesis does; here the regions meet in vertices.

    Parameters
    ----------
    shape : ShapeLike
        Of any dimension; the points of a cloud are joined to their nearest neighbours.
    values : (n,) float
        The function at the vertices.
    n_neighbors : int
        Of each point of a cloud, as in `neighbor_graph`.

    Returns
    -------
    PersistenceDiagram
        In the function's unit; nothing depends on coordinates, but the neighbours of a cloud.

    Raises
    ------
    InvalidParameterError
        If there is not one finite value a vertex, or `n_neighbors` is not in 1..n - 1.
    InvalidShapeError
        If a simplex has a corner twice.
    """
    shape = as_shape(shape)
    height = vertex_values(values, "values", shape.n_points)
    graph = _graph(shape, n_neighbors)
    order = np.argsort(height, kind="stable")
    top, falling = join_points(graph.indptr, graph.indices, order[::-1])
    bottom, rising = join_points(graph.indptr, graph.indices, order)
    tops = np.unique(top)
    loops = None if isinstance(shape, PointCloud) else extended_loops(shape, order)
    return PersistenceDiagram(
        maxima=_lasting(falling, height),
        minima=_lasting(rising, height),
        components=_pairs(np.column_stack([bottom[tops], tops]), height),
        loops=None if loops is None else _pairs(loops, height),
    )


def _graph(shape: Shape, n_neighbors: int) -> sp.csr_array:
    if isinstance(shape, PointCloud):
        return neighbor_graph(shape.points, n_neighbors)
    return edge_graph(shape)


def _lasting(ended: Int[np.ndarray, "p 2"], height: Float[np.ndarray, " n"]) -> PersistencePairs:
    begins, ends = height[ended].T
    return _pairs(ended[begins != ends], height)


def _pairs(vertices: Int[np.ndarray, "p 2"], height: Float[np.ndarray, " n"]) -> PersistencePairs:
    births, deaths = height[vertices].T
    order = np.lexsort((vertices[:, 1], vertices[:, 0], -np.abs(births - deaths)))
    sorted_columns = (*vertices[order].T, births[order], deaths[order])
    return PersistencePairs(*(frozen(column) for column in sorted_columns))
