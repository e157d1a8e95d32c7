"""Match points of two shapes softly, by what they look like and how far they are from each other."""

import numpy as np
from jaxtyping import Float

from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.labels.labeled_shape import LabelPoints
from eigenshape.retrieval.patches.matching import anchor_strain

# Weights of the costs beside that of patches, without unit; all were chosen on the tuning half of
# experiments/ch7_labels.
ANCHOR_WEIGHT = 0.7  # of distances to the surest matched points
RADIUS_WEIGHT = 0.4  # of the squared logarithm of the thickness
OUTER_WEIGHT = 0.1  # of that of the ball outside
DISTANCE_WEIGHT = 10.0  # of the mean squared difference of distances to matched points
LARGEST_RATIO = 2.0  # logarithm of radii beyond which no ratio costs more
ROUNDS = 5  # in which distances to matched points are compared anew
TEMPERATURE = 0.1  # of the costs; a higher one spreads each point over more partners
# Power by which the shares of the source are kept: at 0, many points may take one partner; at 1
# each gives as much as its area.
BALANCE = 0.6
N_BALANCES = 20  # of rows and columns
LEAST_KERNEL = 1e-30  # below all costs that matter; keeps sums of a column above 0


@one_blas_thread()
def transport_points(
    target: LabelPoints, source: LabelPoints
) -> tuple[Float[np.ndarray, "m n"], float]:
    """Match points softly, by a fused Gromov-Wasserstein plan (Vayer and others 2019).

    The cost of a pair is the squared difference of patches, of thicknesses, and of the distances to
    the surest matched points (`match_patches`), plus the mean squared difference of distances to
    all points, each matched as in the round before. Rows keep their area, columns in part, by
    Sinkhorn's balancing (Cuturi 2013, Chizat and others 2018).

    Returns
    -------
    shares : (m, n) float
        For each point of the target, its partners in shares that sum to 1.
    cost : float
        Mean cost of a point, without unit: lower for shapes that are more alike.
    """
    step, strain = anchor_strain(target.patches, source.patches)
    ours, theirs = target.numbers[max(-step, 0)], source.numbers[max(step, 0)]
    ratios = target.radii[:, None] - source.radii
    thickness = np.minimum(ratios**2, LARGEST_RATIO**2) @ [RADIUS_WEIGHT, OUTER_WEIGHT]
    sizes = (ours**2).sum(axis=1)[:, None] + (theirs**2).sum(axis=1)
    squares = np.maximum(sizes - 2 * ours @ theirs.T, 0)
    squares = squares / (np.median(squares) or 1.0)
    alike = squares + ANCHOR_WEIGHT * strain + thickness
    plan = _balance(alike, target.shares, source.shares)
    for _ in range(ROUNDS):
        # The mean of (d(i, k) - d(j, l))² over matched k and l, for each pair i, j
        plan = plan / plan.sum()
        one = target.distances**2 @ plan.sum(axis=1)
        two = source.distances**2 @ plan.sum(axis=0)
        distortion = one[:, None] + two - 2 * target.distances @ plan @ source.distances
        costs = alike + DISTANCE_WEIGHT * distortion
        plan = _balance(costs, target.shares, source.shares)
    shares = plan / plan.sum(axis=1, keepdims=True)
    return shares, float(target.shares @ (shares * costs).sum(axis=1))


def _balance(
    costs: Float[np.ndarray, "m n"], rows: Float[np.ndarray, " m"], columns: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "m n"]:
    """Return a plan whose rows sum to their shares, and whose columns nearly do."""
    lowest = costs.min(axis=1, keepdims=True)
    kernel = np.maximum(np.exp((lowest - costs) / TEMPERATURE), LEAST_KERNEL)
    left = np.ones(len(rows))
    for _ in range(N_BALANCES):
        right = (columns / (left @ kernel)) ** BALANCE
        left = rows / (kernel @ right)
    return np.asarray(left[:, None] * kernel * right)
