"""Average geodesic distance: how far the rest of a surface is."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidShapeError
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.geodesic import farthest_points
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import vertex_components

N_BASES = 150


@one_blas_thread()
def average_geodesic_distance(
    mesh: MeshLike, *, n_bases: SupportsIndex = N_BASES
) -> Float[np.ndarray, " n"]:
    """Measure for each vertex the mean geodesic distance to all points of the surface.

    a(x) = ∫ g(x, y) dy / area ≈ Σ_b g(x, b) A_b / area over bases b (Hilaga, Shinagawa, Kohmura and Kunii 2001, who
    take about 150 and leave out the division by the area; thesis 5.4 compares its maxima as feature points). Bases are
    farthest points, the first that farthest from vertex 0, and A_b is the area of the vertices nearest to b. With all
    vertices as bases the sum is that over the mesh's vertices, with no sampling.

    Parameters
    ----------
    mesh : MeshLike
        In one piece.
    n_bases : int
        At least 1; at most n are used. A distance from one base to all vertices takes about as long as sorting them.

    Returns
    -------
    (n,) float
        In length: a shape β times as large has β times the values.

    Raises
    ------
    InvalidShapeError
        If the mesh has several components, between which there is no way, a vertex without face or a face twice.
    """
    mesh = as_mesh(mesh)
    count = min(whole_number(n_bases, "n_bases", 1), mesh.n_vertices)
    require_describable(mesh)
    pieces, _ = vertex_components(mesh)
    if pieces > 1:
        raise InvalidShapeError(
            f"Average distances need one piece; the mesh has {pieces} components. Repair with largest_component."
        )
    _, rows, nearest = farthest_points(mesh, count)
    areas = dual_volumes(mesh)
    shares = np.bincount(nearest, weights=areas / areas.sum(), minlength=count)
    return shares @ rows
