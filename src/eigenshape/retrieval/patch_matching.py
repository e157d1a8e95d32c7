"""Which points of one shape are which of another: patches that look alike, and keep their distances to each other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.codebook import BASES, N_SIZES, PatchCodebook, whitened
from eigenshape.retrieval.patch_matching_loops import leading, nearest_of_each_other
from eigenshape.retrieval.patches import RADII, Patches

NUMBER_STEP, LARGEST = 1 / 16, 127  # so that a number is a byte
N_MATCHED = 10  # axes of most variance
SLACK = 0.2  # of a distance, by which it may change and still speak for a match a little
LEAST_LENGTH = 0.05  # sides of the box; errors of shorter distances count as of this
SURE = 0.7  # of the support of the best match, that a match needs to be kept,
ANCHORING = 0.5  # and to be one of those by which all points are matched once more
N_ANCHORS = 20
ANCHORED = 3.0  # typical distances of numbers, that keeping no distance counts as
STEPS = sorted(range(1 - N_SIZES, N_SIZES), key=abs)
SIZE_STEP = float(RADII[1] / RADII[0])


@dataclass(frozen=True, eq=False)
class PatchPoints:
    """The points of a shape as they are matched.

    Attributes
    ----------
    numbers : (m, r, d) float32
        Of m points at r radii, whitened by a codebook, in whole sixteenths below 8.
    weights : (m,) float32
        The most that each weighs at any radius, in half precision.
    distances : (m, m) float32
        Along the surface, in sides of the box, in half precision.
    vertices : (m,) int
    """

    numbers: Float32[np.ndarray, "m r d"]
    weights: Float32[np.ndarray, " m"]
    distances: Float32[np.ndarray, "m m"]
    vertices: Int[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class PatchMatch:
    """What belongs together on two shapes.

    Attributes
    ----------
    points : (p, 2) int
        Number of a point of the first shape and of one of the second, the surest first; each point at most once.
    vertices : (p, 2) int
        Their vertices.
    agreement : float
        0 where nothing agrees; near 1 where all points of the first match and keep all distances. Not symmetric: the
        area of the first counts, of which the second may be the whole.
    step : int
        Lengths of the first are 1.25^-step of those of the second, each in sides of its box.
    """

    points: Int[np.ndarray, "p 2"]
    vertices: Int[np.ndarray, "p 2"]
    agreement: float
    step: int


def patch_points(shape: Patches, codebook: PatchCodebook) -> PatchPoints:
    """Keep of patches what matching needs: ten whitened numbers a radius, by the base radius that this belongs to.

    Parameters
    ----------
    shape : Patches
    codebook : PatchCodebook

    Returns
    -------
    PatchPoints
    """
    rows = [
        whitened(shape, base + size, codebook, place) for place, base in enumerate(BASES) for size in range(N_SIZES)
    ]
    whitened_rows = np.stack(rows, axis=1)[:, :, :N_MATCHED] / NUMBER_STEP
    numbers = NUMBER_STEP * np.clip(np.rint(whitened_rows), -LARGEST, LARGEST).astype(np.float32)
    weights, distances = (part.astype(np.float16) for part in (shape.weights.max(axis=1), shape.distances))
    return PatchPoints(
        frozen(numbers), frozen(weights.astype(np.float32)), frozen(distances.astype(np.float32)), shape.vertices
    )


def match_patches(first: PatchPoints, second: PatchPoints) -> PatchMatch:
    """Match points whose patches are each other's nearest, and keep the matches that agree with the most of others.

    Two matches agree as far as the distance along the surface between their points is the same on both shapes. The
    leading eigenvector of this agreement tells which matches belong to the largest consistent set, and its eigenvalue
    how large that is (Leordeanu and Hebert 2005). Of relative sizes, 1.25 a step and two either way, the one whose
    eigenvalue is largest counts. Then all points are matched once more, by their patches and by their distances to
    the surest twenty. Left and right cannot be told by distances: all of a match may be mirrored.

    Parameters
    ----------
    first, second : PatchPoints
        Of one codebook.

    Returns
    -------
    PatchMatch

    Raises
    ------
    InvalidParameterError
        If the two have different numbers a point.
    """
    found = _best_start(first, second)
    apart = _apart(first, second, found.step)
    strained = apart + ANCHORED * np.median(apart) * _strain(first, second, found)
    points = _supported(_consistent(first, second, strained, found.step), SURE)
    vertices = np.column_stack([first.vertices[points[:, 0]], second.vertices[points[:, 1]]])
    return PatchMatch(frozen(points), frozen(vertices), found.agreement, found.step)


def patch_agreement(first: PatchPoints, second: PatchPoints) -> float:
    """Return the agreement of `match_patches`, without its second round."""
    return _best_start(first, second).agreement


@dataclass(frozen=True, eq=False)
class _Matches:
    """Matches at one relative size, the best supported first."""

    points: Int[np.ndarray, "p 2"]
    support: Float[np.ndarray, " p"]
    agreement: float
    step: int


def _best_start(first: PatchPoints, second: PatchPoints) -> _Matches:
    _require_alike(first, second)
    starts = (_consistent(first, second, _apart(first, second, step), step) for step in STEPS)
    return max(starts, key=lambda matches: matches.agreement)


def _consistent(first: PatchPoints, second: PatchPoints, apart: Float32[np.ndarray, "m n"], step: int) -> _Matches:
    rows, columns = nearest_of_each_other(apart)
    areas = first.weights.astype(np.float64)
    shares = areas[rows] / areas.sum()
    ours, theirs = first.distances[np.ix_(rows, rows)], second.distances[np.ix_(columns, columns)]
    agreement, vector = leading(ours, theirs, shares, SIZE_STEP**step, SLACK, LEAST_LENGTH)
    support = vector / np.sqrt(shares) if agreement > 0 else np.zeros(len(rows))
    order = np.argsort(-support, kind="stable")
    return _Matches(np.column_stack([rows, columns])[order], support[order], float(agreement), step)


def _supported(matches: _Matches, share: float) -> Int[np.ndarray, "p 2"]:
    return matches.points[matches.support > share * matches.support.max(initial=0.0)]


def _strain(first: PatchPoints, second: PatchPoints, found: _Matches) -> Float32[np.ndarray, "m n"]:
    """Return how badly each pair of points keeps its distances to the surest matches, 0 to 1."""
    anchors = _supported(found, ANCHORING)[:N_ANCHORS]
    if not len(anchors):
        return np.zeros((len(first.numbers), len(second.numbers)), dtype=np.float32)
    ours = np.float32(SIZE_STEP**found.step) * first.distances[:, None, anchors[:, 0]]
    theirs = second.distances[None, :, anchors[:, 1]]
    longest = np.maximum(np.maximum(ours, theirs), np.float32(LEAST_LENGTH))
    known = np.isfinite(longest)
    errors = np.subtract(ours, theirs, where=known, out=np.ones_like(longest))
    errors = np.divide(errors, np.float32(SLACK) * longest, where=known, out=errors)
    return np.asarray(np.minimum(errors**2, 1).mean(axis=2))


def _apart(first: PatchPoints, second: PatchPoints, step: int) -> Float32[np.ndarray, "m n"]:
    """Return squared distances between the numbers at base radii of one and those some steps on of the other."""
    ours = first.numbers[:, max(-step, 0) :: N_SIZES].reshape(len(first.numbers), -1)
    theirs = second.numbers[:, max(step, 0) :: N_SIZES].reshape(len(second.numbers), -1)
    products = ours @ theirs.T
    return (ours**2).sum(axis=1)[:, None] - 2 * products + (theirs**2).sum(axis=1)


def _require_alike(first: PatchPoints, second: PatchPoints) -> None:
    if first.numbers.shape[1:] != second.numbers.shape[1:]:
        raise InvalidParameterError(
            f"Only points of one codebook match; the first have {first.numbers.shape[1:]} numbers each, the second "
            f"{second.numbers.shape[1:]}."
        )
