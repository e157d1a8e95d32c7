"""Mean curvature by the Laplacian of positions."""

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import scale_to_unit, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import in_length
from eigenshape.operators.cotangent import cotangent_laplacian


def mean_curvature(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Compute the mean curvature at each vertex, half the sum of the principal curvatures.

    L x = 2 H N for positions x and the outer normal N (L is positive; Meyer, Desbrun, Schröder and
    Barr 2003, with lumped mass): H = (L x)·N / 2, with N of `vertex_normals`. H is positive where
    the surface is convex seen from the side on which its faces are counter-clockwise: 1/R on a
    sphere that faces outward. On a boundary, L x includes the missing half of the neighborhood,
    which lies in the surface and so vanishes with N if the boundary is straight.

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
        If a face has no area or occurs twice, a vertex belongs to no face, or neighboring faces
        have opposite orientations.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.TriangleMesh(2 * es.icosphere(3).vertices, es.icosphere(3).faces)
    >>> es.operators.mean_curvature(ball).mean().round(2).item()
    0.5
    """
    mesh = as_mesh(mesh)
    points, scale = scale_to_unit(mesh)
    operator = cotangent_laplacian(TriangleMesh(points, mesh.faces))
    pull = (operator.stiffness @ points) / operator.mass.diagonal()[:, None]
    return in_length(np.einsum("ij,ij->i", pull, vertex_normals(mesh)) / 2, scale, -1)
