"""Whether the nearest shapes by patches are really like the query: their patches must lie alike, too."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.codebook import PatchCodebook, encode_patches
from eigenshape.retrieval.patch_matching import PatchPoints, patch_agreement, patch_points
from eigenshape.retrieval.patch_score import patch_distances
from eigenshape.retrieval.patches import Patches

N_VERIFIED = 30
WORTH = 6.0  # of a distance, that agreement of all points would take off; a good match has a tenth of that


@dataclass(frozen=True, eq=False)
class PatchedShape:
    """A shape, and its views where it is closed, by their patches.

    Attributes
    ----------
    codes : (1 + w, b, s, v) float32
        Fisher vectors: the shape's, then those of its views.
    points : tuple of 1 + w PatchPoints
        The same in points.
    """

    codes: Float32[np.ndarray, "w b s v"]
    points: tuple[PatchPoints, ...]


def patched_shape(patches: Sequence[Patches], codebook: PatchCodebook) -> PatchedShape:
    """Encode the patches of a shape, which come first, and of its views.

    Raises
    ------
    InvalidParameterError
        If there are none.
    """
    if not patches:
        raise InvalidParameterError("A patched shape takes patches of the shape, then of its views; there are none.")
    codes = np.stack([encode_patches(each, codebook) for each in patches])
    return PatchedShape(frozen(codes), tuple(patch_points(each, codebook) for each in patches))


def verify_distances(
    query: PatchedShape,
    others: Sequence[PatchedShape],
    distances: Float[np.ndarray, " k"],
    *,
    n_verified: int = N_VERIFIED,
) -> Float[np.ndarray, " k"]:
    """Take from the least distances six times the agreement of matched points.

    Fisher vectors tell which patches there are, and not where. So the points of the nearest shapes are matched with
    those of the query (`match_patches`), and what keeps its distances comes nearer.

    Parameters
    ----------
    query : PatchedShape
    others : sequence of k PatchedShape
        Only the nearest are asked for.
    distances : (k,) float
        As `view_distances` measured them.
    n_verified : int
        Nearest shapes that are verified.

    Returns
    -------
    (k,) float
        May be negative; only their order has a meaning.
    """
    verified = distances.copy()
    for place in np.argsort(distances, kind="stable")[:n_verified]:
        verified[place] -= WORTH * shape_agreement(query, others[place])
    return verified


def shape_agreement(query: PatchedShape, other: PatchedShape) -> float:
    """Return the mean of the agreement with the shape and of the better of this and that with its nearest view.

    Where the other is open and the query is closed, the query's views serve in the same way: the nearest to the part.
    """
    own = patch_agreement(query.points[0], other.points[0])
    if len(other.codes) > 1:
        nearest = 1 + int(patch_distances(query.codes[0], other.codes[1:]).argmin())
        return (own + max(own, patch_agreement(query.points[0], other.points[nearest]))) / 2
    if len(query.codes) > 1:
        nearest = 1 + int(patch_distances(other.codes[0], query.codes[1:]).argmin())
        return (own + max(own, patch_agreement(query.points[nearest], other.points[0]))) / 2
    return own
