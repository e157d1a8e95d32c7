"""Parcels of a surface: halves of halves, cut along the nodal lines of their lowest modes."""

import heapq

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.typing import Integer
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.requirements import require_matrix
from eigenshape.spectral.solve import solve_spectrum


@record
class ParcelTree(ReadOnly):
    """A tree of parcels, as labels of the finest and the order in which they were cut.

    Attributes
    ----------
    labels : (n,) int
        Parcel of each point, from 0.
    parents : (p,) int
        Parcel j was cut off parcel parents[j], which is less than j; parents[0] is -1.
    sizes : (p,) float
        Mass of each parcel: its area on a surface.

    See Also
    --------
    nodal_parcels

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=700)
    >>> found = es.modes.nodal_parcels(es.cotangent_laplacian(mesh), 12)
    >>> len(found.sizes), found.cut(3).max().item()
    (12, 2)
    """

    labels: Int[np.ndarray, " n"]
    parents: Int[np.ndarray, " p"]
    sizes: Float[np.ndarray, " p"]

    def cut(self, n_parcels: Integer) -> Int[np.ndarray, " n"]:
        """Return the labels of fewer parcels: those before the last cuts.

        Parameters
        ----------
        n_parcels : int
            1 to the number of parcels.

        Returns
        -------
        (n,) int

        Raises
        ------
        InvalidParameterError
            If there are not so many.
        """
        count = whole_number(n_parcels, "n_parcels", 1, len(self.parents))
        names = np.arange(len(self.parents))
        for parcel in range(count, len(names)):
            names[parcel] = names[self.parents[parcel]]
        return np.asarray(names[self.labels])


def nodal_parcels(laplacian: Laplacian, n_parcels: Integer) -> ParcelTree:
    """Divide a surface into any number of parcels, halves of halves (Pang and others 2025).

    The largest parcel is cut in two where its first mode that is not constant changes sign, until
    there are as many as wanted. The mode is that of the parcel alone, free at its border: of the
    weights -W_ij inside it, of which negative ones are left out. So Courant's theorem holds, and
    both halves are connected. A parcel in several pieces is cut into its first piece and the rest.

    Parameters
    ----------
    laplacian : Laplacian
        With positive weights on edges, such as `cotangent_laplacian(mesh)`.
    n_parcels : int
        1 to the number of points.

    Returns
    -------
    ParcelTree

    Raises
    ------
    InvalidParameterError
        If there are fewer points than parcels, or the operator has `correct="log"`.

    See Also
    --------
    find_parts : Parts that people see, cut along creases.
    es.spectral.spectral_clusters : Clusters by several modes at once.
    es.spectral.nodal_domains : Regions of one sign of a function.

    Examples
    --------
    Four parcels of a torus have a quarter of its area each:

    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.shapes.torus(40, 20))
    >>> found = es.modes.nodal_parcels(laplacian, 4)
    >>> bool(abs(found.sizes / found.sizes.sum() - 0.25).max() < 0.03)
    True
    """
    require_matrix(laplacian)
    n = laplacian.n_points
    count = whole_number(n_parcels, "n_parcels", 1, n)
    weights = sp.csr_array(-laplacian.stiffness)
    weights.data = np.maximum(weights.data, 0.0)  # the diagonal, too
    weights.eliminate_zeros()
    masses = laplacian.mass.sum(axis=1)
    labels = np.zeros(n, dtype=np.int64)
    parents = [-1]
    # The largest parcel comes first; parcels of one point cannot be cut.
    waiting = [(-masses.sum(), 0, np.arange(n))]
    while len(parents) < count:
        _, parcel, members = heapq.heappop(waiting)
        second = _cut(weights[members][:, members], masses[members])
        labels[members[second]] = len(parents)
        for name, part in ((parcel, members[~second]), (len(parents), members[second])):
            if len(part) > 1:
                heapq.heappush(waiting, (-masses[part].sum(), name, part))
        parents.append(parcel)
    return ParcelTree(labels, np.array(parents), np.bincount(labels, masses))


def _cut(weights: sp.csr_array, masses: Float[np.ndarray, " m"]) -> np.ndarray:
    """Return the points of the second half of a parcel."""
    n_pieces, pieces = connected_components(weights, directed=False)
    if n_pieces > 1:
        return np.asarray(pieces > 0)
    stiffness = sp.diags_array(weights.sum(axis=1)) - weights
    operator = Laplacian(sp.csr_array(stiffness), sp.diags_array(masses).tocsr())
    mode = solve_spectrum(operator, 2).eigenvectors[:, 1]
    # The half with the first point keeps the name, whatever the sign of the mode.
    positive = mode > 0
    return np.asarray(positive != positive[0])
