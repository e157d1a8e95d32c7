"""Maps that fit as well as the best one: those of a shape that can be turned into itself."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.measure import edge_lengths
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import FitPlan
from eigenshape.matching.growth import grow_maps

# Misfit of a best map that leaves hardly more than the spacing of vertices: the best maps of pairs of
# different shapes have 3.1e-3 and more; balls, rings and cubes turned into themselves up to 1e-3.
PERFECT = 2e-3
# Largest misfit of its rivals, which are less settled, and the same in mean edges of the whole, which
# is more on coarse meshes. Rivals have 0.8e-3 to 2.8e-3 on round shapes of 600 to 2,600 vertices and
# 6e-3 and more on a ball of 160 (edges of 0.07); on animals of 300 vertices they have 14e-3 and more.
EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES = 3e-3, 0.12
# Two places differ if they are farther apart, in units: 0.05 √area, as in the confidence.
DIFFERENT = 0.06
MOST_OF_AREA = 0.5  # two maps differ if they do over this share of the part
NEAR = 0.12  # places this near to the image of a point are taken by the best map


def equally_good_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], maps: Sequence[FittedMap]
) -> list[FittedMap]:
    """Return maps that differ from each other and from the first one, and fit as perfectly.

    Starts of a search all lead to one map if that fits perfectly. So the search is repeated with
    patches that are less alike where the first map places them.
    """
    best = maps[0]
    if best.fit.misfit > PERFECT:
        return []
    ends = plan.whole.nearest[best.fit.places[plan.part.points]]
    taken = plan.whole.between[ends] < NEAR
    elsewhere = grow_maps(plan, differences + np.median(differences) * taken)
    edge = float(edge_lengths(plan.whole.mesh).mean())
    most = max(EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES * edge)
    found = [best]
    for one in [*maps[1:], *elsewhere]:
        if one.fit.misfit <= most and all(_differ(plan, one, other) for other in found):
            found.append(one)
    return found[1:]


def _differ(plan: FitPlan, one: FittedMap, other: FittedMap) -> bool:
    return bool(plan.shares @ _elsewhere(plan, one, other) > MOST_OF_AREA)


def _elsewhere(plan: FitPlan, one: FittedMap, other: FittedMap) -> Float[np.ndarray, " n"]:
    """Return 1 for each vertex that two maps place in different places, and 0 for the others."""
    vertices = plan.whole.mesh.vertices
    gaps = np.linalg.norm(vertices[one.fit.places] - vertices[other.fit.places], axis=1)
    return (gaps > DIFFERENT).astype(np.float64)


def count_places(
    plan: FitPlan, best: FittedMap, rivals: Sequence[FittedMap]
) -> Float[np.ndarray, " n"]:
    """Return at how many places each vertex may lie: 1, and 1 for each rival that moves it."""
    return 1 + sum((_elsewhere(plan, best, rival) for rival in rivals), np.zeros(len(plan.shares)))
