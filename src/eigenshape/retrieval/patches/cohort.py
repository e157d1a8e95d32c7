"""Normalize distances by a cohort: some shapes are near to everything, whatever the query."""

import numpy as np
from jaxtyping import Float, Int8

from eigenshape.retrieval.patches.codebook import PatchCodebook
from eigenshape.retrieval.patches.distance import patch_distances

# Members of the cohort, after the nearest, to which the distances of a shape are averaged. The
# nearest does not count, since it may be the shape itself. Three found as much.
N_NEAREST = 5
FEWEST_MEMBERS = 1 + N_NEAREST
# Mean of these distances of closed shapes and of open ones, on the tuning half of
# experiments/ch5_retrieval: 0.78 and 0.85 by the default codebook, 0.75 and 0.82 by one that was
# learned from the other half.
USUAL_DISTANCE, USUAL_OPEN_DISTANCE = 0.77, 0.84
# Exponent of the factor of isolation. On the tuning half a share of 0.5 raised the mean average
# precision of complete queries in a mixed database from 71.5 to 74.1 (default codebook) and from
# 75.9 to 78.6 (learned), and one of 1 to 75.0 and 80.0, but lost some first matches. A difference
# in place of a factor found as much, and may be negative.
ISOLATION_SHARE = 0.5
# Isolations are whole multiples of this, as an index stores them.
ISOLATION_STEP = 1e-6


def isolation(
    codes: Int8[np.ndarray, "b s v"], codebook: PatchCodebook, *, is_closed: bool
) -> float:
    """Return how much farther a shape is from the cohort than closed, or open, shapes usually are.

    0 by a codebook without cohort.
    """
    if not len(codebook.cohort):
        return 0.0
    nearest = np.sort(patch_distances(codes, codebook.cohort))[1:FEWEST_MEMBERS]
    usual = USUAL_DISTANCE if is_closed else USUAL_OPEN_DISTANCE
    return round((float(nearest.mean()) - usual) / ISOLATION_STEP) * ISOLATION_STEP


def normalized_distances(
    query: Int8[np.ndarray, "u b s v"],
    distances: Float[np.ndarray, " k"],
    isolations: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Lower the distances of a closed query to isolated shapes, and raise those to common ones.

    In spaces of many dimensions some points are among the nearest of very many others ("hubs",
    Radovanović, Nanopoulos and Ivanović 2010), here shapes without features, and answer queries of
    every class. What a shape is far from in general says less about it. The isolation is that of
    the stored shape alone, so it is measured once, and parts of an index answer as the whole does.

    Parameters
    ----------
    query : (u, b, s, v) int8
        Codes of the query and of its views. Without views it is open, and distances remain as they
        are: what a scanner sees is far from all whole shapes, and single scans lost by this.
    distances, isolations : (k,) float
        Of `view_distances`, and of `isolation`.
    """
    if len(query) == 1:
        return distances
    return distances * np.exp(-ISOLATION_SHARE * isolations)
