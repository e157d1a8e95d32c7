"""The heat descriptor of a shape, scores of two, and the features that correspond (thesis 5.3)."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.distance import cdist

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.errors import InvalidParameterError
from eigenshape.retrieval.heat.recipe import HeatRecipe


@record
class HeatDescriptor(ReadOnly):
    """A shape described by m feature points with q numbers each.

    Parameters
    ----------
    vectors : (m, q) float
        One row for each feature point, without unit. Copied, then read-only.
    vertices : (m,) int
        The vertex of each feature point. Copied, then read-only.
    recipe : HeatRecipe

    See Also
    --------
    matching_score, match_features

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("fish", n_vertices=500)
    >>> es.describe(mesh, es.retrieval.SCALE_FREE).vectors.shape
    (15, 15)
    """

    vectors: Float[np.ndarray, "m q"]
    vertices: Int[np.ndarray, " m"]
    recipe: HeatRecipe

    def __post_init__(self) -> None:
        vars(self).update(vectors=freeze(self.vectors), vertices=freeze(self.vertices))


NUMBERS_AT_ONCE = 4_000_000  # distances held at a time: 32 MB
# Added to a score for each step of relative size and each number compared. A part has less area
# than the whole, but without a price any shape would choose the size that suits it.
SHIFT_PRICE = 0.03


def matching_score(first: HeatDescriptor, second: HeatDescriptor) -> float:
    """Sum the distances from each feature to the nearest feature of the other shape.

    sum_{f in F1} min_{g in F2} |f - g|_1 + sum_{g in F2} min_{f in F1} |f - g|_1     (thesis 5.3)

    If the recipe has shifts, the score is the least such sum over relative sizes of the two shapes,
    with a small price for each step of size.

    Parameters
    ----------
    first, second : HeatDescriptor
        By the same recipe.

    Returns
    -------
    float
        0 for equal descriptors. Symmetric, but not a metric: the triangle inequality may fail.

    Raises
    ------
    InvalidParameterError
        If the recipes differ.

    See Also
    --------
    match_features, patch_scores, ShapeIndex.query

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, again, bird = (
    ...     es.describe(es.make_creature(kind, pose, n_vertices=500), es.retrieval.SCALE_FREE)
    ...     for kind, pose in (("fish", 0), ("fish", 1), ("bird", 0))
    ... )
    >>> es.retrieval.matching_score(fish, fish)
    0.0
    >>> es.retrieval.matching_score(fish, again) < es.retrieval.matching_score(fish, bird)
    True
    """
    return _score_and_shift(first, second)[0]


def _score_and_shift(first: HeatDescriptor, second: HeatDescriptor) -> tuple[float, int]:
    require_type(first, HeatDescriptor, "first")
    require_type(second, HeatDescriptor, "second")
    if first.recipe != second.recipe:
        raise InvalidParameterError(
            f"Only descriptors by the same recipe compare; the first is by {first.recipe}, the "
            f"second by {second.recipe}. Describe both by one recipe."
        )
    scores, shifts = matching_scores(first.vectors, second.vectors, np.array([0]), first.recipe)
    return float(scores[0]), int(shifts[0])


def matching_scores(
    query: Float[np.ndarray, "m q"],
    rows: Float[np.ndarray, "r q"],
    starts: Int[np.ndarray, " s"],
    recipe: HeatRecipe,
) -> tuple[Float[np.ndarray, " s"], Int[np.ndarray, " s"]]:
    """Score one descriptor against many, whose rows are stacked and begin at `starts`.

    Returns
    -------
    scores : (s,) float
    shifts : (s,) int
        Steps of scale by which the query is smaller than each shape, at the least score.
    """
    best = np.full(len(starts), np.inf)
    shifts = np.zeros(len(starts), dtype=np.int64)
    n_rows = np.diff(np.append(starts, len(rows)))
    for shift in sorted(range(-recipe.n_shifts, recipe.n_shifts + 1), key=abs):
        ours, theirs = shift_columns(query, rows, shift, recipe)
        stretch = query.shape[1] / ours.shape[1]  # so that sums over fewer columns compare
        price = SHIFT_PRICE * abs(shift) * query.shape[1] * (len(query) + n_rows) / 2
        scores = stretch * _sums_of_nearest(ours, theirs, starts) + price
        shifts[scores < best] = shift
        best = np.minimum(best, scores)
    return best, shifts


def shift_columns(
    first: Float[np.ndarray, "m q"],
    second: Float[np.ndarray, "r q"],
    shift: int,
    recipe: HeatRecipe,
) -> tuple[Float[np.ndarray, "m c"], Float[np.ndarray, "r c"]]:
    """Return the columns that compare if the first shape has ratio^-shift of the second's area.

    Scale s of the first is then scale s - shift of the second, and its heat times area is
    ratio^-shift times that of the second.
    """
    if not shift:
        return first, second
    columns = first.shape[1]
    step = float(np.log(recipe.scales[1] / recipe.scales[0]))
    ours = first[:, max(shift, 0) : columns + min(shift, 0)] + shift * step
    return ours, second[:, max(-shift, 0) : columns - max(shift, 0)]


def _sums_of_nearest(
    query: Float[np.ndarray, "m c"], rows: Float[np.ndarray, "r c"], starts: Int[np.ndarray, " s"]
) -> Float[np.ndarray, " s"]:
    sums = np.empty(len(starts))
    ends = np.append(starts[1:], len(rows))
    budget = max(NUMBERS_AT_ONCE // len(query), 1)
    first = 0
    while first < len(starts):
        last = max(int(np.searchsorted(ends, starts[first] + budget, side="right")), first + 1)
        distances = cdist(query, rows[starts[first] : ends[last - 1]], "cityblock")
        begin = starts[first:last] - starts[first]
        to_rows = np.minimum.reduceat(distances, begin, axis=1).sum(axis=0)
        sums[first:last] = to_rows + np.add.reduceat(distances.min(axis=0), begin)
        first = last
    return sums


def match_features(first: HeatDescriptor, second: HeatDescriptor) -> Int[np.ndarray, "p 2"]:
    """Pair the features of two shapes that are each other's nearest.

    If the recipe has shifts, descriptors are compared at the relative size of the best score.

    Parameters
    ----------
    first, second : HeatDescriptor
        By the same recipe.

    Returns
    -------
    (p, 2) int
        Number of a feature of the first shape, and of one of the second; closest pairs first.

    Raises
    ------
    InvalidParameterError
        If the recipes differ.

    See Also
    --------
    matching_score, match_patches

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    >>> pairs = es.retrieval.match_features(fish, fish)
    >>> bool((pairs[:, 0] == pairs[:, 1]).all())
    True
    """
    _, shift = _score_and_shift(first, second)
    ours, theirs = shift_columns(first.vectors, second.vectors, shift, first.recipe)
    distances = cdist(ours, theirs, "cityblock")
    forth, back = distances.argmin(axis=1), distances.argmin(axis=0)
    one = np.flatnonzero(back[forth] == np.arange(len(forth)))
    pairs = np.column_stack([one, forth[one]])
    return pairs[np.argsort(distances[one, forth[one]], kind="stable")]
