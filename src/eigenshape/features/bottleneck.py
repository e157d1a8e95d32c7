"""Bottleneck distance of two persistence diagrams."""

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.features.diagram import PersistenceDiagram, PersistencePairs
from eigenshape.features.least_matching import least_distance, least_perfect

Points = Float[np.ndarray, "_ 2"]


def bottleneck_distance(one: PersistenceDiagram, two: PersistenceDiagram) -> float:
    """Compute the bottleneck distance of two persistence diagrams.

    d_B = inf over matchings of the largest max(|birth - birth'|, |death - death'|), where a pair
    may also be matched with the diagonal, at half its persistence (Cohen-Steiner, Edelsbrunner and
    Harer 2007). Maxima, minima, components and loops are matched separately; components and loops
    only with each other, not with the diagonal. For two functions f and g on one shape, d_B ≤ max
    |f - g|.

    The result is exact. A distance is sufficient if two maximum matchings exist among the pairs
    within it: one of the points of the first diagram that are too far from the diagonal, and one of
    those of the second (Mendelsohn and Dulmage 1958). The smallest sufficient candidate is found by
    bisection. Memory grows with the number of pairs within the distance.

    Parameters
    ----------
    one, two : PersistenceDiagram

    Returns
    -------
    float
        In the function's unit; infinite if the numbers of components or of loops differ.

    Raises
    ------
    InvalidParameterError
        If only one of the diagrams has loops.

    See Also
    --------
    persistence_diagram : Compute a diagram.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> heights = [0, 0, 2, 2, 1, 1, 3, 3, 0, 0]
    >>> lower = [0, 0, 2, 2, 1, 1, 2.5, 2.5, 0, 0]
    >>> diagram = es.features.persistence_diagram(mesh, heights)
    >>> es.features.bottleneck_distance(diagram, es.features.persistence_diagram(mesh, lower))
    0.5
    """
    require_type(one, PersistenceDiagram, "one")
    require_type(two, PersistenceDiagram, "two")
    if (one.loops is None) != (two.loops is None):
        raise InvalidParameterError(
            "Diagrams must both have loops, or neither, to be compared; one is of a solid or of "
            "points. Compare such diagrams by replace(diagram, loops=None)."
        )
    distances = [ordinary_distance(_points(one.maxima), _points(two.maxima))]
    distances.append(ordinary_distance(_points(one.minima), _points(two.minima)))
    distances.append(essential_distance(_points(one.components), _points(two.components)))
    if one.loops is not None and two.loops is not None:
        distances.append(essential_distance(_points(one.loops), _points(two.loops)))
    return max(distances)


def _points(pairs: PersistencePairs) -> Points:
    return np.column_stack([pairs.births, pairs.deaths])


def ordinary_distance(one: Points, two: Points) -> float:
    """Return the bottleneck distance of pairs that may be matched with the diagonal."""
    reach_one, reach_two = (np.abs(points[:, 0] - points[:, 1]) / 2 for points in (one, two))
    return least_distance(one, two, reach_one, reach_two)


def essential_distance(one: Points, two: Points) -> float:
    """Return the bottleneck distance of pairs that must all be matched, or infinity."""
    return least_perfect(one, two, np.inf)[0] if len(one) == len(two) else float(np.inf)
