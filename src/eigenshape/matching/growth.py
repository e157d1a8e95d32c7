"""Maps of a connected part, grown from several starts."""

import numpy as np
from jaxtyping import Float

from eigenshape._threads import map_in_threads
from eigenshape.matching.assignment import N_FAR, assign_far_points
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import (
    FARTHEST,
    Fit,
    FitPlan,
    fit_part,
    plan_rough_fit,
    slide_part,
)
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
from eigenshape.matching.spectral_refinement import Modes, smooth_places
from eigenshape.matching.surface import Surface, turn_over

# Of rough bends, the best ones are grown; of grown maps, the best few once more
N_GROWN, N_GROWN_AGAIN = 9, 4
# Modes that make a map smooth before the part is bent again: 30 and 100 lower the misfit less.
N_LOW_MODES = 60
MOST_SMOOTHINGS = 2  # it ends earlier if a bend is no better


def first_support(part: Surface, whole: Surface, *, turned: bool) -> float:
    """Return how far candidates by descriptors support each other.

    If `turned`, the part is turned over before.
    """
    side = turn_over(part) if turned else part
    points, partners = first_candidates(descriptor_costs(patch_differences(side, whole)))
    coupling = couplings(side, whole, points, partners)
    _, chosen = select_pairs(coupling, points, partners, supports(coupling, points, FIRST_ROUNDS))
    return float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).sum())


def grow_starts(part: Surface, whole: Surface, costs: Float[np.ndarray, "m k"]) -> list[Pairs]:
    """Return sets of pairs, grown from the best candidates by several slacks, given costs."""
    points, partners = first_candidates(costs)
    found = []
    for slack in START_SLACKS:
        coupling = couplings(part, whole, points, partners, slack)
        support = supports(coupling, points, FIRST_ROUNDS)
        pairs, _ = select_pairs(coupling, points, partners, support)
        if len(pairs.points) >= FEWEST_PAIRS:
            found.append(grow_pairs(part, whole, costs, pairs))
    return [pairs for pairs in found if len(pairs.points) >= FEWEST_PAIRS]


def fitted_maps(plan: FitPlan, differences: Float[np.ndarray, "m k"]) -> list[FittedMap]:
    """Return maps of a part that is bent onto the whole from few starts, the best fit first."""
    starts = grow_starts(plan.part, plan.whole, descriptor_costs(differences))
    return _best_first(_fit_pairs(plan, starts))


def _fit_pairs(plan: FitPlan, starts: list[Pairs]) -> list[FittedMap]:
    def fit(pairs: Pairs) -> FittedMap:
        ends = place_points(plan.part, plan.whole, pairs, plan.frames)[0]
        return FittedMap(pairs, fit_part(plan, ends))

    return map_in_threads(fit, starts)


def _best_first(maps: list[FittedMap]) -> list[FittedMap]:
    return sorted(maps, key=lambda one: one.fit.misfit)


def find_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], ours: Modes, theirs: Modes
) -> list[FittedMap]:
    """Return maps of a part, the best fit first, which low modes made smooth and which slid.

    A part with so few points that it bends to any map has none.
    """
    maps = grow_maps(plan, differences) if len(plan.part.points) >= N_FAR else []
    if not maps:
        return []
    first, *others = _smooth_best(plan, maps, ours, theirs)
    return [FittedMap(first.pairs, slide_part(plan, first.fit)), *others]


def grow_maps(plan: FitPlan, differences: Float[np.ndarray, "m k"]) -> list[FittedMap]:
    """Return maps of a part from many starts, the best fit first.

    A fit from the true places leaves about half of the misfit of the best of nine sets of
    pairs, so that starts are what is missing. Far points are therefore assigned in many more ways,
    the part is bent roughly by each, and maps are grown from where the best of these bends place
    it, then once more from the best maps.
    """
    part, whole = plan.part, plan.whole
    costs = descriptor_costs(differences)
    rough = plan_rough_fit(part, whole)

    def fit_roughly(pairs: Pairs) -> Fit:
        return fit_part(rough, place_points(part, whole, pairs, rough.frames)[0])

    fits = map_in_threads(fit_roughly, assign_far_points(part, whole, costs))
    fits = sorted(fits, key=lambda fit: fit.misfit)[:N_GROWN]
    starts = grow_starts(part, whole, costs) + _grow_again(plan, costs, fits)
    maps = _best_first(_fit_pairs(plan, starts))
    best = [one.fit.select(part.points) for one in maps[:N_GROWN_AGAIN]]
    return _best_first([*maps, *_fit_pairs(plan, _grow_again(plan, costs, best))])


def _grow_again(plan: FitPlan, costs: Float[np.ndarray, "m k"], fits: list[Fit]) -> list[Pairs]:
    """Return sets of pairs that grow from where fits, at the points of a part, place these."""

    def grow(fit: Fit) -> Pairs:
        # Points with a small gap are better supported.
        support = np.maximum(1 - fit.gaps / FARTHEST, 1e-3)
        partners = plan.whole.nearest[fit.places]
        return grow_pairs(
            plan.part, plan.whole, costs, Pairs(np.arange(len(partners)), partners, support)
        )

    return [found for found in map_in_threads(grow, fits) if len(found.points) >= FEWEST_PAIRS]


def _smooth_best(
    plan: FitPlan, maps: list[FittedMap], ours: Modes, theirs: Modes
) -> list[FittedMap]:
    """Bend the part again from the best map, made smooth by low modes, as long as that is better.

    The new map takes the place of the one that it was made from, and keeps its pairs.
    """
    for _ in range(MOST_SMOOTHINGS):
        places, _ = smooth_places(ours, theirs, maps[0].fit.places, N_LOW_MODES)
        fit = fit_part(plan, places[plan.frames])
        if fit.misfit >= maps[0].fit.misfit:
            break
        maps = [FittedMap(maps[0].pairs, fit), *maps[1:]]
    return maps
