"""Few far points of a part assigned to points of a whole in many ways: which limb goes where."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape.matching.match_loops import nearest_rows, support_extensions
from eigenshape.matching.pairs import Pairs, couplings
from eigenshape.matching.surface import Surface

N_FAR = 14  # points of the part that are assigned; 20 take half as long again and gain 0.3 to 0.8
N_PLACES = 100  # cells of the whole; each far point goes to the most similar point of one of them
# Distances of far points change with the pose by up to 18 %; slacks of 0.3 and 0.4 are as good.
FAR_SLACK = 0.4
# What the logarithm of a difference of patches counts beside the support by one other pair, and the
# least difference, in medians of those of the most similar points. Twice as much is worse by 1.
UNLIKE, LEAST_COST = 0.5, 0.2
# Assignments are kept that are among the best N_ALIKE of those that take the first two points to
# the same two of N_REGIONS regions of the whole, so that all permutations of limbs stay in the
# search; without regions one to five different assignments are left, and their errors are two to
# three times as large.
N_REGIONS, N_ALIKE = 30, 4
BEAM_WIDTH = 1000  # partial assignments that are extended at a time
N_ASSIGNMENTS = 30  # that are bent roughly, which takes half a second
# Two assignments differ if they take more than this share of the points farther apart than APART.
DIFFERENT, APART = 0.2, 0.12


def assign_far_points(
    part: Surface, whole: Surface, costs: Float[np.ndarray, "m k"]
) -> list[Pairs]:
    """Return different assignments of far points of a part to points of a whole, the best first.

    The search extends partial assignments by one point at a time and keeps the best ones (beam
    search). An assignment is worth what its pairs support each other, by distances and directions
    along the surface (`couplings`), less what their patches differ. A part with too few points has
    no assignment.
    """
    if len(part.points) < N_FAR:
        return []
    # Points that are far from each other and, if possible, from the boundary
    inside = part.weights.min(axis=1).astype(np.float64)
    found = [int((inside * part.between.mean(axis=1)).argmax())]
    while len(found) < N_FAR:
        found.append(int((inside * part.between[found].min(axis=0)).argmax()))
    far = np.array(found)
    # In each cell of the whole, each far point has one candidate: the most similar point.
    cell = whole.between[:, :N_PLACES].argmin(axis=1)
    order = np.lexsort((costs[far], np.broadcast_to(cell, (len(far), len(cell)))), axis=1)
    firsts = np.flatnonzero(np.diff(cell[order[0]], prepend=-1))
    partners, count = order[:, firsts].ravel(), len(firsts)
    points = np.repeat(far, count)
    coupling = couplings(part, whole, points, partners, FAR_SLACK)
    transposed = np.ascontiguousarray(coupling.T)
    unlike = UNLIKE * np.log(np.maximum(costs[points, partners], LEAST_COST))
    region = whole.between[partners, :N_REGIONS].argmin(axis=1)

    # Row b of `chosen` holds candidates of the first points, `sums` the support of each by the
    # others, and `kind` the regions of the first two.
    chosen = np.arange(count)[:, None]
    sums = np.zeros((count, 1), dtype=np.complex64)
    cost, kind = unlike[:count], np.zeros(count, dtype=np.int64)
    for step in range(1, len(far)):
        new = np.arange(step * count, (step + 1) * count)
        support = np.empty((len(chosen), count), dtype=np.float32)
        support_extensions(chosen, sums, coupling, transposed, step * count, support)
        costs_now = cost[:, None] + unlike[new]
        worth = support / step - costs_now
        if step == 1:
            old, one = np.divmod(np.arange(count**2), count)
            kinds = region[old] * N_REGIONS + region[new[one]]
        else:
            # No assignment has more than N_ALIKE extensions among the best N_ALIKE of its kind.
            best = nearest_rows(-worth.T, min(N_ALIKE, count))
            one = best.ravel()
            old = np.repeat(np.arange(len(worth)), best.shape[1])
            kept = _best_of_kinds(worth[old, one], kind[old])[:BEAM_WIDTH]
            old, one = old[kept], one[kept]
            kinds = kind[old]
        before, added = chosen[old], new[one]
        by_before = coupling[added, before.T].sum(axis=0)
        sums = np.column_stack([sums[old] + coupling[before, added[:, None]], by_before])
        chosen = np.column_stack([before, added])
        cost, kind = costs_now[old, one], kinds
    # The first assignments that differ from all that were taken before
    ends = partners[chosen]
    different = [ends[0]]
    for other in ends[1:]:
        apart = whole.between[other, different] > APART
        if (apart.mean(axis=1) > DIFFERENT).all():
            different.append(other)
            if len(different) == N_ASSIGNMENTS:
                break
    return [Pairs(far, taken, np.ones(len(far))) for taken in different]


def _best_of_kinds(
    worth: Float[np.ndarray, " a"], kinds: Int[np.ndarray, " a"]
) -> Int[np.ndarray, " k"]:
    """Return the numbers of the best `N_ALIKE` of each kind, the best first."""
    order = np.lexsort((-worth, kinds))
    sorted_kinds = kinds[order]
    ranks = np.arange(len(order)) - np.searchsorted(sorted_kinds, sorted_kinds)
    kept = order[ranks < N_ALIKE]
    return kept[np.argsort(-worth[kept], kind="stable")]
