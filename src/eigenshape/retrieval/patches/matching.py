"""Match points of two shapes whose patches are alike and that keep their distances."""

import zlib

import numpy as np
from jaxtyping import Complex64, Float, Float32, Int, UInt8

from certeig.kit.arguments import require_type
from certeig.kit.arrays import TINY, ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.patches.codebook import N_SIZES, PatchCodebook, whiten_patches
from eigenshape.retrieval.patches.matching_loops import between_landmarks, leading
from eigenshape.retrieval.patches.patches import RADII, Patches

# Whitened numbers are rounded to sixteenths and clipped at 127 of them, so that one is a byte. With
# half a byte, complete queries lost 6 and incomplete ones 5 points of Top-1 where the codebook is
# learned from shapes of the same kinds, and none with the codebook that comes with the library.
LARGEST_STEP = 127
NUMBER_STEP = 1 / 16
N_MATCHED = 10  # axes of most variance by which points are matched; stored bytes grow with it
SLACK = 0.2  # share of a distance by which two matches may disagree and still support each other
LEAST_LENGTH = 0.05  # sides of the box; errors of shorter distances are shares of this
# Support, as a share of that of the best match, that a match needs to be returned, and to be an
# anchor by which all points are matched once more.
LEAST_SUPPORT = 0.7
LEAST_ANCHOR_SUPPORT = 0.5
# Points from which distances are kept; all others follow from these. With 16 mixed databases lost 2
# to 3 points of Top-5; all distances found no more than these, and would take 11 KB in place of 6.
N_LANDMARKS = 40
# Distances that a byte tells apart, in sides of the box: 3 % apart, from 0.0002 to 14
LENGTHS = np.append(0.008 * (1.03 ** np.arange(255) - 1), np.inf).astype(np.float32)
# The same, of a candidate, to be the best of its point
LEAST_CANDIDATE_SUPPORT = 0.3
# Supports of candidates are steady when none changes by more than so many times the largest: single precision,
# in which couplings are, has rounding of 3e-7.
STEADY = 1e-6
N_ANCHORS = 20  # at most; time and memory of the second round grow with it
# What keeping no distance to the anchors counts as, in median squared distances of numbers
STRAIN_WEIGHT = 3.0
# Relative sizes that are tried, in steps of 1.25, no change first
STEPS = sorted(range(1 - N_SIZES, N_SIZES), key=abs)
SIZE_STEP = float(RADII[1] / RADII[0])  # 1.25
# To which positions in the unit box around the origin, and normals, are rounded: they take two bytes, and one
PLACE_STEP, NORMAL_STEP = np.float32(2**-14), np.float32(2**-6)
# How numbers of points, vertices, weights, and places are stored
LENGTH, VERTEX, HALF, PLACE = (np.dtype(name) for name in ("<u4", "<u4", "<f2", "<i2"))


@record
class PatchPoints(ReadOnly):
    """Points of a shape with what matching needs; part of a `PatchDescriptor`.

    Attributes
    ----------
    numbers : (m, r, d) float32
        Of m points at r radii: whitened by a codebook, in whole sixteenths below 8.
    weights : (m,) float32
        Largest weight of each point over all radii, in half precision.
    distances : (m, m) float32
        Along the surface, in sides of the box: to the first 40 points in steps of 3 %, and
        between others the mean of the largest and the smallest that these allow.
    vertices : (m,) int
    places, normals : (m, 3) float32
        Position in a unit box, and unit normal outward, in steps of 2^-14 and 2^-6. They tell a shape from
        its mirror image.

    See Also
    --------
    match_patches, PatchDescriptor

    Examples
    --------
    >>> import eigenshape as es
    >>> points = es.describe(es.make_creature("fish", n_vertices=500)).points[0]
    >>> m = len(points.vertices)
    >>> points.distances.shape == (m, m)
    True
    """

    numbers: Float32[np.ndarray, "m r d"]
    weights: Float32[np.ndarray, " m"]
    distances: Float32[np.ndarray, "m m"]
    vertices: Int[np.ndarray, " m"]
    places: Float32[np.ndarray, "m 3"]
    normals: Float32[np.ndarray, "m 3"]


@record
class PatchMatch(ReadOnly):
    """Points of two shapes that correspond.

    Attributes
    ----------
    points : (p, 2) int
        Number of a point of the first shape, and of one of the second, surest pairs first. Each
        point occurs at most once.
    vertices : (p, 2) int
        Their vertices.
    agreement : float
        0 if nothing agrees; 1 if all points of the first match and keep all distances, component by
        component. Not symmetric: it is a share of the area of the first, which may be a part of the
        second.
    step : int
        Lengths on the first are 1.25^-step of those on the second, each in sides of its box.

    See Also
    --------
    match_patches

    Examples
    --------
    Two poses of a fish, and the vertices that correspond:

    >>> import eigenshape as es
    >>> poses = [es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1)]
    >>> one, two = (es.describe(mesh).points[0] for mesh in poses)
    >>> match = es.retrieval.match_patches(one, two)
    >>> match.vertices.shape == match.points.shape
    True
    >>> ends = [mesh.vertices[match.vertices[:, i]] for i, mesh in enumerate(poses)]
    >>> ends[0].shape == ends[1].shape
    True
    """

    points: Int[np.ndarray, "p 2"]
    vertices: Int[np.ndarray, "p 2"]
    agreement: float
    step: int


def patch_points(shape: Patches, codebook: PatchCodebook) -> PatchPoints:
    """Return what matching needs of patches: ten whitened numbers at each radius."""
    require_type(shape, Patches, "shape")
    require_type(codebook, PatchCodebook, "codebook")
    rows = np.concatenate(whiten_patches(shape, codebook))
    steps = np.stack(list(rows), axis=1)[:, :, :N_MATCHED] / NUMBER_STEP
    clipped = np.clip(np.rint(steps), -LARGEST_STEP, LARGEST_STEP)
    weights = shape.weights.max(axis=1).astype(np.float16)  # as `pack_points` stores them
    lengths = LENGTHS[nearest_lengths(shape.distances[:, :N_LANDMARKS])]
    return PatchPoints(
        NUMBER_STEP * clipped.astype(np.float32),
        weights.astype(np.float32),
        distances_by_landmarks(lengths),
        shape.vertices,
        PLACE_STEP * np.rint(shape.places / PLACE_STEP),
        NORMAL_STEP * np.rint(shape.normals / NORMAL_STEP),
    )


def nearest_lengths(distances: Float32[np.ndarray, "m a"]) -> UInt8[np.ndarray, "m a"]:
    """Return which of `LENGTHS` is nearest to each distance; the last, infinity, is to itself."""
    between = (LENGTHS[1:-1] + LENGTHS[:-2]) / 2
    found = np.searchsorted(between, distances)
    return np.where(np.isfinite(distances), found, len(LENGTHS) - 1).astype(np.uint8)


def distances_by_landmarks(lengths: Float32[np.ndarray, "m a"]) -> Float32[np.ndarray, "m m"]:
    """Return distances between all points, given those to the first a of them.

    By the triangle inequality a distance is at most the sum, and at least the difference, of those
    to any landmark. The mean of the least sum and the largest difference is exact for a landmark.
    """
    distances = np.empty((len(lengths), len(lengths)), dtype=np.float32)
    between_landmarks(np.ascontiguousarray(lengths), distances)
    # Of rounded lengths the bounds may cross, so those that are known are copied.
    n_landmarks = lengths.shape[1]
    distances[:, :n_landmarks] = lengths
    distances[:n_landmarks] = lengths.T
    return distances


def nearest_of_each_other(
    apart: Float32[np.ndarray, "m n"],
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return the rows and columns of entries that are least in both, each row and column once.

    Where several are equally near, as on a sphere, they are paired in their order. So a shape is
    matched with itself point by point, whatever its symmetry.
    """
    is_least = (apart == apart.min(axis=0)) & (apart == apart.min(axis=1)[:, None])
    pairs: dict[int, int] = {}  # the row of each column
    latest = -1
    for place in np.flatnonzero(is_least).tolist():
        row, column = divmod(place, apart.shape[1])
        if row != latest and column not in pairs:
            pairs[column] = latest = row
    return np.array(list(pairs.values()), dtype=np.int64), np.array(list(pairs), dtype=np.int64)


@one_blas_thread()
def match_patches(first: PatchPoints, second: PatchPoints) -> PatchMatch:
    """Match points of two shapes whose patches are alike and that keep their distances.

    Points are matched whose patches are each other's nearest. Two matches agree as far as the
    distance along the surface between their points is the same on both shapes. The leading
    eigenvector of this agreement finds the largest consistent set of matches, and its eigenvalue
    says how large that is (Leordeanu and Hebert 2005). Each component of the first shape is matched
    with one of the second. Five relative sizes are tried, 1.25 apart; the one with the largest
    agreement counts. Then all points are matched once more, by their patches and by their distances
    to the surest twenty matches.

    Distances do not distinguish left from right: a whole match may be mirrored.

    Parameters
    ----------
    first, second : PatchPoints
        By the same codebook: ``descriptor.points[0]`` of a `PatchDescriptor`.

    Returns
    -------
    PatchMatch

    Raises
    ------
    InvalidParameterError
        If points of the two have different shapes of numbers, as by different codebooks.

    See Also
    --------
    match_features, patch_scores, ShapeIndex.query

    Examples
    --------
    >>> import eigenshape as es
    >>> points = es.describe(es.make_creature("fish", n_vertices=500)).points[0]
    >>> match = es.retrieval.match_patches(points, points)
    >>> bool((match.points[:, 0] == match.points[:, 1]).all())
    True
    """
    require_type(first, PatchPoints, "first")
    require_type(second, PatchPoints, "second")
    start = best_start(first, second)
    costs = squared_distances(first, second, start.step)
    costs = costs + STRAIN_WEIGHT * np.median(costs) * _strain(first, second, start)
    points = _select_supported(_consistent(first, second, costs, start.step), LEAST_SUPPORT)
    vertices = np.column_stack([first.vertices[points[:, 0]], second.vertices[points[:, 1]]])
    return PatchMatch(points, vertices, start.agreement, start.step)


@one_blas_thread()
def patch_agreement(first: PatchPoints, second: PatchPoints) -> float:
    """Return the agreement of `match_patches`, which its second round leaves as it is."""
    return best_start(first, second).agreement


def anchor_strain(
    first: PatchPoints, second: PatchPoints
) -> tuple[int, Float32[np.ndarray, "m n"]]:
    """Return the relative size, and how badly each pair keeps its distances to the surest matches.

    The size is the `step` of `match_patches`. The strain of a pair is a mean squared error, 0 to 1.
    """
    start = best_start(first, second)
    return start.step, _strain(first, second, start)


@record
class Start:
    """Matches at one relative size, the best supported first."""

    points: Int[np.ndarray, "p 2"]
    support: Float[np.ndarray, " p"]
    agreement: float
    step: int


def best_start(first: PatchPoints, second: PatchPoints) -> Start:
    """Match by patches alone, at the relative size at which most agrees."""
    if first.numbers.shape[1:] != second.numbers.shape[1:]:
        raise InvalidParameterError(
            f"Only points by one codebook match; the points of the first have {first.numbers.shape[1:]} "
            f"numbers each, the points of the second {second.numbers.shape[1:]}."
        )
    starts = [
        _consistent(first, second, squared_distances(first, second, step), step) for step in STEPS
    ]
    return max(starts, key=lambda matches: matches.agreement)


def _consistent(
    first: PatchPoints, second: PatchPoints, costs: Float32[np.ndarray, "m n"], step: int
) -> Start:
    """Match the points that are each other's nearest, and rate the matches by their agreement.

    Components are rated one by one, since there is no distance from one to another. Each component
    of the first shape is matched with one of the second, those that agree most first. The agreement
    of a component is a share of that of its matches with itself, times its area.
    """
    rows, columns = nearest_of_each_other(costs)
    shares = first.weights.astype(np.float64) / first.weights.sum(dtype=np.float64)
    ours, theirs = _components(first), _components(second)
    pairs = []
    for one, two in sorted(set(zip(ours[rows].tolist(), theirs[columns].tolist(), strict=True))):
        places = np.flatnonzero((ours[rows] == one) & (theirs[columns] == two))
        own, other = rows[places], columns[places]
        between = first.distances[np.ix_(own, own)], second.distances[np.ix_(other, other)]
        value, support = leading(*between, shares[own], SIZE_STEP**step, SLACK, LEAST_LENGTH)
        if value > 0:
            areas = shares[ours == one]
            # No match agrees with itself, so that even a perfect eigenvalue is below the area.
            perfect = areas.sum() - (areas**2).sum() / areas.sum()
            agreement = areas.sum() * min(value / perfect, 1.0)
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
    return Start(np.column_stack([rows, columns])[order], supports[order], total, step)


def _components(points: PatchPoints) -> Int[np.ndarray, " m"]:
    """Return, for each point, the first point of its component."""
    if np.isfinite(points.distances[0]).all():  # by far the most shapes
        return np.zeros(len(points.vertices), dtype=np.int64)
    return np.isfinite(points.distances).argmax(axis=1)


def _select_supported(matches: Start, share: float) -> Int[np.ndarray, "p 2"]:
    return matches.points[matches.support > share * matches.support.max(initial=0.0)]


def _strain(first: PatchPoints, second: PatchPoints, matches: Start) -> Float32[np.ndarray, "m n"]:
    """Return the mean squared error of the distances of each pair to the surest matches, 0 to 1."""
    anchors = _select_supported(matches, LEAST_ANCHOR_SUPPORT)[:N_ANCHORS]
    if not len(anchors):
        return np.zeros((len(first.numbers), len(second.numbers)), dtype=np.float32)
    ours = np.float32(SIZE_STEP**matches.step) * first.distances[:, None, anchors[:, 0]]
    theirs = second.distances[None, :, anchors[:, 1]]
    return np.asarray(squared_strains(ours, theirs).mean(axis=2))


def squared_strains(
    ours: Float32[np.ndarray, "..."], theirs: Float32[np.ndarray, "..."]
) -> Float32[np.ndarray, "..."]:
    """Return squared errors of distances as shares of what is allowed, at most 1; 1 between components."""
    longest = np.maximum(np.maximum(ours, theirs), np.float32(LEAST_LENGTH))
    known = np.isfinite(longest)
    errors = np.subtract(ours, theirs, where=known, out=np.ones_like(longest))
    errors = np.divide(errors, np.float32(SLACK) * longest, where=known, out=errors)
    return np.asarray(np.minimum(errors**2, 1))


def best_supported(
    coupling: Complex64[np.ndarray, "c c"], points: Int[np.ndarray, " c"], rounds: int
) -> tuple[Float[np.ndarray, " c"], Int[np.ndarray, " p"]]:
    """Return the support x_i ← |Σ_j c_ij x_j| of candidates, and the best of each point if it is well supported.

    The best come first.
    """
    support = np.ones(len(points))
    for _ in range(rounds):
        found = np.abs(coupling @ support.astype(np.complex64)).astype(np.float64)
        # The candidates of one point compete: each is multiplied by its share of the best.
        best = np.full(points.max() + 1, TINY)
        np.maximum.at(best, points, found)
        found *= found / best[points]
        length = np.linalg.norm(found)
        if length == 0:
            break
        before, support = support, found / length
        if np.abs(support - before).max() <= STEADY * support.max():
            break
    order = np.argsort(-support, kind="stable")
    order = order[support[order] > LEAST_CANDIDATE_SUPPORT * support[order[0]]]
    first = np.unique(points[order], return_index=True)[1]
    return support, order[np.sort(first)]


def squared_distances(
    first: PatchPoints, second: PatchPoints, step: int
) -> Float32[np.ndarray, "m n"]:
    """Compare numbers at base radii of one shape with those some steps larger of the other."""
    ours = first.numbers[:, max(-step, 0) :: N_SIZES].reshape(len(first.numbers), -1)
    theirs = second.numbers[:, max(step, 0) :: N_SIZES].reshape(len(second.numbers), -1)
    products = ours @ theirs.T
    return (ours**2).sum(axis=1)[:, None] - 2 * products + (theirs**2).sum(axis=1)


def pack_points(points: PatchPoints) -> bytes:
    """Return points as bytes: 17 KB for 150 points with 90 numbers each."""
    parts = (
        np.array([*points.numbers.shape], dtype=LENGTH),
        points.vertices.astype(VERTEX),
        points.weights.astype(HALF),
        np.rint(points.numbers / NUMBER_STEP).astype(np.int8),
        nearest_lengths(points.distances[:, :N_LANDMARKS]),
        np.rint(points.places / PLACE_STEP).astype(PLACE),
        np.rint(points.normals / NORMAL_STEP).astype(np.int8),
    )
    # Each part is coded apart, since their bytes are distributed differently.
    deflate = zlib.compressobj()
    pieces = [deflate.compress(part.tobytes()) + deflate.flush(zlib.Z_FULL_FLUSH) for part in parts]
    return b"".join([*pieces, deflate.flush()])


def unpack_points(data: bytes) -> PatchPoints:
    """Return the points that `pack_points` turned into bytes."""
    data, place = zlib.decompress(data), 0

    def take(kind: "np.dtype[np.generic]", count: int) -> np.ndarray:
        nonlocal place
        taken = np.frombuffer(data, kind, count, place)
        place += taken.nbytes
        return taken

    m, r, d = take(LENGTH, 3).tolist()
    vertices, weights = take(VERTEX, m).astype(np.int64), take(HALF, m).astype(np.float32)
    numbers = np.float32(NUMBER_STEP) * take(np.dtype("i1"), m * r * d).reshape(m, r, d)
    lengths = LENGTHS[take(np.dtype("u1"), m * min(m, N_LANDMARKS)).reshape(m, -1)]
    places = PLACE_STEP * take(PLACE, 3 * m).reshape(m, 3)
    normals = NORMAL_STEP * take(np.dtype("i1"), 3 * m).reshape(m, 3)
    return PatchPoints(numbers, weights, distances_by_landmarks(lengths), vertices, places, normals)
