"""Average geodesic distance: how far the rest of a surface is."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.geodesic import waves_on
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import vertex_components

N_BASES = 150


def average_geodesic_distance(mesh: TriangleMesh, *, n_bases: SupportsIndex = N_BASES) -> Float[np.ndarray, " n"]:
    """Measure for each vertex the mean geodesic distance to all points of the surface.

    a(x) = ∫ g(x, y) dy / area ≈ Σ_b g(x, b) A_b / area over bases b (Hilaga, Shinagawa, Kohmura and Kunii 2001, who
    take about 150 and leave out the division by the area; thesis 5.4 compares its maxima as feature points). Bases are
    farthest points, the first that farthest from vertex 0, and A_b is the area of the vertices nearest to b. With all
    vertices as bases the sum is that over the mesh's vertices, with no sampling.

    Parameters
    ----------
    mesh : TriangleMesh
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
        If the mesh has several components, between which there is no way.
    """
    count = min(whole_number(n_bases, "n_bases", 1), mesh.n_vertices)
    pieces, _ = vertex_components(mesh)
    if pieces > 1:
        raise InvalidShapeError(
            f"Average distances need one piece; the mesh has {pieces} components. Repair with largest_component, or "
            "with weld where they touch."
        )
    rows, nearest, _ = from_farthest_points(mesh, count)
    areas = dual_volumes(mesh)
    shares = np.bincount(nearest, weights=areas / areas.sum(), minlength=count)
    return shares @ rows


def from_farthest_points(
    mesh: TriangleMesh, count: int
) -> tuple[Float[np.ndarray, "b n"], Int[np.ndarray, " n"], Int[np.ndarray, " b"]]:
    """Choose points far from each other, the first that farthest from vertex 0.

    Returns
    -------
    rows : (b, n) float
        Distance from each of them to each vertex, in length; infinite where there is no way.
    nearest : (n,) int
        Which of them is nearest to each vertex.
    bases : (b,) int
        Their vertices; another piece of the mesh is farther than all else.
    """
    wave = waves_on(mesh)
    bases = np.empty(count, dtype=np.int64)
    base = int(wave(0).argmax())
    rows = np.empty((count, mesh.n_vertices))
    least, nearest = np.full(mesh.n_vertices, np.inf), np.zeros(mesh.n_vertices, dtype=np.int64)
    for number in range(count):
        bases[number], rows[number] = base, wave(base)
        nearer = rows[number] < least
        least[nearer], nearest[nearer] = rows[number][nearer], number
        base = int(least.argmax())
    return rows, nearest, bases
