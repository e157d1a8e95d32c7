"""The cotangent Laplacian, linear finite elements in any dimension, and the mean curvature by it."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import positive_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._corners import in_length
from eigenshape._vectors import row_dots, scale_to_unit
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.measure import vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound, warn_of_seams
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements
from eigenshape.operators.choices import Mass
from eigenshape.operators.laplacian import Laplacian, with_mass_floor

# Dimension in which the default mass is averaged: experiments/ch3_tetrahedra chose it.
TETRAHEDRA = 3


def cotangent_laplacian(
    mesh: MeshLike, mass: Mass | None = None, *, conductivity: ArrayLike | None = None
) -> Laplacian:
    """Build the cotangent Laplacian: linear finite elements on a mesh of any dimension.

    On triangles w_ij = (cot α_ij + cot β_ij) / 2, with the angles opposite to the edge (thesis
    1.1.2; Pinkall and Polthier 1993). In general w_ij = -Σ V ∇λ_i·∇λ_j over the simplices at the
    edge. On a boundary the missing terms vanish, which is the Neumann condition. An edge may have
    more than two faces; the sum then includes all of them.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, tetrahedra, segments, or m-simplices in R^d.
    mass : {"lumped", "consistent", "averaged"}, optional
        "lumped": B is diagonal, 1/(m+1) of the volume of the incident simplices. "consistent": the
        full matrix ∫ φ_i φ_j; its eigenvalues are upper bounds for those of the surface.
        "averaged": the mean of the two, whose leading errors cancel. By default "averaged" for
        tetrahedra, which are rarely fine enough for another, and otherwise "lumped".
    conductivity : (n,) float, optional
        Positive numbers c at the points, linear on each simplex, without unit. The operator is then
        -div(c grad), as for a cortex whose heterogeneity is known. By default 1 everywhere.

    Returns
    -------
    Laplacian
        W in length^(m-2), B in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, a point belongs to no simplex, or
        coordinates are so large or small that floats cannot hold these powers of lengths.
    InvalidParameterError
        If `mass` is not one of the three, or `conductivity` not one positive number per point.

    See Also
    --------
    anisotropic_laplacian : One tensor per simplex.
    robust_laplacian : For slivers and non-manifold meshes.
    fem_laplacian : Elements of order 2 and 3.
    solve_spectrum : Compute eigenvalues and eigenvectors.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = es.shapes.grid(1, 1)
    >>> laplacian = es.cotangent_laplacian(square)
    >>> laplacian.stiffness.toarray().round(12).tolist()[0]
    [1.0, -0.5, -0.5, 0.0]
    >>> laplacian.mass.diagonal().sum().round(12).item()  # the area
    1.0
    """
    mesh = as_simplicial(mesh)
    mass = mass or ("averaged" if mesh.dim == TETRAHEDRA else "lumped")
    require_choice(mass, Mass, "mass")
    require_sound(mesh)
    warn_of_seams(mesh)
    products = elements.gradient_products(mesh)
    if conductivity is not None:
        values = positive_values(conductivity, "conductivity")
        if len(values) != mesh.n_points:
            raise InvalidParameterError(
                f"conductivity must hold one number per point, shape ({mesh.n_points},); the shape is "
                f"{values.shape}."
            )
        # Gradients are constant on a simplex, so the integral takes the mean.
        products = products * values[mesh.simplices].mean(axis=1)[:, None, None]
    return linear_laplacian(mesh, products, mass)


def surface_laplacian(mesh: TriangleMesh) -> Laplacian:
    """Return the cotangent Laplacian of a surface; of its seams a verb has warned already."""
    require_sound(mesh)
    return linear_laplacian(mesh, elements.gradient_products(mesh), "lumped")


def linear_laplacian(
    mesh: Mesh, products: Float[np.ndarray, "s corners corners"], mass: Mass
) -> Laplacian:
    """Return the Laplacian of linear elements, by the products of the gradients on each simplex."""
    laplacian = Laplacian(elements.stiffness(mesh.simplices, products, 1), linear_mass(mesh, mass))
    return with_mass_floor(laplacian, elements.mass_floor(mesh.dim, 1))


def linear_mass(mesh: Mesh, mass: Mass) -> sp.csr_array:
    """Return B of linear elements."""
    lumped = sp.diags_array(dual_volumes(mesh)).tocsr()
    if mass == "lumped":
        return lumped
    full = elements.mass(mesh, mesh.simplices, 1)
    return full if mass == "consistent" else ((full + lumped) / 2).tocsr()


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
    points, scale = scale_to_unit(mesh.vertices)
    operator = cotangent_laplacian(TriangleMesh(points, mesh.faces))
    pull = (operator.stiffness @ points) / operator.mass.diagonal()[:, None]
    return in_length(row_dots(pull, vertex_normals(mesh)) / 2, scale, -1)
