"""Normalize distances by a cohort: some shapes are near to everything, whatever the query."""

import numpy as np
from jaxtyping import Float, Int8

from eigenshape.retrieval.patches.codebook import PatchCodebook
from eigenshape.retrieval.patches.distance import patch_distances

# Members of the cohort, after the nearest, to which the distances of a shape are averaged. The
# nearest does not count, since it may be the shape itself.
N_NEAREST = 5
FEWEST_MEMBERS = 1 + N_NEAREST
ISOLATION_SHARE = 0.5
# Isolations are whole multiples of this, as an index stores them.
ISOLATION_STEP = 1e-6


def cohort_distance(codes: Int8[np.ndarray, "b s v"], cohort: Int8[np.ndarray, "k b s v"]) -> float:
    """Return the mean distance of a shape to the second to sixth nearest members of a cohort."""
    nearest = np.sort(patch_distances(codes, cohort))[1:FEWEST_MEMBERS]
    return float(nearest.mean())


def isolation(
    codes: Int8[np.ndarray, "b s v"], codebook: PatchCodebook, *, is_closed: bool
) -> float:
    """Return how much farther a shape is from the cohort than closed, or open, shapes usually are.

    0 by a codebook without cohort.
    """
    if not len(codebook.cohort):
        return 0.0
    usual = codebook.cohort_means[0 if is_closed else 1]
    found = cohort_distance(codes, codebook.cohort) - float(usual)
    return round(found / ISOLATION_STEP) * ISOLATION_STEP


def normalized_distances(
    query: Int8[np.ndarray, "u b s v"],
    distances: Float[np.ndarray, " k"],
    isolations: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Lower the distances of a closed query to isolated shapes, and raise those to common ones.

    In spaces of many dimensions some points are among the nearest of very many others ("hubs",
    Radovanović, Nanopoulos and Ivanović 2010), here shapes without features, and answer queries of
    every class.

    Parameters
    ----------
    query : (u, b, s, v) int8
        Codes of the query and of its views. Without views it is open: what a scanner saw of a shape
        is far from all whole shapes, and so distances remain as they are.
    distances, isolations : (k,) float
        Of `view_distances`, and of `isolation`.
    """
    if len(query) == 1:
        return distances
    return distances * np.exp(-ISOLATION_SHARE * isolations)
