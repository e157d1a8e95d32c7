"""Loose fragments of a shape: components too small to be worth sampling."""

import numpy as np
from jaxtyping import Int

from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import scaled_corners
from eigenshape.geometry.topology import require_simplices_everywhere, vertex_components

# A component with less than 1/100 of the area is a fragment.
N_SHARES = 100
# If the components that are large enough have less than this share of the area together, the shape
# consists of small parts, and its largest N_SHARES components are kept instead.
LEAST_SHARE_KEPT = 0.5
# Areas, relative to the largest, are compared to this many decimals: copies of one part at
# different places differ by rounding and must count as equal.
EQUAL_DIGITS = 9


def fragment_vertices(mesh: TriangleMesh, n_shares: int = N_SHARES) -> Int[np.ndarray, " c"]:
    """Return the vertices of loose fragments: components with less than 1/n of the area.

    If most of the area is in such components, all but the n largest components are fragments. Of
    components with equal areas those with the lowest vertices are kept first.

    Raise InvalidShapeError if a vertex has no face.

    Parameters
    ----------
    mesh : TriangleMesh
    n_shares : int
        The number n, at least 1.

    Returns
    -------
    (c,) int
        Vertices, ascending; empty if the mesh is connected.
    """
    count, labels = vertex_components(mesh)
    require_simplices_everywhere(mesh)
    face_areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    areas = np.bincount(labels[mesh.faces[:, 0]], weights=face_areas, minlength=count)
    if count == 1 or not areas.any():
        return np.empty(0, dtype=np.int64)
    small = n_shares * areas < areas.sum()
    if areas[~small].sum() < LEAST_SHARE_KEPT * areas.sum():
        sizes = np.round(areas / areas.max(), EQUAL_DIGITS)
        largest = np.argsort(-sizes, kind="stable")[:n_shares]
        small = np.isin(np.arange(count), largest, invert=True)
    return np.flatnonzero(small[labels])
