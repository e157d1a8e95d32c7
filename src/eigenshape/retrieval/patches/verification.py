"""How far a query is from many shapes: by their words first, and the nearest by how their patches lie."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float, Int8

from eigenshape._arguments import require_each, require_type
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import patch_distances, view_distances
from eigenshape.retrieval.patches.matching import patch_agreement

N_VERIFIED = 30
WORTH = 6.0  # times a distance; a good match has an agreement of .1
AT_ONCE = 64  # shapes whose codes are floats at a time


def word_distances(
    query: Int8[np.ndarray, "u b s v"], others: Sequence[Int8[np.ndarray, "_ b s v"]]
) -> Float[np.ndarray, " k"]:
    """Return `view_distances` of the codes of a shape and its views to those of k others."""
    ours = query.astype(np.float32)
    parts = [others[first : first + AT_ONCE] for first in range(0, len(others), AT_ONCE)]
    return np.concatenate(
        [_distances(ours, [codes.astype(np.float32) for codes in part]) for part in parts]
    )


def _distances(
    query: Float[np.ndarray, "u b s v"], others: Sequence[Float[np.ndarray, "_ b s v"]]
) -> Float[np.ndarray, " k"]:
    of = np.repeat(np.arange(len(others)), [len(codes) - 1 for codes in others])
    wholes, views = (
        np.stack([codes[0] for codes in others]),
        np.concatenate([codes[1:] for codes in others]),
    )
    return view_distances(query[0], wholes, views, of, query_views=query[1:])


def verified_scores(
    query: PatchDescriptor,
    other: Callable[[int], PatchDescriptor],
    distances: Float[np.ndarray, " k"],
    *,
    n_verified: int = N_VERIFIED,
) -> Float[np.ndarray, " k"]:
    """Return the mean of a distance and of what matched points lack in agreement, which counts six times.

    Fisher vectors tell which patches there are, and not where. So the points of the nearest shapes are matched with
    those of the query (`match_patches`), and what keeps its distances comes nearer.

    Parameters
    ----------
    query : PatchDescriptor
    other : callable
        From a number below k to the descriptor that has this place in `distances`; called for the nearest alone.
    distances : (k,) float
        Of `word_distances`.
    n_verified : int
        Nearest shapes that are verified; the others count as if nothing agreed.

    Returns
    -------
    (k,) float
        0 for the same descriptor up to rounding, about 1 where nothing is alike. The same surface with other vertex
        numbers is sampled at other points, and may score up to about 0.8.
    """
    lacking = np.ones(len(distances))
    for place in np.argsort(distances, kind="stable")[:n_verified].tolist():
        lacking[place] -= shape_agreement(query, other(place))
    return (distances + WORTH * lacking) / (1 + WORTH)


def patch_scores(
    query: PatchDescriptor, others: Sequence[PatchDescriptor]
) -> Float[np.ndarray, " k"]:
    """Score a query against described shapes as an index does: by words, the nearest 30 verified.

    Parameters
    ----------
    query : PatchDescriptor
    others : sequence of k PatchDescriptor
        Of one recipe with the query.

    Returns
    -------
    (k,) float
        0 for the same descriptor up to rounding, about 1 where nothing is alike. The same surface with other vertex
        numbers is sampled at other points, and may score up to about 0.8.
    """
    require_type(query, PatchDescriptor, "query")
    require_each(others, PatchDescriptor, "others")
    with one_blas_thread():
        distances = word_distances(query.codes, [other.codes for other in others])
        return verified_scores(query, others.__getitem__, distances)


def shape_agreement(query: PatchDescriptor, other: PatchDescriptor) -> float:
    """Return the mean of the agreement with the shape and of the better of this and that with its nearest view.

    Where the other is open and the query is closed, the query's views serve in the same way: the nearest to the part.
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
    """Return which view of a shape is nearest to another as a whole."""
    return 1 + int(
        patch_distances(
            *(codes.astype(np.float32) for codes in (one.codes[0], seen.codes[1:]))
        ).argmin()
    )
