"""Score a query by patches: compare codes with all shapes, then verify the nearest by matching."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float, Int8

from eigenshape._arguments import require_each, require_type
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import patch_distances, view_distances
from eigenshape.retrieval.patches.matching import patch_agreement

N_VERIFIED = 30  # nearest shapes whose points are matched; the time of a query grows with it
# How much agreement counts beside the distance of codes, whose weight is 1. Agreements are small:
# a good match has 0.1.
AGREEMENT_WEIGHT = 6.0
SHAPES_AT_ONCE = 64  # shapes whose codes are converted to floats at a time, to bound memory


def code_distances(
    query: Int8[np.ndarray, "u b s v"], others: Sequence[Int8[np.ndarray, "_ b s v"]]
) -> Float[np.ndarray, " k"]:
    """Return `view_distances` from the codes of a shape and its views to those of k others."""
    ours = query.astype(np.float32)
    distances = []
    for first in range(0, len(others), SHAPES_AT_ONCE):
        codes = [each.astype(np.float32) for each in others[first : first + SHAPES_AT_ONCE]]
        wholes = np.stack([each[0] for each in codes])
        views = np.concatenate([each[1:] for each in codes])
        shape_of_view = np.repeat(np.arange(len(codes)), [len(each) - 1 for each in codes])
        distances.append(
            view_distances(ours[0], wholes, views, shape_of_view, query_views=ours[1:])
        )
    return np.concatenate(distances)


def verified_scores(
    query: PatchDescriptor,
    other: Callable[[int], PatchDescriptor],
    distances: Float[np.ndarray, " k"],
    *,
    n_verified: int = N_VERIFIED,
) -> Float[np.ndarray, " k"]:
    """Lower the scores of the nearest shapes whose points match those of the query.

    Codes tell which patches a shape has, but not where. So the points of the nearest shapes are
    matched with those of the query (`match_patches`). A score is the weighted mean of the distance
    and of 1 - agreement, with weights 1 and 6.

    Parameters
    ----------
    query : PatchDescriptor
    other : callable
        Return the descriptor of a shape by its number below k; called for the nearest only.
    distances : (k,) float
        Of `code_distances`.
    n_verified : int
        Nearest shapes to verify; the agreement of the others counts as 0.

    Returns
    -------
    (k,) float
        As of `patch_scores`.
    """
    disagreement = np.ones(len(distances))
    for place in np.argsort(distances, kind="stable")[:n_verified].tolist():
        disagreement[place] -= shape_agreement(query, other(place))
    return (distances + AGREEMENT_WEIGHT * disagreement) / (1 + AGREEMENT_WEIGHT)


def patch_scores(
    query: PatchDescriptor, others: Sequence[PatchDescriptor], *, verify: bool = True
) -> Float[np.ndarray, " k"]:
    """Score a query against k shapes described by patches, as an index does.

    Codes are compared with all shapes (bag of features); the nearest 30 are then verified
    geometrically, by matching points that keep their distances along the surface.

    Parameters
    ----------
    query : PatchDescriptor
    others : sequence of k PatchDescriptor
        With the codebook of the query.
    verify : bool
        If False, return the distances of codes alone.

    Returns
    -------
    (k,) float
        0 for the same descriptor, up to rounding; about 1 if nothing is alike. The same surface
        with other vertex numbers is sampled at other points, and may score up to about 0.8.

    See Also
    --------
    ShapeIndex.query, match_patches, matching_score

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, bird = (
    ...     es.describe(es.make_creature(kind, n_vertices=500)) for kind in ("fish", "bird")
    ... )
    >>> scores = es.retrieval.patch_scores(fish, [fish, bird])
    >>> bool(scores[0] < 0.01 < 0.5 < scores[1])
    True
    """
    require_type(query, PatchDescriptor, "query")
    require_each(others, PatchDescriptor, "others")
    with one_blas_thread():
        distances = code_distances(query.codes, [other.codes for other in others])
        return verified_scores(query, others.__getitem__, distances) if verify else distances


def shape_agreement(query: PatchDescriptor, other: PatchDescriptor) -> float:
    """Average the agreement with a shape, and the better of this and that with its nearest view.

    If the other is open and the query is closed, the nearest view of the query serves likewise.
    """
    own = patch_agreement(query.points[0], other.points[0])
    if len(other.codes) > 1:
        view = patch_agreement(query.points[0], other.points[_nearest_view(query, other)])
    elif len(query.codes) > 1:
        view = patch_agreement(query.points[_nearest_view(other, query)], other.points[0])
    else:
        return own
    return (own + max(own, view)) / 2


def _nearest_view(one: PatchDescriptor, seen: PatchDescriptor) -> int:
    """Return which view of `seen`, from 1 on, is nearest to `one` as a whole."""
    whole, views = one.codes[0].astype(np.float32), seen.codes[1:].astype(np.float32)
    return 1 + int(patch_distances(whole, views).argmin())
