"""How far two persistence diagrams are apart."""

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.features.diagram import PersistenceDiagram, PersistencePairs
from eigenshape.features.least_matching import least_distance, least_perfect

Points = Float[np.ndarray, "_ 2"]
Reach = Float[np.ndarray, " _"]


def bottleneck_distance(one: PersistenceDiagram, two: PersistenceDiagram) -> float:
    """Measure how far the pairs of two diagrams must move to become equal: the least largest move.

    d_B = inf over matchings of the largest max(|birth - birth'|, |death - death'|), where a pair may also be matched
    with the diagonal, half its persistence away (Cohen-Steiner, Edelsbrunner and Harer 2007). Maxima, minima,
    components and loops are matched apart, the last two only with one another. It is at most max |f - g| for two
    functions on one shape.

    Exact: whether a distance suffices is told by two maximum matchings among the pairs nearer than it (every pair that
    is too far from the diagonal must be matched, first those of one diagram, then those of the other: Mendelsohn and
    Dulmage 1958), and the least candidate that does is searched for. Memory grows with the number of such pairs.

    Parameters
    ----------
    one, two : PersistenceDiagram

    Returns
    -------
    float
        In the function's unit; infinite where the numbers of components or of loops differ.

    Raises
    ------
    InvalidParameterError
        If the loops of one diagram alone are known.
    """
    require_type(one, PersistenceDiagram, "one")
    require_type(two, PersistenceDiagram, "two")
    if (one.loops is None) != (two.loops is None):
        raise InvalidParameterError(
            "Diagrams must both have loops, or neither, to be compared; one is of a solid or of points. Compare such "
            "diagrams by replace(diagram, loops=None)."
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
    """Return the bottleneck distance of pairs (birth, death) that may vanish into the diagonal."""
    return least_distance(one, two, _to_diagonal(one), _to_diagonal(two))


def essential_distance(one: Points, two: Points) -> float:
    """Return the bottleneck distance of pairs that must all be matched; infinite where their numbers differ."""
    return least_perfect(one, two, np.inf)[0] if len(one) == len(two) else float(np.inf)


def _to_diagonal(points: Points) -> Reach:
    return np.abs(points[:, 0] - points[:, 1]) / 2
