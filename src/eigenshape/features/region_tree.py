"""Trees of regions of a surface: which region merges into which, and when."""

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape._arrays import label_components


@record
class RegionTree(ReadOnly):
    """What `MergeTree` and `PartTree` have in common, and all that `segment` needs to cut either.

    Regions are sorted by falling persistence, so that every cut keeps the first few of them.
    """

    maxima: Int[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    persistence: Float[np.ndarray, " m"]
    parent: Int[np.ndarray, " m"]
    basins: Int[np.ndarray, " f"]


@record
class MergeTree(RegionTree):
    """The maxima of a function on a surface, and the saddles at which their regions merge.

    Maxima are sorted by falling persistence, and by falling height where persistence is equal. A
    maximum with a persistence of 0 is not listed: its faces belong to a neighboring region.

    Attributes
    ----------
    maxima : (m,) int
        Vertex of each maximum.
    values : (m,) float
        Function at each maximum.
    persistence : (m,) float
        Function at the maximum minus function at the higher vertex of the saddle, in the function's
        unit. Infinite for the highest maximum of each component.
    parent : (m,) int
        The maximum whose basin lies on the other side of the saddle; -1 if the maximum never
        merges.
    basins : (f,) int
        For each face, the maximum of its basin.
    saddles : (m, 2) int
        The edge over which each maximum merges, its higher vertex first; (-1, -1) if the maximum
        never merges.

    See Also
    --------
    merge_tree : Compute the tree.
    segment : Cut the tree into regions.

    Examples
    --------
    The lower of two maxima merges into the higher one at a saddle of height 1:

    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> tree = es.merge_tree(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> tree.values, tree.persistence, tree.parent
    (array([3., 2.]), array([inf,  1.]), array([-1,  0]))
    """

    saddles: Int[np.ndarray, "m 2"]


@record
class PartTree(RegionTree):
    """The parts of a surface, and the parts from which they split.

    Parts are sorted by falling persistence. `segment` cuts this tree in the same way as a
    `MergeTree`.

    Attributes
    ----------
    maxima : (m,) int
        For each part, its vertex with the most heat.
    values : (m,) float
        Heat at that vertex, in 1/length².
    persistence : (m,) float
        Between 0 and 1, infinite for one part of each component. In a tree of `part_tree`: the
        share of a temperature difference between the part and its parent that is left after the
        diffusion time, 0 if heat flows freely between them, 1 if no heat flows. In a tree of
        `find_parts`, where it is above 0.15, it also counts creases, thickness and lines of sight.
    parent : (m,) int
        The part from which this part splits, which has a higher maximum; -1 if there is none.
    basins : (f,) int
        For each face, the smallest part that contains it.

    See Also
    --------
    part_tree : Compute the tree.
    find_parts : Compute the tree of a mesh and cut it.

    Examples
    --------
    `find_parts` cuts its tree once; the tree can be cut again without new computation:

    >>> import eigenshape as es
    >>> two_balls = es.geometry.disjoint_union(es.icosphere(2), es.icosphere(2))
    >>> tree = es.find_parts(two_balls).tree
    >>> whole = es.segment(tree, persistence=1)  # only what no heat connects
    >>> whole.features.persistence
    array([inf, inf])
    >>> whole.labels.shape == (two_balls.n_faces,)
    True
    """


def number_regions(
    order: Int[np.ndarray, " m"], parent: Int[np.ndarray, " r"], basins: Int[np.ndarray, " f"]
) -> tuple[Int[np.ndarray, " m"], Int[np.ndarray, " f"]]:
    """Return `parent` and `basins` with regions numbered by their place in `order`."""
    number = np.empty(len(parent), dtype=np.int64)
    number[order] = np.arange(len(order))
    return np.where(parent[order] < 0, -1, number[parent[order]]), number[basins]


def merge_regions(
    neighbor: Int[np.ndarray, " m"], ends: Bool[np.ndarray, " m"]
) -> Int[np.ndarray, " m"]:
    """Merge each region that ends with its neighbor, and return what each region becomes."""
    m = len(neighbor)
    _, merged = label_components(m, np.flatnonzero(ends), neighbor[ends])
    # Each component of the graph holds exactly one region that does not end.
    remains = np.empty(m, dtype=np.int64)
    remains[merged[~ends]] = np.flatnonzero(~ends)
    return remains[merged]
