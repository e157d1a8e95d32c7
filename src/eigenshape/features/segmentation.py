"""Cut a merge tree, by number or by persistence, into parts around feature points."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.features.merge_tree import MergeTree, merged_regions
from eigenshape.features.part_hierarchy import PartTree
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.topology import edge_table, face_pairs

Tree = MergeTree | PartTree


@dataclass(frozen=True, eq=False)
class FeaturePoints:
    """The maxima that a cut left, most persistent first, ties by height.

    Attributes
    ----------
    vertices : (m,) int
    values : (m,) float
        Function at each.
    persistence : (m,) float
        In the function's unit; infinite for the highest of each component.
    """

    vertices: Int[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    persistence: Float[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A part of the surface around each feature point.

    Attributes
    ----------
    labels : (f,) int
        For each face, the feature point in whose part it lies.
    features : FeaturePoints
    """

    labels: Int[np.ndarray, " f"]
    features: FeaturePoints


def segment(
    tree: Tree,
    *,
    n_regions: int | None = None,
    persistence: float | None = None,
    largest_gap: bool = False,
) -> Segmentation:
    """Merge regions in the order of their persistence until so many are left, or all left persist so long.

    Parameters
    ----------
    tree : MergeTree or PartTree
    n_regions : int
        Regions to leave, at least 1: fewer are left where the function has fewer maxima, more where the surface has
        more components, each of which keeps one.
    persistence : float
        Regions that persist at least this long are left (thesis proposition 5.2.2); at least 0, in the function's
        unit, of a `PartTree` a share without unit, infinite to leave one a component.
    largest_gap : bool
        Cut where persistence, sorted and ending in 0, falls most from one region to the next, as is done by eye in a
        persistence diagram (Chazal, Guibas, Oudot and Skraba 2013); of equal gaps at the more persistent. Regions
        that persist for ever are left and do not count.

    Returns
    -------
    Segmentation

    Raises
    ------
    InvalidParameterError
        If not exactly one of the three is given, or it is below its least value.
    """
    require_type(tree, Tree, "tree")
    rules = {"n_regions": n_regions, "persistence": persistence, "largest_gap": largest_gap or None}
    given = [name for name, value in rules.items() if value is not None]
    if len(given) != 1:
        raise InvalidParameterError(
            "segment takes exactly one of n_regions, persistence and largest_gap; it was given "
            f"{' and '.join(given) or 'none'}."
        )
    if n_regions is not None:
        return _cut(tree, _beyond_number(tree, n_regions))
    return _cut(
        tree, _below(tree, _above_largest_gap(tree) if persistence is None else persistence)
    )


def _cut(tree: Tree, ends: Bool[np.ndarray, " m"]) -> Segmentation:
    left = np.flatnonzero(~ends)
    regions = merged_regions(np.maximum(tree.parent, 0), ends)[tree.basins]
    features = FeaturePoints(
        vertices=frozen(tree.maxima[left]),
        values=frozen(tree.values[left]),
        persistence=frozen(tree.persistence[left]),
    )
    return Segmentation(frozen(np.searchsorted(left, regions)), features)


def _beyond_number(tree: Tree, n_regions: int) -> Bool[np.ndarray, " m"]:
    count = whole_number(n_regions, "n_regions", 1)
    return (np.arange(len(tree.maxima)) >= count) & (tree.parent >= 0)


def _below(tree: Tree, persistence: float) -> Bool[np.ndarray, " m"]:
    if not persistence >= 0:
        raise InvalidParameterError(f"persistence must be at least 0; it is {persistence}.")
    return tree.persistence < persistence


def _above_largest_gap(tree: Tree) -> float:
    """Return the persistence above the largest gap, infinite where nothing ends."""
    finite = tree.persistence[tree.parent >= 0]
    if not len(finite):
        return float(np.inf)
    return float(finite[np.argmax(finite - np.append(finite[1:], 0.0))])


def touching_parts(mesh: MeshLike, labels: Int[np.ndarray, " f"]) -> Int[np.ndarray, "p 2"]:
    """List the pairs of different labels that meet at an edge, the lower first, ascending."""
    mesh = as_mesh(mesh)
    faces, _ = face_pairs(edge_table(mesh))
    pairs = np.sort(labels[faces], axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def merge_targets(tree: Tree) -> Int[np.ndarray, " m"]:
    """Return for each maximum that in whose region it ends up when it merges, or splits from; -1 where it never does.

    The neighbour across the saddle may have merged before; then it is whoever took that one over, and so on. Maxima
    that stand earlier persist longer, so the first earlier one on the way is it.
    """
    require_type(tree, Tree, "tree")
    target = tree.parent.copy()
    for number in range(len(target)):
        while target[number] > number:
            target[number] = tree.parent[target[number]]
    return target
