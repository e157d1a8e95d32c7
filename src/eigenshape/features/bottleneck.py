"""How far two persistence diagrams are apart."""

from bisect import bisect_left

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.spatial import cKDTree

from eigenshape._errors import InvalidParameterError
from eigenshape.features.diagram import PersistenceDiagram, PersistencePairs
from eigenshape.features.matching_loops import covers_rows

Points = Float[np.ndarray, "_ 2"]
Reach = Float[np.ndarray, " _"]
FINE = 1e-4  # of the distance: an interval so short holds few candidates


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
    return _least(one, two, _to_diagonal(one), _to_diagonal(two))


def essential_distance(one: Points, two: Points) -> float:
    """Return the bottleneck distance of pairs that must all be matched; infinite where their numbers differ."""
    never = np.full(len(one), np.inf)
    return _least(one, two, never, never) if len(one) == len(two) else float(np.inf)


def _to_diagonal(points: Points) -> Reach:
    return np.abs(points[:, 0] - points[:, 1]) / 2


def _least(one: Points, two: Points, reach_one: Reach, reach_two: Reach) -> float:
    """Return the least distance that suffices, where points may vanish that are not beyond their reach.

    It is 0, one of the reaches, or the distance of two points. The interval that holds it is halved until few of
    these lie in it, and these are searched.
    """

    def suffices(distance: float) -> bool:
        return _covers(one[reach_one > distance], two, distance) and _covers(two[reach_two > distance], one, distance)

    if suffices(0.0):
        return 0.0
    reaches = np.concatenate([reach_one, reach_two])
    low, high = 0.0, float(reaches.max())
    if np.isinf(high):
        high = float(np.abs(one - two).max())
    while high - low > FINE * high:
        middle = low + (high - low) / 2
        low, high = (low, middle) if suffices(middle) else (middle, high)
    pairs = [_near(one[reach_one > low], two, high)["v"], _near(two[reach_two > low], one, high)["v"]]
    left = np.unique(np.concatenate([reaches, *pairs, [high]]))
    left = left[(left > low) & (left <= high)]
    return float(left[bisect_left(range(len(left) - 1), True, key=lambda place: suffices(float(left[place])))])


def _covers(some: Points, others: Points, distance: float) -> bool:
    """Say whether each of some points can have another for itself within the distance."""
    if not len(some) or len(some) > len(others):
        return not len(some)
    near = _near(some, others, distance)
    if not np.bincount(near["i"], minlength=len(some)).all():
        return False
    graph = sp.csr_array((np.ones(len(near), dtype=np.int8), (near["i"], near["j"])), shape=(len(some), len(others)))
    return bool(covers_rows(graph.indptr, graph.indices, len(others)))


def _near(some: Points, others: Points, distance: float) -> np.ndarray:
    """List the pairs of points at most the distance apart: i, j and v, the larger difference of coordinates."""
    if not len(some) or not len(others):
        return np.empty(0, dtype=[("i", np.intp), ("j", np.intp), ("v", np.float64)])
    return cKDTree(some).sparse_distance_matrix(cKDTree(others), distance, p=np.inf, output_type="ndarray")
