"""Persistence diagrams: where components of level sets begin and end."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.text import Shown
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import vertex_values
from eigenshape.features.loops import extended_loops
from eigenshape.features.merge_loops import join_points
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.operators.clouds.neighbors import neighbor_graph
from eigenshape.operators.graph import edge_graph

# Nearest neighbors to which each point of a cloud is joined. More join what is separate, fewer
# break what is whole.
N_NEIGHBORS = 10


@record
class PersistencePairs(ReadOnly):
    """Pairs of vertices at which a class of homology begins and ends.

    Pairs are sorted by falling persistence, then by the vertex of birth.

    Attributes
    ----------
    birth_vertices, death_vertices : (p,) int
    births, deaths : (p,) float
        The function at these vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> diagram = es.features.persistence_diagram(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> diagram.maxima.births, diagram.maxima.deaths
    (array([2.]), array([1.]))
    """

    birth_vertices: Int[np.ndarray, " p"]
    death_vertices: Int[np.ndarray, " p"]
    births: Float[np.ndarray, " p"]
    deaths: Float[np.ndarray, " p"]

    @property
    def persistence(self) -> Float[np.ndarray, " p"]:
        """|birth - death|, in the function's unit."""
        return np.abs(self.births - self.deaths)


@record
class PersistenceDiagram(Shown):
    """Persistence of a function on a shape, in dimension 0, and its essential loops.

    Attributes
    ----------
    maxima : PersistencePairs
        Components of {f ≥ a} for falling a: each is born at a maximum, and dies at the saddle where
        it meets a component with a higher maximum.
    minima : PersistencePairs
        Components of {f ≤ a} for rising a: each is born at a minimum, and dies at the saddle where
        it meets a component with a lower minimum.
    components : PersistencePairs
        One pair for each component of the shape, from its lowest to its highest vertex (extended
        persistence).
    loops : PersistencePairs or None
        One pair for each independent loop (H₁ modulo 2; twice the genus on a closed orientable
        surface): from the value at which {f ≤ a} first contains it to that at which {f ≥ a} last
        contains it. None for solids, for surfaces with an edge of more than two faces, and for
        point clouds.

    See Also
    --------
    persistence_diagram : Compute a diagram.

    Examples
    --------
    The height on a torus that lies flat has two essential loops:

    >>> import eigenshape as es
    >>> torus = es.shapes.torus(20, 10)
    >>> diagram = es.features.persistence_diagram(torus, torus.vertices[:, 2])
    >>> len(diagram.loops.births)
    2
    """

    maxima: PersistencePairs
    minima: PersistencePairs
    components: PersistencePairs
    loops: PersistencePairs | None


def persistence_diagram(
    shape: ShapeLike, values: ArrayLike, *, n_neighbors: int = N_NEIGHBORS
) -> PersistenceDiagram:
    """Compute the persistence diagram of a function on a shape.

    The function is linear on each simplex, so edges alone decide which vertices are connected
    (Edelsbrunner and Harer 2010, chapter VII). Vertices are ordered by (value, index). Pairs of
    persistence 0 are left out, so the diagram does not depend on the indices of vertices. Essential
    classes are paired by extended persistence (Cohen-Steiner, Edelsbrunner and Harer 2009).

    The saddles differ from those of `merge_tree`, which joins faces across edges, as the thesis
    does, with the value of an edge at its higher vertex. Here, regions meet at vertices.

    Parameters
    ----------
    shape : ShapeLike
        Of any dimension; each point of a cloud is joined to its nearest neighbors.
    values : (n,) float
        The function at the vertices.
    n_neighbors : int
        Number of neighbors of each point of a cloud, 1 to n - 1; see `neighbor_graph`.

    Returns
    -------
    PersistenceDiagram
        In the function's unit. Coordinates matter only for the neighbors of a cloud.

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one finite number per vertex, or `n_neighbors` is not in 1..n - 1.
    InvalidShapeError
        If a simplex has a corner twice.

    See Also
    --------
    merge_tree : Merge the regions of maxima on a surface.

    Examples
    --------
    -------- The height on a torus that stands upright has one component and two loops, each between
    0.6 and -0.6 or back:

    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> diagram = es.features.persistence_diagram(mesh, mesh.vertices[:, 0])
    >>> diagram.components.persistence.round(3)
    array([2.8])
    >>> diagram.loops.persistence.round(3)
    array([1.2, 1.2])
    """
    shape = as_shape(shape)
    height = vertex_values(values, "values", shape.n_points)
    order = np.argsort(height, kind="stable")
    if isinstance(shape, PointCloud):
        graph, loops = neighbor_graph(shape.points, n_neighbors), None
    else:
        graph, loops = edge_graph(shape), extended_loops(shape, order)
    top, falling = join_points(graph.indptr, graph.indices, order[::-1])
    bottom, rising = join_points(graph.indptr, graph.indices, order)
    tops = np.unique(top)
    return PersistenceDiagram(
        maxima=_ordinary_pairs(falling, height),
        minima=_ordinary_pairs(rising, height),
        components=_sort_pairs(np.column_stack([bottom[tops], tops]), height),
        loops=None if loops is None else _sort_pairs(loops, height),
    )


def _ordinary_pairs(
    vertices: Int[np.ndarray, "p 2"], height: Float[np.ndarray, " n"]
) -> PersistencePairs:
    """Leave out the pairs of persistence 0, and sort the rest."""
    births, deaths = height[vertices].T
    return _sort_pairs(vertices[births != deaths], height)


def _sort_pairs(
    vertices: Int[np.ndarray, "p 2"], height: Float[np.ndarray, " n"]
) -> PersistencePairs:
    births, deaths = height[vertices].T
    order = np.lexsort((vertices[:, 1], vertices[:, 0], -np.abs(births - deaths)))
    first, second = vertices[order].T
    return PersistencePairs(first.copy(), second.copy(), births[order], deaths[order])
