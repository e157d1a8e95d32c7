"""Diffusion that depends on the direction."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_choice
from certeig.kit.errors import InvalidParameterError
from eigenshape._corners import scaled_corners, triangular_sides
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.measure import surface_area, vertex_normals
from eigenshape.geometry.requirements import require_sound, require_volumes, warn_of_seams
from eigenshape.operators import elements
from eigenshape.operators.choices import Mass
from eigenshape.operators.cotangent import linear_laplacian
from eigenshape.operators.laplacian import Laplacian

# Asymmetry and negative eigenvalues up to this share of the largest entry count as rounding.
TENSOR_ROUNDING = 1e-12


def anisotropic_laplacian(
    mesh: MeshLike, tensors: Float[np.ndarray, "s d d"], mass: Mass = "lumped"
) -> Laplacian:
    """Build the Laplacian -div(D grad) of linear elements, with one conductivity tensor per simplex.

    The energy of W is Σ V ∇fᵀD∇f. With the identity everywhere it is the cotangent Laplacian.

    Parameters
    ----------
    mesh : MeshLike
    tensors : (s, d, d) float
        Symmetric, positive semidefinite, without unit. Only the part along the simplex matters.
    mass : {"lumped", "consistent", "averaged"}
        As in `cotangent_laplacian`.

    Returns
    -------
    Laplacian

    Raises
    ------
    InvalidParameterError
        If a tensor is not finite, not symmetric or has a negative eigenvalue, or their number is
        not that of the simplices.
    InvalidShapeError
        As in `cotangent_laplacian`.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=500)
    >>> tensors = es.operators.curvature_tensors(mesh, 2.0)
    >>> es.operators.anisotropic_laplacian(mesh, tensors).n_points == mesh.n_vertices
    True
    """
    mesh = as_simplicial(mesh)
    require_choice(mass, Mass, "mass")
    wanted = (len(mesh.simplices), *(mesh.points.shape[1],) * 2)
    if tensors.shape != wanted:
        raise InvalidParameterError(
            f"tensors must have shape {wanted}; the shape is {tensors.shape}."
        )
    noun = "face" if mesh.dim == 2 else "simplex"
    bad = np.flatnonzero(~np.isfinite(tensors).all(axis=(1, 2)))
    if bad.size:
        raise InvalidParameterError(
            f"tensors must be finite; that of {noun} {bad[0]} is {tensors[bad[0]].tolist()} ({bad.size} such)."
        )
    allowed = TENSOR_ROUNDING * np.abs(tensors).max(axis=(1, 2))
    bad = np.flatnonzero(np.abs(tensors - tensors.transpose(0, 2, 1)).max(axis=(1, 2)) > allowed)
    if bad.size:
        raise InvalidParameterError(
            f"tensors must be symmetric; that of {noun} {bad[0]} is {tensors[bad[0]].tolist()} ({bad.size} such)."
        )
    lowest = np.linalg.eigvalsh(tensors)[:, 0]
    bad = np.flatnonzero(lowest < -allowed)
    if bad.size:
        raise InvalidParameterError(
            f"tensors must be positive semidefinite; that of {noun} {bad[0]} has the eigenvalue {lowest[bad[0]]:.6g} "
            f"({bad.size} such)."
        )
    require_sound(mesh)
    warn_of_seams(mesh)
    return linear_laplacian(mesh, elements.gradient_products(mesh, tensors), mass)


def curvature_tensors(
    mesh: MeshLike, alpha: float, *, concave: bool = False
) -> Float[np.ndarray, "f 3 3"]:
    """Compute tensors that reduce diffusion across bends (Andreux, Rodolà, Aubry, Cremers 2014).

    Along each principal direction of a face the conductivity is 1 / (1 + α |κ| √area), with κ the
    principal curvature from the vertex normals and the area of the whole surface. It is without
    unit, and 1 at α = 0.

    Parameters
    ----------
    mesh : MeshLike
        With consistently oriented faces.
    alpha : float
        At least 0.
    concave : bool
        Whether only concave bends count, on a surface whose faces are counter-clockwise seen from
        outside. People divide objects into parts along such creases (the minima rule of Hoffman and
        Richards 1984).

    Returns
    -------
    (f, 3, 3) float
        Symmetric, positive semidefinite, zero along the normal of the face.

    Raises
    ------
    InvalidParameterError
        If alpha is negative or not finite.
    InvalidShapeError
        If a face has no area, or neighboring faces have opposite orientations.

    Examples
    --------
    On a plane the tensors are projections on the plane:

    >>> import eigenshape as es
    >>> es.operators.curvature_tensors(es.shapes.grid(1, 1), 5.0)[0].round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    """
    mesh = as_mesh(mesh)
    if not 0 <= alpha < np.inf:
        raise InvalidParameterError(f"alpha must be finite and not negative; it is {alpha}.")
    require_volumes(mesh)
    corners, scale = scaled_corners(mesh)
    basis, triangles = triangular_sides(corners)
    normals = vertex_normals(mesh)[mesh.faces]
    turned = basis.transpose(0, 2, 1) @ (normals[:, 1:] - normals[:, :1]).transpose(0, 2, 1)
    bending = turned @ np.linalg.inv(triangles)
    curvatures, directions = np.linalg.eigh((bending + bending.transpose(0, 2, 1)) / 2)
    bends = np.maximum(-curvatures, 0) if concave else np.abs(curvatures)
    conductivity = 1 / (1 + alpha * bends * (surface_area(mesh) ** 0.5 / scale))
    directions = basis @ directions
    return (directions * conductivity[:, None]) @ directions.transpose(0, 2, 1)
