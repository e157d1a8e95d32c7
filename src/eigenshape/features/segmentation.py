"""Cut a merge tree, by number or by persistence, into parts around feature points."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import InvalidParameterError
from eigenshape._arrays import face_labels
from eigenshape.features.region_tree import MergeTree, PartTree, merge_regions
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.topology import edge_table

Tree = MergeTree | PartTree


@record
class FeaturePoints(ReadOnly):
    """The maxima that remain after a cut, sorted by falling persistence, then by falling height.

    Attributes
    ----------
    vertices : (m,) int
        Vertex of each maximum.
    values : (m,) float
        Function at each maximum.
    persistence : (m,) float
        In the function's unit; infinite for the highest maximum of each component.

    See Also
    --------
    segment : Compute feature points and their regions.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> tree = es.merge_tree(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> features = es.segment(tree, n_regions=2).features
    >>> features.vertices, features.persistence
    (array([7, 3]), array([inf,  1.]))
    """

    vertices: Int[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    persistence: Float[np.ndarray, " m"]


@record
class Segmentation(ReadOnly):
    """A partition of a surface into regions, one around each feature point.

    Attributes
    ----------
    labels : (f,) int
        For each face, the index of its feature point.
    features : FeaturePoints

    See Also
    --------
    segment : Compute a segmentation.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> tree = es.merge_tree(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> parts = es.segment(tree, n_regions=2)
    >>> parts.features.vertices, np.bincount(parts.labels)
    (array([7, 3]), array([4, 4]))
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
    """Cut a merge tree into regions.

    Regions are merged in the order of rising persistence until the given rule stops. Give exactly
    one rule.

    Parameters
    ----------
    tree : MergeTree or PartTree
    n_regions : int, optional
        Number of regions to keep, at least 1. Fewer are kept if the function has fewer maxima; more
        if the surface has more components, each of which keeps one.
    persistence : float, optional
        Keep the regions with at least this persistence (thesis proposition 5.2.2). At least 0, in
        the function's unit; without unit for a `PartTree`. Infinity keeps one region per component.
    largest_gap : bool, optional
        Cut at the largest gap of the sorted finite persistences, followed by 0 (Chazal, Guibas,
        Oudot and Skraba 2013); of equal gaps, at the one of higher persistence.

    Returns
    -------
    Segmentation

    Raises
    ------
    InvalidParameterError
        If not exactly one rule is given, `n_regions` is less than 1, or `persistence` is less than
        0.

    See Also
    --------
    merge_tree : Compute the tree of a function.
    find_parts : Find limbs, head and torso.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> tree = es.merge_tree(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> parts = es.segment(tree, n_regions=2)
    >>> parts.labels
    array([1, 1, 0, 0, 1, 1, 0, 0])
    >>> parts.features.values
    array([3., 2.])

    The lower maximum has persistence 1, so a threshold above 1 leaves one region:

    >>> es.segment(tree, persistence=1.5).labels
    array([0, 0, 0, 0, 0, 0, 0, 0])
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
        count = whole_number(n_regions, "n_regions", 1)
        # The last region of a component has no parent, so it stays whatever the number.
        ends = (np.arange(len(tree.maxima)) >= count) & (tree.parent >= 0)
    else:
        least = persistence
        if least is None:  # just above the largest gap; all stay if none is finite
            finite = tree.persistence[tree.parent >= 0]
            gaps = finite - np.append(finite[1:], 0.0)
            least = float(finite[np.argmax(gaps)]) if len(finite) else float(np.inf)
        if not least >= 0:
            raise InvalidParameterError(f"persistence must be at least 0; it is {least}.")
        ends = tree.persistence < least

    kept = np.flatnonzero(~ends)
    regions = merge_regions(np.maximum(tree.parent, 0), ends)[tree.basins]
    features = FeaturePoints(
        vertices=tree.maxima[kept],
        values=tree.values[kept],
        persistence=tree.persistence[kept],
    )
    return Segmentation(np.searchsorted(kept, regions), features)


def adjacent_parts(mesh: MeshLike, labels: Int[np.ndarray, " f"]) -> Int[np.ndarray, "p 2"]:
    """List the pairs of parts that share an edge.

    Parameters
    ----------
    mesh : MeshLike
    labels : (f,) int
        The part of each face.

    Returns
    -------
    (p, 2) int
        Pairs of labels without duplicates, the lower label first, in ascending order.

    Raises
    ------
    InvalidParameterError
        If `labels` does not hold one whole number per face.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> es.features.adjacent_parts(es.shapes.grid(4, 1), np.array([0, 0, 1, 2, 0, 0, 1, 2]))
    array([[0, 1],
           [1, 2]])
    """
    mesh = as_mesh(mesh)
    parts = face_labels(labels, "labels", mesh)
    faces, _ = edge_table(mesh).face_pairs
    pairs = np.sort(parts[faces], axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def merge_targets(tree: Tree) -> Int[np.ndarray, " m"]:
    """Return, for each maximum, the maximum whose region absorbs it, or -1 if none does.

    `tree.parent` is the maximum across the saddle. If the region of that maximum was absorbed
    earlier, the target is the maximum that absorbed it, and so on.

    Parameters
    ----------
    tree : MergeTree or PartTree

    Returns
    -------
    (m,) int

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> tree = es.merge_tree(mesh, [0, 0, 2, 2, 1, 1, 3, 3, 0, 0])
    >>> es.features.merge_targets(tree)
    array([-1,  0])
    """
    require_type(tree, Tree, "tree")
    target = tree.parent.copy()
    for number in range(len(target)):
        # Maxima are sorted by falling persistence: a later one has been absorbed before this one.
        while target[number] > number:
            target[number] = tree.parent[target[number]]
    return target
