"""How far apart two descriptors are, and which of their features belong together (thesis 5.3)."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.distance import cdist

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.heat.descriptor import Recipe, ShapeDescriptor

NUMBERS_AT_ONCE = 4_000_000
SHIFT_PRICE = (
    0.03  # of one step, for each number compared: cutting changes the area, but seldom for nothing
)


def matching_score(first: ShapeDescriptor, second: ShapeDescriptor) -> float:
    """Sum over the features of both shapes the L1 distance to the nearest feature of the other.

    sum_{f in F1} min_{g in F2} |f - g|_1 + sum_{g in F2} min_{f in F1} |f - g|_1              (thesis 5.3)

    A recipe with shifts takes the least such sum over relative sizes of the two shapes, each step of size at a small
    price. Symmetric, 0 for equal descriptors, and no metric: the triangle inequality need not hold.

    Raises
    ------
    InvalidParameterError
        If the two were made by different recipes.
    """
    require_type(first, ShapeDescriptor, "first")
    require_type(second, ShapeDescriptor, "second")
    _require_one_recipe(first, second)
    scores, _ = matching_scores(first.vectors, second.vectors, np.array([0]), first.recipe)
    return float(scores[0])


def matching_scores(
    query: Float[np.ndarray, "m q"],
    rows: Float[np.ndarray, "r q"],
    starts: Int[np.ndarray, " s"],
    recipe: Recipe,
) -> tuple[Float[np.ndarray, " s"], Int[np.ndarray, " s"]]:
    """Score one descriptor against many, whose rows stand below each other from `starts` on.

    Returns
    -------
    scores : (s,) float
    shifts : (s,) int
        Steps of scale by which the query is smaller than each shape, where the score is least.
    """
    best = np.full(len(starts), np.inf)
    shifts = np.zeros(len(starts), dtype=np.int64)
    n_rows = np.diff(np.append(starts, len(rows)))
    for shift in sorted(range(-recipe.n_shifts, recipe.n_shifts + 1), key=abs):
        ours, theirs = shifted(query, rows, shift, recipe)
        kept = query.shape[1] / ours.shape[1]  # so that sums over fewer columns compare
        price = SHIFT_PRICE * abs(shift) * query.shape[1] * (len(query) + n_rows) / 2
        scores = kept * _sums_of_nearest(ours, theirs, starts) + price
        shifts[scores < best] = shift
        best = np.minimum(best, scores)
    return best, shifts


def shifted(
    first: Float[np.ndarray, "m q"], second: Float[np.ndarray, "r q"], shift: int, recipe: Recipe
) -> tuple[Float[np.ndarray, "m c"], Float[np.ndarray, "r c"]]:
    """Return the columns that compare when the first shape has scale ratio^-shift of the area of the second.

    Its time s is then the second's time s - shift, and its heat times area is ratio^-shift as high.
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
        distances = _distances(query, rows[starts[first] : ends[last - 1]])
        begin = starts[first:last] - starts[first]
        to_rows = np.minimum.reduceat(distances, begin, axis=1).sum(axis=0)
        sums[first:last] = to_rows + np.add.reduceat(distances.min(axis=0), begin)
        first = last
    return sums


def _distances(
    first: Float[np.ndarray, "m c"], second: Float[np.ndarray, "r c"]
) -> Float[np.ndarray, "m r"]:
    return cdist(first, second, "cityblock")


def match_features(first: ShapeDescriptor, second: ShapeDescriptor) -> Int[np.ndarray, "p 2"]:
    """Pair the features that are each other's nearest, closest pairs first, at the relative size of the best score.

    Returns
    -------
    (p, 2) int
        Feature of the first shape, feature of the second.

    Raises
    ------
    InvalidParameterError
        If the two were made by different recipes.
    """
    require_type(first, ShapeDescriptor, "first")
    require_type(second, ShapeDescriptor, "second")
    _require_one_recipe(first, second)
    _, shifts = matching_scores(first.vectors, second.vectors, np.array([0]), first.recipe)
    distances = _distances(*shifted(first.vectors, second.vectors, int(shifts[0]), first.recipe))
    forth, back = distances.argmin(axis=1), distances.argmin(axis=0)
    one = np.flatnonzero(back[forth] == np.arange(len(forth)))
    pairs = np.column_stack([one, forth[one]])
    return pairs[np.argsort(distances[one, forth[one]], kind="stable")]


def _require_one_recipe(first: ShapeDescriptor, second: ShapeDescriptor) -> None:
    if first.recipe != second.recipe:
        raise InvalidParameterError(
            f"Only descriptors of one recipe compare; the first is of {first.recipe}, the second of {second.recipe}."
        )
