"""Pairs of points of a part and a whole that agree in distances and directions."""

import numpy as np
from jaxtyping import Bool, Complex64, Float, Int

from certeig.kit.arrays import record
from eigenshape._arrays import label_components
from eigenshape.matching.match_loops import couple_pairs, nearest_rows, place_by_distances
from eigenshape.matching.surface import Surface, View
from eigenshape.retrieval.patches.matching import best_supported

# All lengths are in units of `Surface` unless stated.
N_CANDIDATES = 5  # partners that are tried for each point; ten found nothing more
# Discs of views are one of eight, so that one of them is near by chance: their differences count so
# many times. Near a boundary both discs are cut alike, and weigh more than the product of their
# weights.
FOREIGN, RIM_SHARE = 1.2, 0.5
LEAST_DIFFERENCE = 1.0  # of patches, in logarithms; that of copies is 0
# Share of a distance by which two pairs may disagree and still support each other
DISTANCE_SLACK = 0.4
# The same, for starts. What a wide one finds a narrow one misses and the other way round: of 15 hard
# pairs of the tuning half each has maps that are nearest to the truth, and the best fit is taken.
START_SLACKS = 0.4, 0.3, 0.2
SHORTEST = 0.05  # errors of shorter distances are shares of this
# A distance that is longer on the part counts half: around a hole or a cut paths are longer.
LONGER = 0.5
LEAST_AGREEMENT = 0.7  # the same, of the support by selected pairs, as a share of their median
FIRST_ROUNDS = 30  # of the iteration from all candidates, at most
NEXT_ROUNDS = 15  # near the images of the last round
# Rounds in which pairs are cleaned, extended and selected anew. Maps are bent onto the whole
# afterwards, so that more rounds add little, and more starts more.
N_GROWTHS = 2
N_NEARBY = 3  # partners of a point that are tried in these rounds
# Points nearer than this on the whole that are more than BLOCKED times as far on the part conflict.
CROWDED = 0.07
BLOCKED = 2.5
OCCUPIED = 2.0  # cost of a place that a far point has taken, in median least costs of descriptors
# A point may move this far from where its neighbors place it, plus the share WANDER of its distance
# to the next kept pair.
REACH = 0.07
WANDER = 0.8
# Two neighboring pairs agree if their distances differ by at most this share plus this length.
NEIGHBOR_SHARE = 0.3
NEIGHBOR_SLACK = 0.024
N_NEIGHBORS = 8
FEWEST_PAIRS = 4  # fewer do not make a map
N_NEAR = 12  # pairs by which a point is placed
SOFTNESS = 0.03  # added to distances before they are weighed
CAP = 0.1  # largest error of a distance that counts, so that single wrong pairs count little


@record
class Pairs:
    """Points of a part, by number, their partners on the whole, and the support of each pair."""

    points: Int[np.ndarray, " p"]
    partners: Int[np.ndarray, " p"]
    support: Float[np.ndarray, " p"]

    def select(self, chosen: Int[np.ndarray, " k"] | Bool[np.ndarray, " p"]) -> "Pairs":
        """Return some of the pairs."""
        return Pairs(self.points[chosen], self.partners[chosen], self.support[chosen])


def patch_differences(part: Surface, whole: Surface) -> Float[np.ndarray, "m k"]:
    """Return weighted mean squared differences of whitened numbers, in sums over 20 axes.

    A part with a boundary is compared with views of the whole, too, whose discs end at boundaries
    as well.
    """
    found = _differences(part, whole, 1.0)
    if part.weights.min() == 1:
        return found
    for view in whole.views:
        seen = FOREIGN * _differences(part, view, RIM_SHARE)
        found[:, view.points] = np.minimum(found[:, view.points], seen)
    return found


def _differences(part: Surface, other: Surface | View, power: float) -> Float[np.ndarray, "m k"]:
    """Return mean squared differences, each radius weighted by a power of both weights."""
    total, weights = 0.0, 0.0
    for radius in range(part.numbers.shape[1]):
        one, two = part.numbers[:, radius], other.numbers[:, radius]
        squares = (one**2).sum(axis=1)[:, None] - 2 * one @ two.T + (two**2).sum(axis=1)
        share = (part.weights[:, radius][:, None] * other.weights[:, radius]) ** power
        total = total + share * np.maximum(squares, 0)
        weights = weights + share
    return np.asarray(total / weights, dtype=np.float64)


def log_differences(
    differences: Float[np.ndarray, "m k"],
    points: Int[np.ndarray, " p"],
    partners: Int[np.ndarray, " p"],
) -> Float[np.ndarray, " p"]:
    """Return the logarithms of the differences of the patches of pairs."""
    return np.log(np.maximum(differences[points, partners], LEAST_DIFFERENCE))


def descriptor_costs(differences: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "m k"]:
    """Return differences of patches in units of the median difference to the most similar one."""
    # Differences of single precision below this are rounding.
    unit = max(float(np.median(differences.min(axis=1))), float(np.finfo(np.float32).eps))
    return differences / unit


def first_candidates(costs: Float[np.ndarray, "m k"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the best partners of each point by descriptors alone: points and partners."""
    partners = nearest_rows(costs.T, min(N_CANDIDATES, costs.shape[1]))
    return np.repeat(np.arange(len(costs)), partners.shape[1]), partners.ravel()


def couplings(
    part: Surface,
    whole: Surface,
    points: Int[np.ndarray, " c"],
    partners: Int[np.ndarray, " c"],
    slack: float = DISTANCE_SLACK,
) -> Complex64[np.ndarray, "c c"]:
    """Return how candidate pairs support each other; see `couple_pairs`."""
    found = np.empty((len(points),) * 2, dtype=np.complex64)
    one, two = (
        (shape.between, np.ascontiguousarray(shape.between.T), shape.ways)
        for shape in (part, whole)
    )
    couple_pairs(points, partners, one, two, slack, SHORTEST, LONGER, found)
    return found


def select_pairs(
    coupling: Complex64[np.ndarray, "c c"],
    points: Int[np.ndarray, " c"],
    partners: Int[np.ndarray, " c"],
    rounds: int,
) -> tuple[Pairs, Int[np.ndarray, " p"]]:
    """Return the best candidate of each point if it is well supported, and their numbers.

    Those that agree with a pair in distance must also agree in the turn that takes directions on the
    part to directions on the whole. So pairs of a mirror image, whose turns all differ, get little.
    """
    support, chosen = best_supported(coupling, points, rounds)
    # What only unselected candidates supported goes.
    ours = coupling[np.ix_(chosen, chosen)]
    agreement = np.abs(ours @ support[chosen].astype(np.complex64))
    chosen = chosen[agreement > LEAST_AGREEMENT * np.median(agreement)]
    return Pairs(points[chosen], partners[chosen], support[chosen]), chosen


def grow_pairs(
    part: Surface, whole: Surface, costs: Float[np.ndarray, "m k"], pairs: Pairs
) -> Pairs:
    """Keep what agrees, extend it to all points, and repeat.

    Of a start with a limb on the wrong side, the largest piece that is continuous stays, and the
    limb is placed anew from where it joins that piece.
    """
    for _ in range(N_GROWTHS):
        pairs = _continuous(part, whole, _without_conflicts(part, whole, pairs))
        if len(pairs.points) < FEWEST_PAIRS:
            return pairs
        places = place_points(part, whole, pairs, part.points)[0]
        away = part.between[pairs.points].min(axis=0)
        reach = (REACH + WANDER * away)[:, None]
        moves = whole.columns[places]
        # Places that pairs of far points have taken cost more.
        far = (part.between[:, pairs.points] > BLOCKED * CROWDED).astype(np.float32)
        taken = (whole.between[:, pairs.partners] < CROWDED).astype(np.float32)
        wanted = costs + (moves / reach) ** 2 + OCCUPIED * (far @ taken.T > 0)
        partners = nearest_rows(wanted.T, N_NEARBY)
        nearby = np.take_along_axis(moves, partners, axis=1)
        allowed = nearby <= np.maximum(2 * reach, nearby.min(axis=1, keepdims=True))
        points = np.repeat(np.arange(len(costs)), allowed.sum(axis=1))
        partners = partners[allowed]
        coupling = couplings(part, whole, points, partners)
        pairs, _ = select_pairs(coupling, points, partners, NEXT_ROUNDS)
    return _without_conflicts(part, whole, pairs)


def place_points(
    part: Surface, whole: Surface, pairs: Pairs, vertices: Int[np.ndarray, " v"]
) -> tuple[Int[np.ndarray, " v"], Float[np.ndarray, " v"]]:
    """Place vertices of the part on vertices of the whole by distances to near pairs.

    Returns the vertices and the root mean square error of distances, at most `CAP`.
    """
    rows = np.ascontiguousarray(part.distances[np.ix_(pairs.points, vertices)])
    near = nearest_rows(rows, N_NEAR)
    starts = whole.points[pairs.partners[near[:, 0]]]
    misfits = np.empty(len(vertices))
    found = place_by_distances(
        rows, pairs.partners, whole.distances, near, starts, SOFTNESS, CAP**2, LONGER, misfits
    )
    return found, np.sqrt(misfits)


def _without_conflicts(part: Surface, whole: Surface, pairs: Pairs) -> Pairs:
    """Drop pairs whose place on the whole a better supported pair of a far point has taken."""
    ours = part.between[pairs.points][:, pairs.points]
    theirs = whole.between[pairs.partners][:, pairs.partners]
    conflicts = (theirs < CROWDED) & (ours > BLOCKED * CROWDED)
    kept = np.zeros(len(pairs.points), dtype=bool)
    conflicting = conflicts.any(axis=1)
    for number in np.argsort(-pairs.support, kind="stable"):
        # Most pairs have no conflict at all.
        kept[number] = not (conflicting[number] and (conflicts[number] & kept).any())
    return pairs.select(kept)


def _continuous(part: Surface, whole: Surface, pairs: Pairs) -> Pairs:
    """Return the largest set of pairs that is connected by neighbors that keep their distances."""
    n = len(pairs.points)
    ours = part.between[pairs.points][:, pairs.points]
    theirs = whole.between[pairs.partners][:, pairs.partners]
    near = nearest_rows(ours.T, min(N_NEIGHBORS + 1, n))[:, 1:]
    one, two = np.repeat(np.arange(n), near.shape[1]), near.ravel()
    longest = np.maximum(ours[one, two], theirs[one, two])
    with np.errstate(invalid="ignore"):  # infinite on both sides: other components
        errors = np.abs(ours[one, two] - theirs[one, two])
    agree = errors <= NEIGHBOR_SHARE * longest + NEIGHBOR_SLACK
    agree &= np.isfinite(longest)
    good = 2 * np.bincount(one, weights=agree, minlength=n) >= near.shape[1]
    links = agree & good[one] & good[two]
    _, labels = label_components(n, one[links], two[links])
    sizes = np.bincount(labels[good], minlength=n)
    return pairs.select(good & (labels == sizes.argmax()))
