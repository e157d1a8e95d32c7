"""Loose fragments of a shape: components too small to be sampled."""

import numpy as np
from jaxtyping import Int

from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import scaled_corners
from eigenshape.geometry.topology import require_simplices_everywhere, vertex_components

N_SHARES = 100  # a component with less than one in so many of the area is a fragment,
MOST = 0.5  # unless the others do not have even this share of the area together
EQUAL_DIGITS = 9  # of areas over the largest: copies of a part in other places differ by rounding


def fragment_vertices(mesh: TriangleMesh, n_shares: int = N_SHARES) -> Int[np.ndarray, " c"]:
    """Return the vertices of the loose fragments of a shape: components with less than 1/n of its area.

    Where most of the area is in such components, all but the n largest are fragments; of equal ones those with the
    lowest vertices count as larger.

    Parameters
    ----------
    mesh : TriangleMesh
    n_shares : int
        The number n, at least 1.

    Returns
    -------
    (c,) int
        Ascending; empty where there is one component.

    Raises
    ------
    InvalidShapeError
        If a vertex has no face.
    """
    count, labels = vertex_components(mesh)
    require_simplices_everywhere(mesh)
    face_areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    areas = np.bincount(labels[mesh.faces[:, 0]], weights=face_areas, minlength=count)
    if count == 1 or not areas.any():
        return np.empty(0, dtype=np.int64)
    small = n_shares * areas < areas.sum()
    if areas[~small].sum() < MOST * areas.sum():
        sizes = np.round(areas / areas.max(), EQUAL_DIGITS)
        largest = np.argsort(-sizes, kind="stable")[:n_shares]
        small = np.isin(np.arange(count), largest, invert=True)
    return np.flatnonzero(small[labels])
