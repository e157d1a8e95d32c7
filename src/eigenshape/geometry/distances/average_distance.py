"""The average geodesic distance: how far each vertex is from the rest of the surface."""

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidShapeError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import farthest_points
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import vertex_components

# Base points of the sum over the surface: about as many as Hilaga and others (2001) take. Time and
# memory grow with this number.
N_BASES = 150


@one_blas_thread()
def average_geodesic_distance(
    mesh: MeshLike, *, n_bases: Integer = N_BASES
) -> Float[np.ndarray, " n"]:
    """Compute the mean geodesic distance from each vertex to all points of the surface.

    The mean a(x) = ∫ g(x, y) dy / area is approximated by Σ_b g(x, b) A_b / area over base points
    b, where A_b is the area of the vertices whose nearest base point is b [1]_. The base points are
    farthest points; the first is the vertex farthest from vertex 0. If every vertex is a base
    point, the sum runs over all vertices of the mesh.

    Parameters
    ----------
    mesh : MeshLike
        A connected surface.
    n_bases : int
        Number of base points, at least 1; at most n are used. Each base point costs one geodesic
        wave over the whole mesh.

    Returns
    -------
    (n,) float
        Mean distance of each vertex, in length.

    Raises
    ------
    InvalidShapeError
        If the mesh has several components, a vertex without a face, or a face twice.
    InvalidParameterError
        If `n_bases` is less than 1.

    See Also
    --------
    geodesic_distances : Distances from given vertices.
    farthest_points : The choice of base points.

    Notes
    -----
    Hilaga and others leave out the division by the area. Section 5.4 of the thesis compares the
    maxima of this function as feature points.

    References
    ----------
    .. [1] M. Hilaga, Y. Shinagawa, T. Kohmura and T. L. Kunii, "Topology matching for fully
       automatic similarity estimation of 3D shapes", SIGGRAPH 2001.

    Examples
    --------
    On the unit sphere the mean distance is π/2 at every point.

    >>> import eigenshape as es
    >>> distances = es.geometry.average_geodesic_distance(es.icosphere(3))
    >>> bool(abs(distances - 3.14159 / 2).max() < 0.02)
    True
    """
    mesh = as_mesh(mesh)
    count = min(whole_number(n_bases, "n_bases", 1), mesh.n_vertices)
    require_describable(mesh)
    n_components, _ = vertex_components(mesh)
    if n_components > 1:
        raise InvalidShapeError(
            "A mesh must be connected to have average distances; "
            f"this one has {n_components} components. "
            'Try repair(mesh, ["largest_component"]).'
        )
    _, distances, nearest = farthest_points(mesh, count)
    areas = dual_volumes(mesh)
    shares = np.bincount(nearest, weights=areas / areas.sum(), minlength=count)
    return shares @ distances
