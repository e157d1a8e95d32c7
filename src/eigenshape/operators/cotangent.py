"""The cotangent Laplacian: linear finite elements on simplices of any dimension."""

import scipy.sparse as sp

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements
from eigenshape.operators.choices import Mass
from eigenshape.operators.laplacian import Laplacian

# Dimension in which the default mass is averaged: experiments/ch3_tetrahedra chose it.
TETRAHEDRA = 3


def cotangent_laplacian(mesh: MeshLike, mass: Mass | None = None) -> Laplacian:
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
        If `mass` is not one of the three.

    See Also
    --------
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
    require_mass(mass)
    require_sound(mesh)
    products = elements.gradient_products(mesh)
    return Laplacian(elements.stiffness(mesh.simplices, products, 1), linear_mass(mesh, mass))


def linear_mass(mesh: Mesh, mass: Mass) -> sp.csr_array:
    """Return B of linear elements."""
    lumped = sp.diags_array(dual_volumes(mesh)).tocsr()
    if mass == "lumped":
        return lumped
    full = elements.mass(mesh, mesh.simplices, 1)
    return full if mass == "consistent" else ((full + lumped) / 2).tocsr()


def require_mass(mass: str) -> None:
    """Refuse a mass of another name.

    Raises
    ------
    InvalidParameterError
    """
    if mass not in ("lumped", "consistent", "averaged"):
        raise InvalidParameterError(
            f"mass must be 'lumped', 'consistent' or 'averaged'; it is {mass!r}."
        )
