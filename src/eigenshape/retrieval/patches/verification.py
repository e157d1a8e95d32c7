"""Score a query by patches: compare codes with all shapes, then verify the nearest by matching."""

from collections.abc import Callable, Sequence
from zlib import crc32

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_each, require_type
from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import (
    measure_isolations,
    packed_distances,
    patch_distances,
    scale_distances,
)
from eigenshape.retrieval.patches.matching import patch_agreement
from eigenshape.retrieval.patches.packing import pack_codes

N_VERIFIED = 30  # nearest shapes whose points are matched; the time of a query grows with it
# How much agreement counts: the score is e^(-8 agreement) times the distance of codes. Unrelated
# shapes agree by 0.05, other poses of one animal by 0.1, and the same surface with other vertex
# numbers by 0.2 to 0.4. Of 8, 10, 12, 15 and 20 the smallest found most on the tuning half of
# experiments/ch5_retrieval, and no less than sums of distance and agreement did.
AGREEMENT_WEIGHT = 8.0


def verified_scores(
    query: PatchDescriptor,
    other: Callable[[int], PatchDescriptor],
    distances: Float[np.ndarray, " k"],
    *,
    n_verified: int = N_VERIFIED,
) -> Float[np.ndarray, " k"]:
    """Lower the scores of the nearest shapes whose points match those of the query.

    Codes tell which patches a shape has, but not where. So the points of the nearest shapes are
    matched with those of the query (`match_patches`). A score is the distance times
    e^(-8 agreement): near 0 for the same shape, either since its codes are the same, as those of a
    sphere, or since its points agree.

    Parameters
    ----------
    query : PatchDescriptor
    other : callable
        Return the descriptor of a shape by its number below k; called for the nearest only.
    distances : (k,) float
        Of `scale_distances`.
    n_verified : int
        Nearest shapes to verify; the agreement of the others counts as 0.

    Returns
    -------
    (k,) float
        As of `patch_scores`.
    """
    agreement = np.zeros(len(distances))
    for place in np.argsort(distances, kind="stable")[:n_verified].tolist():
        agreement[place] = shape_agreement(query, other(place))
    return distances * np.exp(-AGREEMENT_WEIGHT * agreement)


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
        0 for the same descriptor, up to rounding, and below 0.05 for the same surface with other
        vertex numbers, which is sampled at other points. Half of all unrelated shapes score above
        0.86, and one in a hundred below 0.38.

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
    >>> bool(scores[0] < 0.01 < 0.3 < scores[1])
    True
    """
    require_type(query, PatchDescriptor, "query")
    require_each(others, PatchDescriptor, "others")
    with one_blas_thread():
        packed = [pack_codes(other.codes) for other in others]
        # The isolation of each shape among the others, as in an index of them: copies count once.
        checksums = np.array([crc32(rows.tobytes()) for rows in packed], dtype=np.int64)
        distinct, firsts, inverse = np.unique(checksums, return_index=True, return_inverse=True)
        isolations = measure_isolations(
            lambda number: others[firsts[number]].codes[0], len(distinct), np.arange(len(distinct))
        )
        distances = scale_distances(
            query.codes, packed_distances(query.codes, packed), isolations[inverse]
        )
        return verified_scores(query, others.__getitem__, distances) if verify else distances


def shape_agreement(query: PatchDescriptor, other: PatchDescriptor) -> float:
    """Average the agreement with a shape, and the better of this and that of the query's views.

    Views of the query serve if it is closed and the other is open; the nearest by codes counts.
    """
    own = patch_agreement(query.points[0], other.points[0])
    if len(query.points) == 1 or len(other.codes) > 1:
        return own
    nearest = 1 + int(patch_distances(other.codes[0], query.codes[1:]).argmin())
    return (own + max(own, patch_agreement(query.points[nearest], other.points[0]))) / 2
