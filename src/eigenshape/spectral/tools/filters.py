"""Coefficients of functions in eigenvectors, and filters, which weaken or strengthen them (thesis 1.2.3)."""

from collections.abc import Callable
from typing import Literal

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from certeig.kit.arguments import describe_value, require_choice, require_type
from certeig.kit.arrays import real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions, require_finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import is_closed
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
    require_choice(inner_product, InnerProduct, "inner_product")
    if inner_product == "mass":
        return modes.T @ (spectrum.mass @ functions)
    orthonormal, triangle = sl.qr(modes, mode="economic")
    return sl.solve_triangular(triangle, orthonormal.T @ functions)


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
    return spectrum.eigenvectors[:, : len(weights)] @ weights


# A filter: the factor of each frequency, as a function of the eigenvalues.
Response = Callable[[Float[np.ndarray, " k"]], Float[np.ndarray, " k"]]
# Share of the volume of a shape that must be left for the rest to be restored by scaling. Below it
# the result would be a speck blown up, of which rounding is the largest part.
LEAST_VOLUME = 1e-6


@one_blas_thread()
def filter_values(
    values: ArrayLike, spectrum: Spectrum, response: Response, *, keep_rest: bool = False
) -> Float[np.ndarray, "n ..."]:
    """Multiply each frequency of a function by a factor.

    The result is Σ_i r(λ_i) c_i φ_i with c = ΦᵀB x the coefficients of the function (Taubin 1995;
    Vallet and Lévy 2008).

    Parameters
    ----------
    values : (n,) or (n, q) float
        One or q functions.
    spectrum : Spectrum
        k eigenpairs on n points.
    response : callable
        r: takes the (k,) eigenvalues, in 1/length², and returns (k,) factors, or True for what is
        kept. A low-pass filter is lambda values: values <= cutoff, and the flow of heat for a time
        t is lambda values: np.exp(-t * values). On a surface of area A about A·cutoff/4π
        eigenvalues lie below a cutoff (Weyl's law).
    keep_rest : bool
        What lies outside the k eigenvectors is removed by default. If True it is kept as it is, so
        that a filter can change low frequencies without loss of detail.

    Returns
    -------
    (n,) or (n, q) float
        In the unit of the values.

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one finite number per point, or the response cannot be called or
        is not one finite factor per eigenvalue.

    See Also
    --------
    smooth_mesh : Filter the coordinates of a mesh.

    Examples
    --------
    Remove all but the slow part of noise on a sphere:

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)
    >>> noise = np.random.default_rng(0).standard_normal(mesh.n_vertices)
    >>> slow = es.spectral.filter_values(noise, spectrum, lambda values: values <= 12.5)
    >>> bool(np.ptp(slow) < np.ptp(noise) / 3)
    True

    Weaken all frequencies alike, by a filter of one's own:

    >>> half = es.spectral.filter_values(
    ...     noise, spectrum, lambda eigenvalues: 0.5 + 0 * eigenvalues, keep_rest=True
    ... )
    """
    require_type(spectrum, Spectrum, "spectrum")
    functions = point_functions(values, "values", len(spectrum.eigenvectors))
    if not callable(response):
        raise InvalidParameterError(
            "response must be a function of the eigenvalues, such as lambda values: values <= cutoff; "
            f"it is {describe_value(response)}."
        )
    frequencies = spectrum.eigenvalues
    factors = real_numbers(response(frequencies), "The factors of a filter").astype(np.float64)
    if factors.shape != frequencies.shape:
        raise InvalidParameterError(
            f"A filter must return one factor per eigenvalue, shape {frequencies.shape}; the shape "
            f"is {factors.shape}."
        )
    require_finite_rows(factors, "The factors of a filter", "eigenvalue")
    change = factors - 1 if keep_rest else factors
    coefficients = project(functions, spectrum)
    # A column for each function, or none: the transposes let one line serve both.
    filtered = reconstruct((change * coefficients.T).T, spectrum)
    return functions + filtered if keep_rest else filtered


def smooth_mesh(
    mesh: MeshLike,
    spectrum: Spectrum,
    response: Response,
    *,
    keep_volume: bool = False,
    keep_rest: bool = False,
) -> TriangleMesh:
    """Filter the coordinates of a mesh, as functions on it.

    Low-pass and heat filters remove detail first, and then shrink the shape: limbs most. With
    `keep_volume` the result is scaled about its centroid until it encloses the volume of the mesh
    again (Desbrun, Meyer, Schröder and Barr 1999, section 2.4).

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    spectrum : Spectrum
        k eigenpairs on the n vertices, from the lowest on.
    response : callable
        Factors as a function of the eigenvalues, as in `filter_values`.
    keep_volume : bool
        Whether to scale the result to the volume of the mesh, which must be closed.
    keep_rest : bool
        Whether to keep what lies outside the k eigenvectors, as in `filter_values`.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        If the spectrum is of another number of points, or the response is not one finite factor per
        eigenvalue.
    InvalidShapeError
        If the volume is to be kept and the mesh is open, its faces are not turned alike, or the
        filter leaves no volume to scale.

    See Also
    --------
    es.operators.denoise : Remove noise by one step of heat flow, without a spectrum.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=500)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)
    >>> smooth = es.spectral.smooth_mesh(
    ...     mesh, spectrum, lambda values: values <= 20.0, keep_volume=True
    ... )
    >>> volumes = [es.geometry.enclosed_volume(each) for each in (mesh, smooth)]
    >>> bool(abs(volumes[1] / volumes[0] - 1) < 1e-12)
    True
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    if keep_volume and not is_closed(mesh):
        raise InvalidShapeError(
            "A mesh must be closed for its volume to be kept; this one has a boundary. Pass "
            "keep_volume=False, or close it by repair(mesh, ['fill_holes'])."
        )
    # Coordinates of size 1, so that volumes neither overflow nor vanish.
    points, scale = size_one(mesh.vertices)
    filtered = filter_values(points, spectrum, response, keep_rest=keep_rest)
    if keep_volume:
        before, after = (
            enclosed_volume(TriangleMesh(each, mesh.faces)) for each in (points, filtered)
        )
        if before == 0 or after / before < LEAST_VOLUME:
            raise InvalidShapeError(
                "A filter must leave some of the volume for the rest to be restored; the volume "
                f"was {before * scale**3:.3g} and is {after * scale**3:.3g} length³. "
                "Use a shorter time or a higher cutoff, or pass keep_volume=False."
            )
        areas = spectrum.mass.sum(axis=1)
        center = areas @ filtered / areas.sum()
        filtered = center + (before / after) ** (1 / 3) * (filtered - center)
    return TriangleMesh(filtered * scale, mesh.faces)
