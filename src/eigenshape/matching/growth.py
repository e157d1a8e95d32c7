"""Maps of a connected part, grown from several starts."""

import numpy as np
from jaxtyping import Float

from eigenshape._threads import map_in_threads
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import fit_part, plan_fit
from eigenshape.matching.pairs import (
    FEWEST_PAIRS,
    FIRST_ROUNDS,
    START_SLACKS,
    Pairs,
    couplings,
    descriptor_costs,
    first_candidates,
    grow_pairs,
    patch_differences,
    place_points,
    select_pairs,
    supports,
)
from eigenshape.matching.surface import Surface, turn_over


def first_support(part: Surface, whole: Surface, *, turned: bool) -> float:
    """Return how far candidates by descriptors support each other.

    If `turned`, the part is turned over before.
    """
    side = turn_over(part) if turned else part
    points, partners = first_candidates(descriptor_costs(patch_differences(side, whole)))
    coupling = couplings(side, whole, points, partners)
    _, chosen = select_pairs(coupling, points, partners, supports(coupling, points, FIRST_ROUNDS))
    return float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).sum())


def grow_starts(
    part: Surface, whole: Surface, costs: Float[np.ndarray, "m k"], n_starts: int
) -> list[Pairs]:
    """Return sets of pairs, grown from the best candidates by three slacks, given costs.

    There are up to `n_starts` of each slack; each excludes the pairs of those before.
    """
    points, partners = first_candidates(costs)
    found = []
    for slack in START_SLACKS:
        coupling = couplings(part, whole, points, partners, slack)
        for _ in range(n_starts):
            support = supports(coupling, points, FIRST_ROUNDS)
            pairs, chosen = select_pairs(coupling, points, partners, support)
            if len(pairs.points) < FEWEST_PAIRS:
                break
            # Pairs that were chosen together support each other no more in the next start.
            coupling[np.ix_(chosen, chosen)] = 0
            pairs = grow_pairs(part, whole, costs, pairs)
            if len(pairs.points) >= FEWEST_PAIRS:
                found.append(pairs)
    return found


def fitted_maps(
    part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"], n_starts: int
) -> list[FittedMap]:
    """Return maps of a part that is bent onto the whole, from several starts, the best fit first."""
    starts = grow_starts(part, whole, descriptor_costs(differences), n_starts)
    plan = plan_fit(part, whole)

    def fit(pairs: Pairs) -> FittedMap:
        ends = place_points(part, whole, pairs, part.points)[0]
        return FittedMap(pairs, fit_part(plan, ends))

    return sorted(map_in_threads(fit, starts), key=lambda one: one.fit.misfit)
