"""Distances between codes of shapes: the least over relative sizes."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int8, UInt8

from eigenshape.retrieval.patches.code_loops import (
    distances_to,
    lengths,
    packed_view_distance,
)

# Added to a distance for each step of 1.25 in relative size, so that of equally good steps the
# smallest counts.
SIZE_PRICE = 0.01


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
    most = max(map(len, others), default=0)
    codes, code_lengths = np.empty((most, query.shape[-1]), dtype=np.int8), np.empty(most)
    found = [
        packed_view_distance(
            rows,
            row_lengths,
            np.asarray(other),
            codes,
            code_lengths,
            n_bases * n_sizes,
            n_sizes,
            SIZE_PRICE,
        )
        for other in others
    ]
    return np.array(found, dtype=np.float64)


def _rows(
    codes: Int8[np.ndarray, "*k v"],
) -> tuple[Int8[np.ndarray, "m v"], Float[np.ndarray, " m"]]:
    """Return codes one below the other, and their lengths."""
    rows = np.ascontiguousarray(codes.reshape(-1, codes.shape[-1]))
    found = np.empty(len(rows))
    lengths(rows, found)
    return rows, found
