"""Which shapes of an index are worth an exact comparison with a query."""

from collections.abc import Callable
from math import ceil
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from certeig.kit.arrays import record
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import scale_distances
from eigenshape.retrieval.search.coarse import CoarseRows
from eigenshape.retrieval.search.options import QueryOptions

# Below this number of shapes all are compared: it takes 30 ms, and a file of coarse rows would
# hardly be faster.
FEWEST_TO_SCAN = 2000
# Shapes that are compared exactly after a scan, for 10,000 shapes; more in proportion to the square
# root of their number. Measured by benchmarks/bench_search.py on mixtures of real descriptors.
N_COMPARED = 500
AT_SHAPES = 10_000
MOST_COMPARED = 1000  # 25 ms, and 40 MB that may have to be read from a disk
PER_MATCH = 20  # at least this many shapes are compared for each match that is requested

Method = Literal["exact", "staged", "candidates"]
# Return the places of shapes that may be near to a query, best first: an index of another library
Supplier = Callable[[Int8[np.ndarray, "b s v"], int], Int[np.ndarray, " k"]]


@record
class Candidates:
    """Shapes to compare exactly with a query, and how they were chosen.

    Attributes
    ----------
    places : (k,) int
        Ascending.
    method : str
        "exact" if these are all shapes that were asked for, "staged" after a coarse scan, and
        "candidates" if another engine supplied them.
    n_shapes : int
        Number of shapes from which they were chosen.
    """

    places: Int[np.ndarray, " k"]
    method: Method
    n_shapes: int


def choose_candidates(
    query: PatchDescriptor,
    coarse: Callable[[], CoarseRows],
    allowed: Bool[np.ndarray, " n"],
    isolations: Float[np.ndarray, " n"],
    options: QueryOptions,
    supplier: Supplier | None,
) -> Candidates:
    """Choose the shapes that are compared exactly with a query.

    Parameters
    ----------
    query : PatchDescriptor
    coarse : callable
        Return the coarse rows of all n shapes; called only if they are scanned.
    allowed : (n,) bool
        Which shapes may be found.
    isolations : (n,) float
        By which scores are scaled.
    options : QueryOptions
        How many shapes are wanted, and whether all are compared.
    supplier : callable, optional
        Return the places of so many shapes that may be near, in place of the coarse scan.

    Returns
    -------
    Candidates
    """
    places = np.flatnonzero(allowed)
    wanted = n_compared(len(allowed), int(options.n_matches))
    if options.exact or len(places) <= max(FEWEST_TO_SCAN, wanted):
        return Candidates(places, "exact", len(places))
    if supplier is not None:
        supplied = np.unique(supplier(query.codes[0], wanted))
        return Candidates(supplied[allowed[supplied]], "candidates", len(places))
    # As the exact scores are scaled: of the best ten among 10,000 mixtures, 98.8 % are then among 500
    # candidates, where 90.8 % were without it.
    scores = scale_distances(query.codes, coarse().scores(query.codes[0]), isolations)
    if len(places) < len(allowed):
        scores = scores[places]
    return Candidates(np.sort(places[smallest(scores, wanted)]), "staged", len(places))


def n_compared(n_shapes: int, n_matches: int) -> int:
    """Return how many of some shapes are compared exactly after a scan."""
    growing = ceil(N_COMPARED * (n_shapes / AT_SHAPES) ** 0.5)
    return max(min(max(growing, N_COMPARED), MOST_COMPARED), PER_MATCH * n_matches)


def smallest(scores: Float[np.ndarray, " n"], count: int) -> Int[np.ndarray, " k"]:
    """Return the places of the smallest scores, in no order."""
    if count >= len(scores):
        return np.arange(len(scores))
    return np.argpartition(scores, count)[:count]
