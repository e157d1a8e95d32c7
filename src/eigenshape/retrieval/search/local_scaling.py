"""Local scaling: shapes that are near to everything count as farther away."""

import numpy as np
from jaxtyping import Bool, Float, Float32

from eigenshape.retrieval.patches.distance import SIZE_PRICE
from eigenshape.retrieval.search.axes import LARGEST_OF_QUERY
from eigenshape.retrieval.search.candidates import smallest
from eigenshape.retrieval.search.coarse import CoarseRows
from eigenshape.retrieval.search.scan_loops import scan

# Both chosen on the tuning half of experiments/ch5_retrieval, where 3 to 20 and 0.25 to 1 did as
# well.
N_NEAREST = 10
SHARE = 0.5
LEAST_DISTANCE = 1e-3  # so that scores stay above 0 and in order


def crowding(coarse: CoarseRows) -> Float32[np.ndarray, " n"]:
    """Return the mean distance of each whole shape to its ten nearest others, by coarse rows.

    The time grows with the square of the number of shapes: 10 s for 10,000.
    """
    rows = coarse.numbers_at(np.arange(len(coarse.rows)))
    n_shapes = len(rows)
    weights = coarse.axes.steps.reshape(-1) ** 2
    scores, means = np.empty(n_shapes, np.float32), np.zeros(n_shapes, np.float32)
    for place, row in enumerate(rows):
        numbers = row * weights
        scale = LARGEST_OF_QUERY / (float(np.abs(numbers).max()) or 1.0)
        query = np.rint(np.float32(scale) * numbers).astype(np.int16)
        scan(query, rows, 1 / (scale * len(coarse.axes.axes)), SIZE_PRICE, scores)
        scores[place] = np.inf
        nearest = scores[smallest(scores, N_NEAREST)]
        if n_shapes > 1:
            means[place] = nearest[np.isfinite(nearest)].mean()
    return means


def scale_locally(
    distances: Float[np.ndarray, " k"],
    crowdings: Float32[np.ndarray, " k"],
    closed: Bool[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Subtract from distances half of how far each shape lies from its nearest others.

    A shape that lies near to many is near to a query for no reason of its own. Open and closed
    shapes are centered apart, since parts lie farther from everything. One-sided scans that are
    searched for lose by it, so use it for closed queries.
    """
    extra = crowdings.astype(np.float64)
    for group in (closed, ~closed):
        if group.any():
            extra[group] -= extra[group].mean()
    return np.maximum(distances - SHARE * extra, LEAST_DISTANCE)
