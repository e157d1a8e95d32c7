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
    """Return the angle defect at each vertex: the full turn minus the angles of its faces.

    K_i = 2π - Σ θ - (π/2) Σ (2 - number of faces at the edge), with sums over the angles and the
    edges at the vertex. The last sum is 0 inside, π on a boundary and 2π where a boundary passes
    twice. The sum of all defects is 2π times the Euler characteristic (Gauss-Bonnet) on any mesh.
    """
    table = edge_table(mesh)
    n = mesh.n_vertices
    angles = np.bincount(mesh.faces.ravel(), weights=face_angles(mesh).ravel(), minlength=n)
    missing_faces = np.repeat(2.0 - table.n_faces, 2)
    missing = np.bincount(table.edges.ravel(), weights=missing_faces, minlength=n)
    return 2 * np.pi - angles - np.pi / 2 * missing


def gaussian_curvature(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Compute the Gaussian curvature at each vertex: its angle defect divided by its area.

    K_i / A_i with A_i a third of the area of the faces at the vertex (Meyer, Desbrun, Schröder and
    Barr 2003, with that area).

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    (n,) float
        Curvature of each vertex, in 1/length². The sum of the curvatures times `dual_volumes` is 2π
        times the Euler characteristic.

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or areas overflow.

    See Also
    --------
    dual_volumes : The areas A_i.

    Notes
    -----
    At a boundary vertex the defect measures the turn of the boundary within the surface, so the
    value is not comparable with the curvature inside. The values converge pointwise on regular
    meshes, where six faces meet at each vertex; on others a part of the error remains. Section 5.4
    of the thesis compares the extrema of this function as feature points.

    Examples
    --------
    The total curvature of a sphere is 4π.

    >>> import eigenshape as es
    >>> sphere = es.icosphere(2)
    >>> curvature = es.geometry.gaussian_curvature(sphere)
    >>> total = (curvature * es.geometry.dual_volumes(sphere)).sum()
    >>> bool(abs(total - 4 * 3.14159265) < 1e-6)
    True
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    return angle_defects(mesh) / dual_volumes(mesh)
