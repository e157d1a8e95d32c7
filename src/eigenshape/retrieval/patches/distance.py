"""Distances between codes of shapes, the least over relative sizes, and their correction for hubness."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float, Int, Int8, UInt8

from eigenshape.retrieval.patches.code_loops import (
    distances_to,
    lengths,
    packed_view_distances,
)

# Added to a distance for each step of 1.25 in relative size, so that of equally good steps the
# smallest counts.
SIZE_PRICE = 0.01
# Nearest shapes to which the distances are averaged. Ten found as much on the tuning half of
# experiments/ch5_retrieval; five gained half a point more for incomplete queries.
N_NEAREST = 5
# Shapes among which the nearest are sought; with more the time would grow with the square of their
# number. A shape takes 0.4 ms.
N_REFERENCES = 500
# Mean of the isolations on the tuning half, so that scores keep their size. A shape without
# neighbors has this isolation.
USUAL_ISOLATION = 0.6
# Exponents for closed and for open queries. On the tuning half, mean average precision rose from
# 72.6 to 80.5 (complete queries, mixed database), 63.5 to 65.5 (incomplete), 86.0 to 89.2 and 75.4
# to 76.9 (the same among whole shapes). 1.5 gained as much, and 1 for open queries lost first
# matches: a scan is far from all whole shapes. Means of closed and open shapes that were made equal
# cost 2 points.
CLOSED_SHARE, OPEN_SHARE = 1.0, 0.5


def patch_distances(
    query: Int8[np.ndarray, "b s v"], others: Int8[np.ndarray, "k b s v"]
) -> Float[np.ndarray, " k"]:
    """Return 1 - the mean cosine of codes over base radii, at the best relative size.

    Cutting a part off makes the rest larger in its unit box. So a radius of one shape is compared
    with the same radius, the next and the next but one of the other, at a small price for each
    step.

    Returns
    -------
    (k,) float
        0 for the same codes, up to 2.
    """
    found = np.empty(len(others))
    distances_to(*_rows(query), *_rows(others), query.shape[1], SIZE_PRICE, found)
    return found


def packed_distances(
    query: Int8[np.ndarray, "u b s v"], others: Sequence[UInt8[np.ndarray, "_ h"]]
) -> Float[np.ndarray, " k"]:
    """For each other shape, average two distances: to it, and to the closest of it and its views.

    A partial scan is nearer to a scan from the same side than to the whole; a whole stays nearest
    to the whole. If a shape has no views, since it is a part, the views of the query serve in their
    place. No copy is made of all codes: each shape is unpacked into the same scratch memory.

    Parameters
    ----------
    query : (u, b, s, v) int8
        Of the query and, if it is closed, of its views.
    others : sequence of k (_, h) uint8
        Of each other shape and its views, packed by `pack_codes` as an index stores them.

    Returns
    -------
    (k,) float
    """
    (rows, row_lengths), n_bases, n_sizes = _rows(query), *query.shape[1:3]
    n_rows = np.array([len(other) for other in others], dtype=np.int64)
    most = n_rows.max(initial=0)
    scratch = np.empty((most, query.shape[-1]), dtype=np.int8), np.empty(most)
    sizes, found = (n_bases * n_sizes, n_sizes), np.empty(len(others))
    packed = list(map(np.ascontiguousarray, others))
    packed_view_distances(rows, row_lengths, packed, n_rows, *scratch, *sizes, SIZE_PRICE, found)
    return found


def _rows(
    codes: Int8[np.ndarray, "*k v"],
) -> tuple[Int8[np.ndarray, "m v"], Float[np.ndarray, " m"]]:
    """Return codes one below the other, and their lengths."""
    rows = np.ascontiguousarray(codes.reshape(-1, codes.shape[-1]))
    found = np.empty(len(rows))
    lengths(rows, found)
    return rows, found


def measure_isolations(
    codes: Callable[[int], Int8[np.ndarray, "b s v"]],
    n_shapes: int,
    places: Int[np.ndarray, " m"],
) -> Float[np.ndarray, " m"]:
    """For some of n shapes, average the distances to the nearest five of the first 500.

    Parameters
    ----------
    codes : callable
        Return the codes of a whole shape by its number below n. No two shapes may be the same, and
        they must be in an order that depends on what they are alone.
    n_shapes : int
    places : (m,) int
        Numbers of the shapes to measure.
    """
    if not len(places):
        return np.empty(0)
    references = np.stack([codes(number) for number in range(min(n_shapes, N_REFERENCES))])
    found = []
    for place in places.tolist():
        distances = patch_distances(codes(place), references)
        others = np.sort(distances[np.arange(len(references)) != place])
        found.append(others[:N_NEAREST].mean() if len(others) else USUAL_ISOLATION)
    return np.array(found)


def scale_distances(
    query: Int8[np.ndarray, "u b s v"],
    distances: Float[np.ndarray, " k"],
    isolations: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Lower the distances to isolated shapes, and raise those to shapes that have near neighbors.

    In spaces of many dimensions some points are among the nearest of very many others ("hubs",
    Radovanović, Nanopoulos and Ivanović 2010), here shapes without features, and answer queries of
    every class. Local scaling (Zelnik-Manor and Perona 2004) makes up for it.

    Parameters
    ----------
    query : (u, b, s, v) int8
        Codes of the query and of its views. Without views it is open.
    distances, isolations : (k,) float
        Of `packed_distances`, and of `measure_isolations`.
    """
    share = CLOSED_SHARE if len(query) > 1 else OPEN_SHARE
    return distances * np.exp(share * (USUAL_ISOLATION - isolations))
