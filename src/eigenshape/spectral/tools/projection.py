"""Coefficients of functions in eigenvectors, and functions from coefficients (thesis 1.2.3)."""

from typing import Literal

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import point_functions, real_numbers, require_finite_rows
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.spectrum import Spectrum

InnerProduct = Literal["mass", "plain"]


@one_blas_thread()
def project(
    values: ArrayLike, spectrum: Spectrum, inner_product: InnerProduct = "mass"
) -> Float[np.ndarray, "k ..."]:
    """Compute the coefficients of functions in the eigenvectors of a spectrum.

    In the mass inner product they are c = ΦᵀB x (thesis 1.2.3), and Parseval's identity reads
    cᵀc = xᵀB x for every x in the span of Φ. In the plain dot product the eigenvectors are not
    orthonormal, so the coefficients of the closest combination are c = (ΦᵀΦ)⁻¹Φᵀ x. This is the
    projection of chapter 6 (`eigen_skeleton`). Every point counts the same in it, however small
    its mass.

    Parameters
    ----------
    values : (n,) or (n, q) float
        One or q functions, such as the three coordinates of the points.
    spectrum : Spectrum
        k eigenpairs on n points: the lowest ones, or those of an interval.
    inner_product : {"mass", "plain"}
        Whose norm of the error of `reconstruct` is minimized.

    Returns
    -------
    (k,) or (k, q) float
        In the unit of the values times length^(m/2) for shapes of dimension m, because
        eigenvectors have unit norm in B.

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one finite number per point, or `inner_product` is neither of the
        two.

    See Also
    --------
    reconstruct : Compute functions from coefficients.
    filter_values : Project, multiply by a function of the eigenvalues, and reconstruct.

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 4)
    >>> coefficients = es.spectral.project(mesh.vertices, spectrum)
    >>> coefficients.shape
    (4, 3)

    A sphere is reconstructed from its constant and its first three functions:

    >>> found = es.spectral.reconstruct(coefficients, spectrum)
    >>> bool(abs(found - mesh.vertices).max() < 0.01)
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    modes = spectrum.eigenvectors
    functions = point_functions(values, "values", len(modes))
    if inner_product == "mass":
        return np.asarray(modes.T @ (spectrum.mass @ functions))
    if inner_product != "plain":
        raise InvalidParameterError(
            f'inner_product must be "mass" or "plain"; it is {inner_product!r}.'
        )
    orthonormal, triangle = sl.qr(modes, mode="economic")
    return np.asarray(sl.solve_triangular(triangle, orthonormal.T @ functions))


@one_blas_thread()
def reconstruct(coefficients: ArrayLike, spectrum: Spectrum) -> Float[np.ndarray, "n ..."]:
    """Compute functions from their coefficients in the first eigenvectors of a spectrum.

    x = Σ_i c_i φ_i (thesis 1.2.3). Pass fewer coefficients than there are eigenvectors to keep only
    the lowest frequencies; with coefficients in the mass inner product this is the closest
    combination of as many eigenvectors.

    Parameters
    ----------
    coefficients : (j,) or (j, q) float
        Of one or q functions, j ≤ k, as `project` returns them.
    spectrum : Spectrum
        k eigenpairs on n points.

    Returns
    -------
    (n,) or (n, q) float
        In the unit of the function that was projected.

    Raises
    ------
    InvalidParameterError
        If there are more coefficients than eigenvectors or none, or one is not finite.

    See Also
    --------
    project : Compute coefficients.

    Examples
    --------
    The coordinates of a torus from 20 of 50 modes:

    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 50)
    >>> coefficients = es.spectral.project(mesh.vertices, spectrum)
    >>> es.spectral.reconstruct(coefficients[:20], spectrum).shape
    (288, 3)
    """
    require_type(spectrum, Spectrum, "spectrum")
    weights = real_numbers(coefficients, "coefficients").astype(np.float64)
    k = len(spectrum.eigenvalues)
    if weights.ndim not in (1, 2) or not 1 <= len(weights) <= k:
        raise InvalidParameterError(
            f"coefficients must have one row per eigenvector, from 1 to {k}; the shape is "
            f"{weights.shape}. Compute more eigenpairs, or pass the first {k} rows."
        )
    require_finite_rows(weights, "coefficients", "eigenvector")
    return np.asarray(spectrum.eigenvectors[:, : len(weights)] @ weights)
