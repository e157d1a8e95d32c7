"""Maps of a connected part, grown from several starts."""

import numpy as np

from eigenshape.matching.evidence import PlacedMap, rate_map
from eigenshape.matching.pairs import (
    FEWEST_PAIRS,
    FIRST_ROUNDS,
    couplings,
    descriptor_costs,
    first_candidates,
    grow_pairs,
    place_points,
    select_pairs,
    supports,
)
from eigenshape.matching.surface import Surface, turn_over


def first_support(part: Surface, whole: Surface, *, turned: bool) -> float:
    """Return how far candidates by descriptors support each other, if the part is turned over or not."""
    side = turn_over(part) if turned else part
    points, partners = first_candidates(descriptor_costs(side, whole))
    coupling = couplings(side, whole, points, partners)
    _, chosen = select_pairs(coupling, points, partners, supports(coupling, points, FIRST_ROUNDS))
    return float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).sum())


def grow_maps(part: Surface, whole: Surface, n_starts: int) -> list[PlacedMap]:
    """Return maps grown from several starts, the best first."""
    costs = descriptor_costs(part, whole)
    points, partners = first_candidates(costs)
    coupling = couplings(part, whole, points, partners)
    every = np.arange(part.mesh.n_vertices)
    maps = []
    for _ in range(n_starts):
        support = supports(coupling, points, FIRST_ROUNDS)
        pairs, chosen = select_pairs(coupling, points, partners, support)
        if len(pairs.points) < FEWEST_PAIRS:
            break
        # Pairs that were chosen together support each other no more in the next start.
        coupling[np.ix_(chosen, chosen)] = 0
        pairs = grow_pairs(part, whole, costs, pairs)
        if len(pairs.points) < FEWEST_PAIRS:
            continue
        places, misfits = place_points(part, whole, pairs, every)
        maps.append(rate_map(part, whole, pairs, places, misfits))
    return sorted(maps, key=lambda found: -found.quality.score)
