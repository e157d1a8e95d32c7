"""Maps of a connected part, grown from several starts, and how many of them fit equally well."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from certeig.kit.threads import map_in_threads
from eigenshape.geometry.measure import edge_lengths
from eigenshape.matching.assignment import N_FAR, assign_far_points
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import (
    LARGEST_GAP,
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
    log_differences,
    place_points,
    select_pairs,
)
from eigenshape.matching.spectral_refinement import Modes, smooth_places
from eigenshape.matching.surface import Surface
from eigenshape.matching.turns import (
    N_STEPS,
    NEARLY_RIGID,
    OTHER_PLACE,
    Turn,
    is_rigid,
    rolled_turns,
    settle,
    settle_map,
    turned_fit,
)

# Of rough bends, the best ones are grown, the first few before the others; of grown maps, the best
# few once more
N_GROWN, N_FIRST_GROWN, N_GROWN_AGAIN = 9, 4, 4
# Rough bends by the best assignments, which tell whether a search for equally good maps is worth it: where there
# are such maps, one of the first two shows it (41 creatures and 15 round shapes), so that five are enough. Where all
# vertices are points, they do not: of three crossed beams with 75 and 257 vertices they all stay far away, and with
# 945 not.
N_TRIED = 5
# Evidence is clear if, of the first few maps, those with up to so many times the least misfit place all but this
# share of the part where the best one does. So it is for 25 of 70 pairs of the tuning half; their mean error is
# 1.16 in place of 1.14 (hundredths of √area), and their Brier score 0.026 in place of 0.027. With 0.1, or with 1.5
# times, which also misses the reverse of a biped, others get worse.
MUCH_WORSE, ALIKE = 1.75, 0.05
# Modes that make a map smooth before the part is bent again: 30 and 100 lower the misfit less.
N_LOW_MODES = 60
N_BENT_ROLLS = 2  # rolls of a nearly rigid part from which it is bent
# Of maps with up to so many times the least misfit, that one comes first whose turn leaves less than this
# share of the gap: on a right place a foot has 1.03 times the misfit of a wrong one, and an eighth of its gap.
ABOUT_AS_GOOD, NEARER = 1.1, 0.5
MOST_SMOOTHINGS = 2  # it ends earlier if a bend is no better
# Maps to other places that are refined, too: how many at most, and up to how many times the least misfit
N_REFINED, WORTH_REFINING = 3, 1.4
# Misfit up to which a map is as good as any, and the same in mean edges of the whole, which is more
# on coarse meshes. The best rivals of 24 balls, ellipsoids, rings, cylinders and boxes, turned into
# themselves or with other triangles, have 0 to 2.3e-3 or up to 0.12 edges; of a ball of 10,242 vertices,
# the fourth map has 4.5e-3. Those of 24 pairs of cats,
# horses and wolves that `calibrate.py` draws have 6.0e-3 and more, and those of animals of 300
# vertices 14e-3 and more. So the confidence of such pairs is what it would be without rivals.
EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES = 4.5e-3, 0.12
# A search for such maps ends early if the first rough bends, or the first other maps, all have more than so
# many times that misfit. Later maps lower the least by 2 and 8 % for pairs of animals, and by 16 % for an
# ellipsoid that is matched to one with other triangles. Of 40 real shapes with 2,500 vertices, matched to
# copies with 1,500, and of eight beams, crosses and jacks, the whole search finds the same numbers; of 41
# creatures, whole or scanned, and 15 round shapes, it finds a second map of one hand.
NEARLY_AS_GOOD = 1.2
# A part with less of the area of the whole may lie in another place that fits as well but for what a
# pose changes: a turn leaves at most POSED, in units, and so many times as much as that of the map.
# At its true place in another pose, a foot of a quadruped is 0.0027 to 0.0068 away from the surface by
# a turn; at the ends of other legs, 0.0011 to 0.0016.
SMALL_SHARE, POSED, TIMES_AS_FAR, N_SMALL_PLACES = 0.15, 0.008, 6.0, 8
# Patches tell places apart if their differences there are larger by this much, in logarithms: right
# places of creatures lead by 0.15 to 0.3, or by less than 0.06, as wrong ones do.
LESS_ALIKE = 0.15
MOST_OF_AREA = 0.5  # two maps differ if they do over this share of the part
TAKEN = 0.12  # places this near to the image of a point are taken by the best map


def first_support(part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"]) -> float:
    """Return how far candidates by descriptors support each other, given differences of patches."""
    points, partners = first_candidates(descriptor_costs(differences))
    coupling = couplings(part, whole, points, partners)
    _, chosen = select_pairs(coupling, points, partners, FIRST_ROUNDS)
    return float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).sum())


def grow_starts(part: Surface, whole: Surface, costs: Float[np.ndarray, "m k"]) -> list[Pairs]:
    """Return sets of pairs, grown from the best candidates by several slacks, given costs."""
    points, partners = first_candidates(costs)

    def grow(slack: float) -> Pairs:
        coupling = couplings(part, whole, points, partners, slack)
        pairs, _ = select_pairs(coupling, points, partners, FIRST_ROUNDS)
        return grow_pairs(part, whole, costs, pairs) if len(pairs.points) >= FEWEST_PAIRS else pairs

    found = map_in_threads(grow, START_SLACKS)
    return [pairs for pairs in found if len(pairs.points) >= FEWEST_PAIRS]


def fitted_maps(plan: FitPlan, differences: Float[np.ndarray, "m k"]) -> list[FittedMap]:
    """Return maps of a part that is bent onto the whole from few starts, the best fit first."""
    starts = grow_starts(plan.part, plan.whole, descriptor_costs(differences))
    return _best_first(_fit_pairs(plan, starts))


def _fit_pairs(plan: FitPlan, starts: list[Pairs]) -> list[FittedMap]:
    """Bend the part by each set of pairs, and return the maps."""

    def fit(pairs: Pairs) -> FittedMap:
        ends = place_points(plan.part, plan.whole, pairs, plan.frames)[0]
        return FittedMap(pairs, fit_part(plan, ends))

    return map_in_threads(fit, starts)


def _best_first(maps: list[FittedMap]) -> list[FittedMap]:
    return sorted(maps, key=lambda one: one.fit.misfit)


def find_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], ours: Modes, theirs: Modes
) -> tuple[list[FittedMap], Turn | None]:
    """Return maps of a part, the best fit first, and the rigid turn in which the best one settles.

    A rigid part is turned. Of others, the best map is made smooth by low modes, and slides. A part
    with so few points that it bends to any map has none.
    """
    maps = grow_maps(plan, differences) if len(plan.part.points) >= N_FAR else []
    if not maps:
        return [], None
    turn = settle_map(plan, maps[0].fit.places)
    if not is_rigid(plan, turn) and turn.gap < NEARLY_RIGID:
        # Bending forgives a roll about a long axis, so that starts that are rolled are missing, and
        # another limb, on which a foot bends as well as on its own.
        maps = _best_first(maps + _rolled_maps(plan, differences, maps[0], turn))
        maps, turn = most_rigid_first(plan, maps)
    if is_rigid(plan, turn):
        return [FittedMap(maps[0].pairs, turned_fit(plan, turn)), *maps[1:]], turn
    # Bends of the front and the back of a body differ by less than refining lowers their misfits.
    settled = maps[0]
    most = WORTH_REFINING * settled.fit.misfit
    near = [n for n in _different(plan, maps)[:N_REFINED] if maps[n].fit.misfit < most]
    maps = [_refine(plan, one, ours, theirs) if n in near else one for n, one in enumerate(maps)]
    if turn.gap >= NEARLY_RIGID:
        # The others stay in their order, in which vertices compare them.
        best = maps.pop(min(near, key=lambda n: maps[n].fit.misfit))
        maps = [best, *maps]
        if best is not settled:
            turn = settle_map(plan, best.fit.places)
    return [FittedMap(maps[0].pairs, slide_part(plan, maps[0].fit)), *maps[1:]], turn


def _refine(plan: FitPlan, best: FittedMap, ours: Modes, theirs: Modes) -> FittedMap:
    """Bend the part again from a map, made smooth by low modes, as long as that is better."""
    for _ in range(MOST_SMOOTHINGS):
        ends, _ = smooth_places(ours, theirs, best.fit.places, N_LOW_MODES, plan.frames)
        fit = fit_part(plan, ends)
        if fit.misfit >= best.fit.misfit:
            break
        best = FittedMap(best.pairs, fit)
    return best


def _different(plan: FitPlan, maps: Sequence[FittedMap]) -> list[int]:
    """Return the numbers of maps that each place most of the part elsewhere than those before."""
    found: list[int] = []
    for number, one in enumerate(maps):
        if all(_differ(plan, one, maps[other]) for other in found):
            found.append(number)
    return found


def _rolled_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], best: FittedMap, turn: Turn
) -> list[FittedMap]:
    """Return maps that are bent from rolls of the turn of the best map, to other places than that."""
    samples = plan.part.mesh.vertices[plan.samples]
    maps = []
    for rolled in rolled_turns(plan, turn)[:N_BENT_ROLLS]:
        start = turned_fit(plan, settle(plan, rolled.move(samples), plan.samples, N_STEPS))
        # Where the best map lies already, nearest points only add mistakes, as those of fingers on
        # the next finger. Bones that it rolls are 0.08 away from the best roll, hands 0.03.
        away = np.linalg.norm(start.points - best.fit.points, axis=1)
        if plan.shares @ away < OTHER_PLACE:
            continue
        pairs = _grow_again(plan, descriptor_costs(differences), [start.select(plan.part.points)])
        if pairs:
            maps.append(FittedMap(pairs[0], fit_part(plan, start.places[plan.frames])))
    return maps


def most_rigid_first(plan: FitPlan, maps: list[FittedMap]) -> tuple[list[FittedMap], Turn]:
    """Put first, of maps that fit about as well as the best, one that is much nearer to a turn.

    Also return the turn in which the first one settles.
    """
    near = [one for one in maps if one.fit.misfit < ABOUT_AS_GOOD * maps[0].fit.misfit]
    turns = [settle_map(plan, one.fit.places) for one in near]
    gaps = [turn.gap for turn in turns]
    chosen = int(np.argmin(gaps))
    if gaps[chosen] > NEARER * gaps[0]:
        return maps, turns[0]
    return [maps[chosen], *maps[:chosen], *maps[chosen + 1 :]], turns[chosen]


def grow_maps(
    plan: FitPlan,
    differences: Float[np.ndarray, "m k"],
    *,
    wanted: float = np.inf,
    known: FittedMap | None = None,
) -> list[FittedMap]:
    """Return maps of a part from many starts, the best fit first.

    A fit from the true places leaves about half of the misfit of the best of nine sets of
    pairs, so that starts are what is missing. Far points are therefore assigned in many more ways,
    the part is bent roughly by each, and maps are grown from where the best of these bends place
    it, then once more from the best maps. If the first few of these maps are clear evidence, the
    other starts are left out, and what lies elsewhere is not grown again. The search ends early if
    the misfits of the first few maps that are other than the known one are all above the wanted
    one, or, of a part with more vertices than points, those of the first rough bends.
    """
    part, whole = plan.part, plan.whole
    costs = descriptor_costs(differences)
    rough = plan_rough_fit(part, whole)

    def fit_roughly(pairs: Pairs) -> Fit:
        return fit_part(rough, place_points(part, whole, pairs, rough.frames)[0])

    # Step 3 of `match_shapes`: assignments of far points, and those whose rough bends fit best
    assigned = assign_far_points(part, whole, costs)
    fits = map_in_threads(fit_roughly, assigned[:N_TRIED])
    is_fine = part.mesh.n_vertices > len(part.points)
    if is_fine and fits and min(fit.misfit for fit in fits) > wanted:
        return []
    fits += map_in_threads(fit_roughly, assigned[N_TRIED:])
    fits = sorted(fits, key=lambda fit: fit.misfit)[:N_GROWN]
    # Steps 4 and 5: grow all starts and bend the part by each; then once more from the best
    first = _fit_pairs(plan, _grow_again(plan, costs, fits[:N_FIRST_GROWN]))
    new = [one for one in first if known is None or _differ(plan, one, known)]
    if first and all(one.fit.misfit > wanted for one in new):
        return _best_first(first)
    # Where a map is known, the search is for others, whatever the evidence.
    maps = _best_first(first)
    if known is None and _is_clear(plan, maps):
        promising = [one for one in maps if not _differ(plan, maps[0], one)]
    else:
        starts = grow_starts(part, whole, costs)
        others = _fit_pairs(plan, starts + _grow_again(plan, costs, fits[N_FIRST_GROWN:]))
        # Of equal fits, which several starts may lead to, that of the earlier start comes first.
        n = len(starts)
        promising = maps = _best_first(others[:n] + first + others[n:])
    best = [one.fit.select(part.points) for one in promising[:N_GROWN_AGAIN]]
    maps += _fit_pairs(plan, _grow_again(plan, costs, best))
    return _best_first(maps)


def _is_clear(plan: FitPlan, maps: Sequence[FittedMap]) -> bool:
    """Return whether maps, the best fit first, that fit about as well as the best lie where that does."""
    if not maps:
        return False
    most = max(MUCH_WORSE * maps[0].fit.misfit, EQUALLY_GOOD)
    rivals = [one for one in maps if one.fit.misfit < most]
    return all(plan.shares @ _placed_apart(plan, maps[0], one) < ALIKE for one in rivals)


def _grow_again(plan: FitPlan, costs: Float[np.ndarray, "m k"], fits: list[Fit]) -> list[Pairs]:
    """Return sets of pairs that grow from where fits, at the points of a part, place these."""

    def grow(fit: Fit) -> Pairs:
        # Points with a small gap are better supported.
        support = np.maximum(1 - fit.gaps / LARGEST_GAP, 1e-3)
        partners = plan.whole.nearest[fit.places]
        return grow_pairs(
            plan.part, plan.whole, costs, Pairs(np.arange(len(partners)), partners, support)
        )

    return [found for found in map_in_threads(grow, fits) if len(found.points) >= FEWEST_PAIRS]


def equally_good_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], maps: Sequence[FittedMap], turn: Turn
) -> tuple[int, Float[np.ndarray, " n"]]:
    """Count maps that differ from each other and fit as well as any, the first one among them.

    It is 0 if the first one does not. Also return at how many places each vertex may lie: 1, and 1
    for each other map that moves it.
    """
    best, whole = maps[0], plan.whole
    found, n_places = [best], np.ones(len(plan.shares))
    most = max(EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES * float(edge_lengths(whole.mesh).mean()))
    if plan.part.area < SMALL_SHARE * whole.area and turn.gap < POSED:
        rivals, most = _small_places(plan, maps), min(POSED, TIMES_AS_FAR * turn.gap)
    elif best.fit.misfit > most:
        # Nothing tells where a part lies if it fits about as well elsewhere, and as nearly rigid.
        rivals, most = _as_good(plan, differences, maps, turn), np.inf
        if not rivals:
            return 0, n_places
    else:
        # Starts of a search all lead to one map if that fits perfectly. So the search is repeated with
        # patches that are less alike where the first map places them.
        ends = whole.nearest[best.fit.places[plan.part.points]]
        unlike = differences + np.median(differences) * (whole.between[ends] < TAKEN)
        others = grow_maps(plan, unlike, wanted=NEARLY_AS_GOOD * most, known=best)
        rivals = [*maps[1:], *others]
        if is_rigid(plan, turn):
            # What bends to another place is no rival of what fits as it is.
            turns = [settle_map(plan, one.fit.places) for one in rivals]
            rivals = [
                FittedMap(one.pairs, turned_fit(plan, turn))
                for one, turn in zip(rivals, turns, strict=True)
                if is_rigid(plan, turn)
            ]
    for one in rivals:
        if one.fit.misfit <= most and all(_differ(plan, one, other) for other in found):
            found.append(one)
            n_places += _placed_apart(plan, best, one)
    return len(found), n_places


def _as_good(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], maps: Sequence[FittedMap], turn: Turn
) -> list[FittedMap]:
    """Return maps that fit about as well as the first, whose patches are about as alike, no farther from a turn."""

    def unlike(one: FittedMap) -> float:
        points = plan.part.points
        partners = plan.whole.nearest[one.fit.places[points]]
        return float(log_differences(differences, np.arange(len(points)), partners).mean())

    best = maps[0]
    most_unlike = unlike(best) + LESS_ALIKE
    return [
        one
        for one in maps[1:]
        if one.fit.misfit < ABOUT_AS_GOOD * best.fit.misfit
        and unlike(one) < most_unlike
        and turn.gap > NEARER * settle_map(plan, one.fit.places).gap
    ]


def _small_places(plan: FitPlan, maps: Sequence[FittedMap]) -> list[FittedMap]:
    """Return where a small part lies by turns that settle from different maps, rolled, too."""
    places = []
    for number in _different(plan, maps)[:N_SMALL_PLACES]:
        one = maps[number]
        rolled = rolled_turns(plan, settle_map(plan, one.fit.places))
        places += [FittedMap(one.pairs, turned_fit(plan, turn)) for turn in rolled[:N_BENT_ROLLS]]
    return places


def _differ(plan: FitPlan, one: FittedMap, other: FittedMap) -> bool:
    """Return whether two maps place most of the part at different places."""
    return bool(plan.shares @ _placed_apart(plan, one, other) > MOST_OF_AREA)


def _placed_apart(plan: FitPlan, one: FittedMap, other: FittedMap) -> Bool[np.ndarray, " n"]:
    """Return which vertices two maps place apart from each other."""
    vertices = plan.whole.mesh.vertices
    gaps = np.linalg.norm(vertices[one.fit.places] - vertices[other.fit.places], axis=1)
    return gaps > OTHER_PLACE
