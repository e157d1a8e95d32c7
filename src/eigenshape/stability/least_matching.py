"""The smallest distance within which the points of two sets can be matched."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.memory import available_memory, require_memory
from eigenshape._errors import InvalidShapeError
from eigenshape.stability.bipartite_loops import match_rows

Points = Float[np.ndarray, "_ d"]
Partners = Int[np.ndarray, " n"]

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


def least_perfect(one: Points, two: Points) -> tuple[float, Int[np.ndarray, " _"]]:
    """Return the smallest Euclidean distance that allows a perfect matching, and the matching.

    It is given by the partner of each point of the first set. The sets have equal numbers of
    points. The search distance starts just below the distance at which each point has a neighbor,
    and grows until a perfect matching exists; bisection among the distances of the listed pairs
    then finds the smallest sufficient one. Each matching starts from the last insufficient one.
    """
    unmatched = np.full(len(one), -1)
    partners = _match_pairs(near_pairs(one, two, 0.0), unmatched, len(two))
    if (partners >= 0).all():
        return 0.0, partners
    # Just below the distance at which each point has a neighbor in the other set
    sides = (one, two), (two, one)
    to_nearest = max(cKDTree(those).query(these)[0].max() for these, those in sides)
    low = float(to_nearest) * (1 - DISTANCE_ROUNDING)
    top = float(np.linalg.norm(one - two, axis=1).max())
    distance = max(DISTANCE_GROWTH * low, COARSE * top)
    while True:
        near = near_pairs(one, two, min(distance, top))
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


def _match_pairs(near: Pairs, first: Partners, n_others: int) -> Int[np.ndarray, " n"]:
    graph = sp.csr_array(
        (np.ones(len(near.i), dtype=np.int8), (near.i, near.j)), shape=(len(first), n_others)
    )
    return match_rows(graph.indptr, graph.indices, n_others, first)[0]


def near_pairs(some: Points, others: Points, distance: float) -> Pairs:
    """List the pairs of points whose distance is at most the given one.

    Raise InvalidShapeError if the pairs do not fit into half of the memory.
    """
    # The tree compares powers of distances, with a rounding of its own: it returns a few more, and
    # the comparison below decides.
    reach = distance * (1 + DISTANCE_ROUNDING)
    trees = cKDTree(some), cKDTree(others)
    # If all pairs fit, there is no need to count them.
    if len(some) * len(others) * BYTES_OF_PAIR > available_memory(SHARE_OF_PAIRS):
        n_pairs = int(trees[0].count_neighbors(trees[1], reach))
        require_memory(
            "Pairs of near points",
            f"{n_pairs:.2g} pairs within {reach:.3g}",
            {"lists": n_pairs * BYTES_OF_PAIR},
            "Bring the sets nearer to each other, or take fewer points.",
            share=SHARE_OF_PAIRS,
            error=InvalidShapeError,
        )
    found = trees[0].sparse_distance_matrix(trees[1], reach, output_type="ndarray")
    i, j = found["i"].astype(np.int64), found["j"].astype(np.int64)
    distances = np.linalg.norm(some[i] - others[j], axis=1)
    near = distances <= distance
    return Pairs(i[near], j[near], distances[near])
