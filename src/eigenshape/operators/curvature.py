"""Mean curvature by the Laplacian of positions."""

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import unit_scaled, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import in_length
from eigenshape.operators.cotangent import cotangent_laplacian


def mean_curvature(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Measure the mean curvature at each vertex, the half sum of the principal ones.

    L x = 2 H N for positions x and the outer normal N (L is positive; Meyer, Desbrun, Schröder and Barr 2003, with the
    lumped mass): H = (L x)·N / 2, with N of `vertex_normals`. Positive where the surface bulges to the side that its
    faces are seen from counter-clockwise: 1/R on a sphere that faces outward. On a boundary L x holds the pull of the
    missing half, which lies in the surface and drops out with N as far as the boundary is straight.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    (n,) float
        In 1/length.

    Raises
    ------
    InvalidShapeError
        If a face has no area or is there twice, a vertex has no face, or neighboring faces are turned against each
        other.
    """
    mesh = as_mesh(mesh)
    points, scale = unit_scaled(mesh)
    operator = cotangent_laplacian(TriangleMesh(points, mesh.faces))
    pull = (operator.stiffness @ points) / operator.mass.diagonal()[:, None]
    return in_length(np.einsum("ij,ij->i", pull, vertex_normals(mesh)) / 2, scale, -1)
