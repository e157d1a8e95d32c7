"""How far apart two descriptors are, and which of their features belong together (thesis 5.3)."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.descriptor import ShapeDescriptor

NUMBERS_AT_ONCE = 4_000_000


def matching_score(first: ShapeDescriptor, second: ShapeDescriptor) -> float:
    """Sum over the features of both shapes the L1 distance to the nearest feature of the other.

    sum_{f in F1} min_{g in F2} |f - g|_1 + sum_{g in F2} min_{f in F1} |f - g|_1              (thesis 5.3)

    Symmetric, 0 for equal descriptors, and no metric: the triangle inequality need not hold.

    Raises
    ------
    InvalidParameterError
        If the two were made by different recipes.
    """
    _require_one_recipe(first, second)
    return float(matching_scores(first.vectors, second.vectors, np.array([0]))[0])


def matching_scores(
    query: Float[np.ndarray, "m q"], rows: Float[np.ndarray, "r q"], starts: Int[np.ndarray, " s"]
) -> Float[np.ndarray, " s"]:
    """Score one descriptor against many, whose rows stand below each other from `starts` on."""
    scores = np.empty(len(starts))
    ends = np.append(starts[1:], len(rows))
    budget = max(NUMBERS_AT_ONCE // query.size, 1)
    first = 0
    while first < len(starts):
        last = max(int(np.searchsorted(ends, starts[first] + budget, side="right")), first + 1)
        block = slice(starts[first], ends[last - 1])
        distances = np.abs(query[:, None, :] - rows[None, block, :]).sum(axis=2)
        begin = starts[first:last] - starts[first]
        to_rows = np.minimum.reduceat(distances, begin, axis=1).sum(axis=0)
        scores[first:last] = to_rows + np.add.reduceat(distances.min(axis=0), begin)
        first = last
    return scores


def match_features(first: ShapeDescriptor, second: ShapeDescriptor) -> Int[np.ndarray, "p 2"]:
    """Pair the features that are each other's nearest, closest pairs first.

    Returns
    -------
    (p, 2) int
        Feature of the first shape, feature of the second.

    Raises
    ------
    InvalidParameterError
        If the two were made by different recipes.
    """
    _require_one_recipe(first, second)
    distances = np.abs(first.vectors[:, None, :] - second.vectors[None, :, :]).sum(axis=2)
    forth, back = distances.argmin(axis=1), distances.argmin(axis=0)
    one = np.flatnonzero(back[forth] == np.arange(len(forth)))
    pairs = np.column_stack([one, forth[one]])
    return pairs[np.argsort(distances[one, forth[one]], kind="stable")]


def _require_one_recipe(first: ShapeDescriptor, second: ShapeDescriptor) -> None:
    if first.recipe != second.recipe:
        raise InvalidParameterError(
            f"Only descriptors of one recipe compare; the first is of {first.recipe}, the second of {second.recipe}."
        )
