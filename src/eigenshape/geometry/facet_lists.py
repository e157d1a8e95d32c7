"""The facets of simplices without duplicates, and where each simplex has them."""

from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import ReadOnly, record

# The corners of a facet are packed into one integer while that stays below this bound: sorting
# integers is several times as fast as sorting rows.
PACKED_BELOW = 2**63


@record
class FacetTable(ReadOnly):
    """The facets of a mesh without duplicates, and where each simplex has them.

    The facets of triangles are edges, those of tetrahedra are triangles, those of segments are
    their end points.

    Attributes
    ----------
    facets : (q, m) int
        Corners of each facet, ascending; the facets are in lexicographic order.
    simplex_facets : (s, m+1) int
        Facet of each simplex opposite to its corner 0, 1, ..., m.
    n_simplices : (q,) int
        Number of simplices at each facet: 1 on the boundary, 2 inside, more where the mesh is not
        a manifold.

    Examples
    --------
    The facets of a curve are its points:

    >>> import eigenshape as es
    >>> curve = es.SimplicialMesh([[0.0], [1.0], [2.0]], [[0, 1], [1, 2]])
    >>> es.geometry.facet_table(curve).n_simplices
    array([1, 2, 1])
    """

    facets: Int[np.ndarray, "q m"]
    simplex_facets: Int[np.ndarray, "s corners"]
    n_simplices: Int[np.ndarray, " q"]

    @property
    def boundary(self) -> Int[np.ndarray, " b"]:
        """Indices of the facets that belong to one simplex only, ascending."""
        return np.flatnonzero(self.n_simplices == 1)


def list_facets(simplices: Int[np.ndarray, "s corners"], n_points: int) -> FacetTable:
    """List the facets of simplices whose corners are numbers below `n_points`."""
    dim = simplices.shape[1] - 1
    corners = np.arange(dim + 1)
    opposite = np.array([np.delete(corners, corner) for corner in corners])
    # One row for each corner of a facet, one column for each facet: those opposite to corner 0 of
    # all simplices first, then those opposite to corner 1, and so on.
    ends = np.sort(simplices.T[opposite], axis=1).swapaxes(0, 1).reshape(dim, -1)
    if n_points**dim < PACKED_BELOW:
        shape = (n_points,) * dim
        packed = np.ravel_multi_index(tuple(ends), shape)
        keys, inverse, counts = np.unique(packed, return_inverse=True, return_counts=True)
        facets = np.stack(np.unravel_index(keys, shape), axis=1)
    else:
        facets, inverse, counts = np.unique(ends.T, axis=0, return_inverse=True, return_counts=True)
    of_simplices = inverse.reshape(dim + 1, -1).T
    return FacetTable(facets, of_simplices, counts)


def state_without_facets(mesh: object) -> dict[str, Any]:
    """Return what a mesh that keeps its facets is pickled by.

    Facets would make a pickle three times as large; the next process lists them again.
    """
    return {name: value for name, value in vars(mesh).items() if name != "facets"}


def shared_facets(
    simplex_facets: Int[np.ndarray, "..."],
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return pairs of sides that lie on one facet; they chain all sides of the facet.

    Side (m+1)·s + a is the one of simplex s opposite to its corner a.
    """
    facets = simplex_facets.ravel()
    order = np.argsort(facets, kind="stable")
    same = facets[order][1:] == facets[order][:-1]
    return order[:-1][same], order[1:][same]
