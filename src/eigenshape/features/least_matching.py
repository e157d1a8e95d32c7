"""The smallest distance within which the points of two sets can be matched."""

from bisect import bisect_left
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.memory import available_memory, require_memory
from eigenshape._errors import InvalidShapeError
from eigenshape.features.bipartite_loops import match_rows

Points = Float[np.ndarray, "_ d"]
Reach = Float[np.ndarray, " _"]
Partners = Int[np.ndarray, " n"]

# Bisection of the interval that holds the distance stops at this share of it: so short an interval
# holds few candidates.
FINE = 1e-4
# Relative margin for the rounding of a distance that is computed in two ways; 1e7 times the
# rounding itself.
DISTANCE_ROUNDING = 1e-9
# Factor by which the search distance grows. A larger one lists more pairs in the last round, a
# smaller one takes more rounds.
DISTANCE_GROWTH = 1.5
# Peak bytes of memory per pair while pairs are listed.
BYTES_OF_PAIR = 150
SHARE_OF_PAIRS = 0.5  # of the memory; the matching needs the rest
# Least distance at which the search begins, as a share of the largest distance of points at equal
# places of their lists.
COARSE = 1e-3


class Pairs(NamedTuple):
    """Pairs of points of two sets, and their distances."""

    i: Int[np.ndarray, " k"]
    j: Int[np.ndarray, " k"]
    distances: Float[np.ndarray, " k"]


def least_perfect(one: Points, two: Points, norm: float) -> tuple[float, Int[np.ndarray, " _"]]:
    """Return the smallest distance that allows a perfect matching, and the matching.

    It is given by the partner of each point of the first set. The sets have equal numbers of
    points. The search distance starts just below the distance at which each point has a neighbor,
    and grows until a perfect matching exists; bisection among the distances of the listed pairs
    then finds the smallest sufficient one. Each matching starts from the last insufficient one.
    """
    partners = match_within(one, two, 0.0, norm)
    if (partners >= 0).all():
        return 0.0, partners
    # Just below the distance at which each point has a neighbor in the other set
    sides = (one, two), (two, one)
    to_nearest = max(cKDTree(those).query(these, p=norm)[0].max() for these, those in sides)
    low, top = float(to_nearest) * (1 - DISTANCE_ROUNDING), float(_lengths(one - two, norm).max())
    distance = max(DISTANCE_GROWTH * low, COARSE * top)
    while True:
        near = near_pairs(one, two, min(distance, top), norm)
        found = _match_pairs(near, partners, len(two))
        if (found >= 0).all():
            break
        low, distance, partners = distance, DISTANCE_GROWTH * distance, found
    # The last of these distances allows a perfect matching, `found`.
    distances = np.unique(near.distances[near.distances > low])
    first, last = 0, len(distances) - 1
    while first < last:
        middle = (first + last) // 2
        inside = near.distances <= distances[middle]
        tried = _match_pairs(Pairs(*(part[inside] for part in near)), partners, len(partners))
        if (tried >= 0).all():
            last, found = middle, tried
        else:
            first, partners = middle + 1, tried
    return float(distances[last]), found


def least_distance(one: Points, two: Points, reach_one: Reach, reach_two: Reach) -> float:
    """Return the smallest sufficient distance in the maximum norm.

    A point whose reach is at most the distance needs no partner. The result is 0, one of the
    reaches, or the distance of two points. Bisection shortens the interval that contains it until
    few of these candidates lie inside; bisection among the candidates follows.
    """

    def suffices(distance: float) -> bool:
        return _covers(one[reach_one > distance], two, distance) and _covers(
            two[reach_two > distance], one, distance
        )

    if suffices(0.0):
        return 0.0
    reaches = np.concatenate([reach_one, reach_two])
    low, high = 0.0, float(reaches.max())
    while high - low > FINE * high:
        middle = low + (high - low) / 2
        low, high = (low, middle) if suffices(middle) else (middle, high)
    sides = [(one[reach_one > low], two), (two[reach_two > low], one)]
    distances = [near_pairs(*side, high, np.inf).distances for side in sides]
    candidates = np.unique(np.concatenate([reaches, *distances, [high]]))
    candidates = candidates[(candidates > low) & (candidates <= high)]
    # The last candidate is `high`, which is sufficient.
    place = bisect_left(
        range(len(candidates) - 1), True, key=lambda place: suffices(float(candidates[place]))
    )
    return float(candidates[place])


def _covers(some: Points, others: Points, distance: float) -> bool:
    """Say whether each of some points can have a partner of its own within the distance."""
    if not len(some) or len(some) > len(others):
        return not len(some)
    return bool((match_within(some, others, distance, np.inf) >= 0).all())


def match_within(
    some: Points, others: Points, distance: float, norm: float
) -> Int[np.ndarray, " _"]:
    """Return a partner within the distance for as many points as possible; -1 for none."""
    near = near_pairs(some, others, distance, norm)
    return _match_pairs(near, np.full(len(some), -1), len(others))


def _match_pairs(near: Pairs, first: Partners, n_others: int) -> Int[np.ndarray, " n"]:
    graph = sp.csr_array(
        (np.ones(len(near.i), dtype=np.int8), (near.i, near.j)), shape=(len(first), n_others)
    )
    return match_rows(graph.indptr, graph.indices, n_others, first)[0]


def near_pairs(some: Points, others: Points, distance: float, norm: float) -> Pairs:
    """List the pairs of points whose distance is at most the given one.

    Raise InvalidShapeError if the pairs do not fit into half of the memory.
    """
    if not len(some) or not len(others):
        return Pairs(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
    # The tree compares powers of distances, with a rounding of its own: it returns a few more, and
    # the comparison below decides.
    reach = distance * (1 + DISTANCE_ROUNDING)
    trees = cKDTree(some), cKDTree(others)
    # If all pairs fit, there is no need to count them.
    if len(some) * len(others) * BYTES_OF_PAIR > available_memory(SHARE_OF_PAIRS):
        n_pairs = int(trees[0].count_neighbors(trees[1], reach, p=norm))
        require_memory(
            "Pairs of near points",
            f"{n_pairs:.2g} pairs within {reach:.3g}",
            {"lists": n_pairs * BYTES_OF_PAIR},
            "Bring the sets nearer to each other, or take fewer points.",
            share=SHARE_OF_PAIRS,
            error=InvalidShapeError,
        )
    found = trees[0].sparse_distance_matrix(trees[1], reach, p=norm, output_type="ndarray")
    i, j = found["i"].astype(np.int64), found["j"].astype(np.int64)
    distances = _lengths(some[i] - others[j], norm)
    near = distances <= distance
    return Pairs(i[near], j[near], distances[near])


def _lengths(vectors: Float[np.ndarray, "k d"], norm: float) -> Float[np.ndarray, " k"]:
    return np.linalg.norm(vectors, ord=norm, axis=1)
