"""Gaussian curvature of a mesh by the angles around its vertices."""

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes, scaled_corners
from eigenshape.geometry.topology import edge_table


def face_angles(mesh: TriangleMesh) -> Float[np.ndarray, "f 3"]:
    """Return the angle at each corner of each face, in radians."""
    corners, _ = scaled_corners(mesh)
    one, two = (np.roll(corners, -turn, axis=1) - corners for turn in (1, 2))
    sines = np.linalg.norm(np.cross(one, two), axis=2)
    return np.arctan2(sines, np.einsum("fij,fij->fi", one, two))


def angle_defects(mesh: TriangleMesh) -> Float[np.ndarray, " n"]:
    """Return at each vertex what its angles lack of a full turn; of half a turn on a boundary, which turns by the rest.

    K_i = 2π - Σ θ - (π/2) Σ (2 - faces at the edge), over the angles and the edges at the vertex. The last sum is π on
    a boundary, 2π where a boundary passes twice. The sum over all vertices is 2π times the Euler characteristic
    (Gauss-Bonnet), on any mesh.
    """
    table = edge_table(mesh)
    n, at_edges = mesh.n_vertices, np.repeat(2.0 - table.n_faces, 2)
    turned = np.bincount(mesh.faces.ravel(), weights=face_angles(mesh).ravel(), minlength=n)
    return (
        2 * np.pi
        - turned
        - np.pi / 2 * np.bincount(table.edges.ravel(), weights=at_edges, minlength=n)
    )


def gaussian_curvature(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Measure the Gaussian curvature at each vertex: the angle defect over the area around it.

    K_i / A_i with A_i a third of the faces' area (Meyer, Desbrun, Schröder and Barr 2003, with that area; thesis 5.4
    compares its extrema as feature points). On a boundary the defect is the turn of the boundary within the surface,
    so the value there is not that of a curvature inside; its sum with the areas is right. Pointwise it converges on
    regular meshes, where six faces meet; elsewhere a share of the error stays.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    (n,) float
        In 1/length². Its sum with `dual_volumes` is 2π times the Euler characteristic.

    Raises
    ------
    InvalidShapeError
        If a face has no area or is there twice, a vertex has no face, or floats cannot hold areas.
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    return angle_defects(mesh) / dual_volumes(mesh)
