"""Maps of a connected part, grown from several starts."""

import numpy as np
from jaxtyping import Float

from eigenshape._threads import map_in_threads
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import FARTHEST, FitPlan, fit_part
from eigenshape.matching.pairs import (
    FEWEST_PAIRS,
    FIRST_ROUNDS,
    NEXT_SLACKS,
    START_SLACKS,
    Pairs,
    couplings,
    cover_differences,
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
from eigenshape.matching.views import describe_cover

N_NEXT_STARTS = 2  # of each slack, in the second round
# Modes that make a map smooth before the part is bent again: 30 and 100 lower the misfit less.
N_LOW_MODES = 60
# Mean weight of discs from which maps are not grown again. Scans of the tuning half have 0.34 to 0.46,
# and cuts and parts with holes, which gain nothing from it, at least 0.58.
MOSTLY_WHOLE = 0.5
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


def grow_starts(
    part: Surface,
    whole: Surface,
    costs: Float[np.ndarray, "m k"],
    n_starts: int,
    slacks: tuple[float, ...] = START_SLACKS,
) -> list[Pairs]:
    """Return sets of pairs, grown from the best candidates by several slacks, given costs.

    There are up to `n_starts` of each slack; each excludes the pairs of those before.
    """
    points, partners = first_candidates(costs)
    found = []
    for slack in slacks:
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
    plan: FitPlan, differences: Float[np.ndarray, "m k"], n_starts: int
) -> list[FittedMap]:
    """Return maps of a part that is bent onto the whole, from several starts, the best fit first."""
    starts = grow_starts(plan.part, plan.whole, descriptor_costs(differences), n_starts)
    return _best_first(_fit_pairs(plan, starts))


def _fit_pairs(plan: FitPlan, starts: list[Pairs]) -> list[FittedMap]:
    def fit(pairs: Pairs) -> FittedMap:
        ends = place_points(plan.part, plan.whole, pairs, plan.part.points)[0]
        return FittedMap(pairs, fit_part(plan, ends))

    return map_in_threads(fit, starts)


def _best_first(maps: list[FittedMap]) -> list[FittedMap]:
    return sorted(maps, key=lambda one: one.fit.misfit)


def improve_maps(
    plan: FitPlan,
    differences: Float[np.ndarray, "m k"],
    maps: list[FittedMap],
    ours: Modes,
    theirs: Modes,
) -> list[FittedMap]:
    """Return more maps, made from the best ones, the best fit first.

    A fit from the true places leaves 0.4 of the misfit of the best of nine starts on scans, and 0.6
    on cuts, so that what is missing are starts. The best map is made smooth by low modes, from
    which the part is bent again. If rims cut off most of the discs, as those of scans, the piece of
    the whole that the map covers is described next, whose discs end where those of the part end,
    and maps are grown from the most similar points on it and from the map itself.
    """
    part, whole = plan.part, plan.whole
    maps = _smooth_best(plan, maps, ours, theirs)
    best = maps[0].fit
    thin = part.weights.mean() < MOSTLY_WHOLE
    cover = describe_cover(whole, best.places) if thin else None
    if cover is None:
        return maps
    costs = descriptor_costs(cover_differences(part, differences, cover))
    starts = grow_starts(part, whole, costs, N_NEXT_STARTS, NEXT_SLACKS)
    # Points with a small gap are better supported.
    support = np.maximum(1 - best.gaps[part.points] / FARTHEST, 1e-3)
    partners = whole.nearest[best.places[part.points]]
    kept = grow_pairs(part, whole, costs, Pairs(np.arange(len(partners)), partners, support))
    if len(kept.points) >= FEWEST_PAIRS:
        starts.append(kept)
    return _smooth_best(plan, _best_first([*maps, *_fit_pairs(plan, starts)]), ours, theirs)


def _smooth_best(
    plan: FitPlan, maps: list[FittedMap], ours: Modes, theirs: Modes
) -> list[FittedMap]:
    """Bend the part again from the best map, made smooth by low modes, as long as that is better.

    The new map takes the place of the one that it was made from, and keeps its pairs.
    """
    for _ in range(MOST_SMOOTHINGS):
        places, _ = smooth_places(ours, theirs, maps[0].fit.places, N_LOW_MODES)
        fit = fit_part(plan, places[plan.part.points])
        if fit.misfit >= maps[0].fit.misfit:
            break
        maps = [FittedMap(maps[0].pairs, fit), *maps[1:]]
    return maps
