"""Which points of one shape are which of another: patches that look alike, and keep their distances to each other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.patches.codebook import BASES, N_SIZES, PatchCodebook, whitened
from eigenshape.retrieval.patches.matching_loops import leading, nearest_of_each_other
from eigenshape.retrieval.patches.patches import RADII, Patches

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
        0 where nothing agrees; 1 where all points of the first match and keep all distances, piece by piece. Not
        symmetric: the area of the first counts, of which the second may be the whole.
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
    require_type(shape, Patches, "shape")
    require_type(codebook, PatchCodebook, "codebook")
    rows = [
        whitened(shape, base + size, codebook, place)
        for place, base in enumerate(BASES)
        for size in range(N_SIZES)
    ]
    whitened_rows = np.stack(rows, axis=1)[:, :, :N_MATCHED] / NUMBER_STEP
    numbers = NUMBER_STEP * np.clip(np.rint(whitened_rows), -LARGEST, LARGEST).astype(np.float32)
    weights, distances = (
        part.astype(np.float16) for part in (shape.weights.max(axis=1), shape.distances)
    )
    return PatchPoints(
        frozen(numbers),
        frozen(weights.astype(np.float32)),
        frozen(distances.astype(np.float32)),
        shape.vertices,
    )


@one_blas_thread()
def match_patches(first: PatchPoints, second: PatchPoints) -> PatchMatch:
    """Match points whose patches are each other's nearest, and keep the matches that agree with the most of others.

    Two matches agree as far as the distance along the surface between their points is the same on both shapes. The
    leading eigenvector of this agreement tells which matches belong to the largest consistent set, and its eigenvalue
    how large that is (Leordeanu and Hebert 2005). Each piece of the first is matched with one piece of the second. Of
    relative sizes, 1.25 a step and two either way, the one whose agreement is largest counts. Then all points are
    matched once more, by their patches and by their distances to the surest twenty. Left and right cannot be told by
    distances: all of a match may be mirrored.

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
    require_type(first, PatchPoints, "first")
    require_type(second, PatchPoints, "second")
    found = _best_start(first, second)
    apart = _apart(first, second, found.step)
    strained = apart + ANCHORED * np.median(apart) * _strain(first, second, found)
    points = _supported(_consistent(first, second, strained, found.step), SURE)
    vertices = np.column_stack([first.vertices[points[:, 0]], second.vertices[points[:, 1]]])
    return PatchMatch(frozen(points), frozen(vertices), found.agreement, found.step)


@one_blas_thread()
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


def _consistent(
    first: PatchPoints, second: PatchPoints, apart: Float32[np.ndarray, "m n"], step: int
) -> _Matches:
    """Match nearest points, and rate the matches piece by piece, since no distance leads to another piece.

    Each piece of the first is matched with one piece of the second, those that agree most first.
    What agrees in a piece is a share of what its matches with itself would, times its area.
    """
    rows, columns = nearest_of_each_other(apart)
    shares = first.weights.astype(np.float64) / first.weights.sum(dtype=np.float64)
    ours, theirs = _pieces(first), _pieces(second)
    pairs = []
    for one, two in sorted(set(zip(ours[rows].tolist(), theirs[columns].tolist(), strict=True))):
        places = np.flatnonzero((ours[rows] == one) & (theirs[columns] == two))
        own, other = rows[places], columns[places]
        between = first.distances[np.ix_(own, own)], second.distances[np.ix_(other, other)]
        value, support = leading(*between, shares[own], SIZE_STEP**step, SLACK, LEAST_LENGTH)
        if value > 0:
            piece = shares[ours == one]
            # No match agrees with itself, so that even a perfect eigenvalue is below the area.
            perfect = piece.sum() - (piece**2).sum() / piece.sum()
            agreement = piece.sum() * min(value / perfect, 1.0)
            pairs.append((agreement, one, two, places, support * np.sqrt(value)))
    total, supports = 0.0, np.zeros(len(rows))
    matched: tuple[set[int], set[int]] = set(), set()
    for agreement, one, two, places, support in sorted(pairs, key=lambda pair: -pair[0]):
        if one not in matched[0] and two not in matched[1]:
            matched[0].add(one)
            matched[1].add(two)
            total += float(agreement)
            supports[places] = support
    order = np.argsort(-supports, kind="stable")
    return _Matches(np.column_stack([rows, columns])[order], supports[order], total, step)


def _pieces(points: PatchPoints) -> Int[np.ndarray, " m"]:
    """Return for each point the first point of its piece."""
    if np.isfinite(points.distances[0]).all():  # by far the most shapes
        return np.zeros(len(points.vertices), dtype=np.int64)
    return np.isfinite(points.distances).argmax(axis=1)


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
