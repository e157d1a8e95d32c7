"""Maps that fit as well as the best one: those of a shape that can be turned into itself."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.measure import edge_lengths
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import FitPlan
from eigenshape.matching.growth import grow_maps

# Misfit up to which a map is as good as any, and the same in mean edges of the whole, which is more
# on coarse meshes. The best rivals of 24 balls, ellipsoids, rings, cylinders and boxes, turned into
# themselves or with other triangles, have 0 to 2.3e-3 or up to 0.12 edges; of a ball of 10,242 vertices,
# the fourth map has 4.5e-3. Those of 24 pairs of cats,
# horses and wolves that `calibrate.py` draws have 6.0e-3 and more, and those of animals of 300
# vertices 14e-3 and more. So the confidence of such pairs is what it would be without rivals.
EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES = 4.5e-3, 0.12
# Two places differ if they are farther apart, in units: 0.05 √area, as in the confidence.
DIFFERENT = 0.06
MOST_OF_AREA = 0.5  # two maps differ if they do over this share of the part
NEAR = 0.12  # places this near to the image of a point are taken by the best map


def equally_good_maps(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], maps: Sequence[FittedMap]
) -> list[FittedMap]:
    """Return maps that differ from each other and from the first one, and fit as well.

    Starts of a search all lead to one map if that fits perfectly. So the search is repeated with
    patches that are less alike where the first map places them.
    """
    best = maps[0]
    edge = float(edge_lengths(plan.whole.mesh).mean())
    most = max(EQUALLY_GOOD, EQUALLY_GOOD_IN_EDGES * edge)
    if best.fit.misfit > most:
        return []
    ends = plan.whole.nearest[best.fit.places[plan.part.points]]
    taken = plan.whole.between[ends] < NEAR
    elsewhere = grow_maps(plan, differences + np.median(differences) * taken)
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
