"""The cotangent Laplacian: linear finite elements on simplices of any dimension."""

from typing import Literal

import scipy.sparse as sp

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements
from eigenshape.operators.laplacian import Laplacian

Mass = Literal["lumped", "consistent", "averaged"]


def cotangent_laplacian(mesh: MeshLike, mass: Mass = "lumped") -> Laplacian:
    """Build the linear finite-element Laplacian of a mesh of any dimension and codimension.

    w_ij = (cot α_ij + cot β_ij) / 2 on triangles, with the angles opposite to the edge (thesis 1.1.2; Pinkall and
    Polthier 1993); in general w_ij = -Σ V ∇λ_i·∇λ_j over the simplices at the edge. On a boundary the missing terms
    vanish, which is the Neumann condition. An edge with more than two faces sums over all of them.

    Parameters
    ----------
    mesh : MeshLike
    mass : "lumped", "consistent" or "averaged"
        B: 1/(m+1) of the incident volumes on the diagonal; the full matrix ∫ φ_i φ_j, with the eigenvalues of
        conforming elements, which bound those of the surface from above; or the mean of the two, whose leading
        errors cancel.

    Returns
    -------
    Laplacian
        W in length^(m-2), B in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the corners of another, a point no simplex, or floats cannot hold
        lengths to these powers.
    InvalidParameterError
        If `mass` is none of the three.
    """
    mesh = as_simplicial(mesh)
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
