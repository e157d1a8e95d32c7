"""The least distance within which the points of two sets can be matched."""

from bisect import bisect_left
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from eigenshape._errors import InvalidShapeError
from eigenshape._memory import machine_memory
from eigenshape.features.matching_loops import match_rows

Points = Float[np.ndarray, "_ d"]
Reach = Float[np.ndarray, " _"]
Partners = Int[np.ndarray, " n"]

FINE = 1e-4  # of the distance: an interval so short holds few candidates
SLACK = 1e-9  # of a distance: more than the rounding of two ways to compute it
GROWTH = 1.5
PEAK = 150  # bytes a pair while pairs are listed
COARSE = 1e-3  # of the largest distance of points in the same place of their lists: where the search begins


class Pairs(NamedTuple):
    """Pairs of points of two sets, and how far they are apart."""

    i: Int[np.ndarray, " k"]
    j: Int[np.ndarray, " k"]
    apart: Float[np.ndarray, " k"]


def least_perfect(one: Points, two: Points, norm: float) -> tuple[float, Int[np.ndarray, " _"]]:
    """Return the least distance within which each point of one set has one of the other for itself, and which.

    The sets have equal numbers of points. From just below the distance at which each has a neighbour the search grows
    until it suffices; among the distances of the pairs found then the least that does is searched for. A matching that
    was not enough is where the next begins.
    """
    partners = match_within(one, two, 0.0, norm)
    if (partners >= 0).all():
        return 0.0, partners
    low, top = _enclosed(one, two, norm), float(_lengths(one - two, norm).max())
    distance = max(GROWTH * low, COARSE * top)
    while True:
        near = near_pairs(one, two, min(distance, top), norm)
        found = _matched(near, partners, len(two))
        if (found >= 0).all():
            return _least_of(near, np.unique(near.apart[near.apart > low]), found, partners)
        low, distance, partners = distance, GROWTH * distance, found


def _least_of(
    near: Pairs, distances: Reach, found: Partners, partners: Partners
) -> tuple[float, Int[np.ndarray, " n"]]:
    """Search ascending distances for the least that suffices; the last does, with the matching that was found."""
    low, high = 0, len(distances) - 1
    while low < high:
        middle = (low + high) // 2
        inside = near.apart <= distances[middle]
        tried = _matched(Pairs(*(part[inside] for part in near)), partners, len(partners))
        if (tried >= 0).all():
            high, found = middle, tried
        else:
            low, partners = middle + 1, tried
    return float(distances[high]), found


def least_distance(one: Points, two: Points, reach_one: Reach, reach_two: Reach) -> float:
    """Return the least distance that suffices, by the largest coordinate, where points may vanish within their reach.

    It is 0, one of the reaches, or the distance of two points. The interval that holds it is halved until few of
    these lie in it, and these are searched.
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
    left = np.unique(
        np.concatenate(
            [reaches, *(near_pairs(*side, high, np.inf).apart for side in sides), [high]]
        )
    )
    left = left[(left > low) & (left <= high)]
    return float(
        left[
            bisect_left(range(len(left) - 1), True, key=lambda place: suffices(float(left[place])))
        ]
    )


def _covers(some: Points, others: Points, distance: float) -> bool:
    """Say whether each of some points can have another for itself within the distance."""
    if not len(some) or len(some) > len(others):
        return not len(some)
    return bool((match_within(some, others, distance, np.inf) >= 0).all())


def match_within(
    some: Points, others: Points, distance: float, norm: float
) -> Int[np.ndarray, " _"]:
    """Match as many of some points as can be with another each within the distance; -1 where there is none."""
    return _matched(near_pairs(some, others, distance, norm), np.full(len(some), -1), len(others))


def _matched(near: Pairs, first: Partners, n_others: int) -> Int[np.ndarray, " n"]:
    graph = sp.csr_array(
        (np.ones(len(near.i), dtype=np.int8), (near.i, near.j)), shape=(len(first), n_others)
    )
    return match_rows(graph.indptr, graph.indices, n_others, first)[0]


def near_pairs(some: Points, others: Points, distance: float, norm: float) -> Pairs:
    """List the pairs of points at most the distance apart.

    Raises
    ------
    InvalidShapeError
        If they would not fit into half of the memory.
    """
    if not len(some) or not len(others):
        return Pairs(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
    # The tree compares powers of distances: it is asked for a little more, and what is near decided here alone.
    reach = distance * (1 + SLACK)
    trees = cKDTree(some), cKDTree(others)
    _require_room(*trees, reach, norm)
    found = trees[0].sparse_distance_matrix(trees[1], reach, p=norm, output_type="ndarray")
    i, j = found["i"].astype(np.int64), found["j"].astype(np.int64)
    apart = _lengths(some[i] - others[j], norm)
    near = apart <= distance
    return Pairs(i[near], j[near], apart[near])


def _require_room(one: cKDTree, two: cKDTree, reach: float, norm: float) -> None:
    room, most = machine_memory() / 2, one.n * two.n
    if most * PEAK <= room:
        return
    n_pairs = int(one.count_neighbors(two, reach, p=norm))
    if n_pairs * PEAK > room:
        raise InvalidShapeError(
            f"Pairs of near points must fit into half of the memory, {room / 2**30:.1f} GiB; {n_pairs:.2g} pairs "
            f"within {reach:.3g} take {n_pairs * PEAK / 2**30:.1f} GiB. "
            "Bring the sets nearer to each other, or take fewer points."
        )


def _enclosed(one: Points, two: Points, norm: float) -> float:
    """Return a distance just below that at which each point has a neighbour."""
    lonely = max(
        cKDTree(those).query(these, p=norm)[0].max() for these, those in ((one, two), (two, one))
    )
    return float(lonely) * (1 - SLACK)


def _lengths(vectors: Float[np.ndarray, "k d"], norm: float) -> Float[np.ndarray, " k"]:
    return np.linalg.norm(vectors, ord=norm, axis=1)
