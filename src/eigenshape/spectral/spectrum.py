"""A spectrum of a shape, and how fast its modes lose heat."""

import numpy as np
from jaxtyping import Float

import certeig
from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from certeig.spectrum import ZERO_RESIDUALS
from eigenshape.spectral.certificate import Certificate

# An eigenvalue counts as 0 up to this share of the largest one, or up to some multiple of its own
# residual, which says so where all known eigenvalues are small beside the rounding of W.
NULL = 1e-9
# Approximate pairs have residuals near the root of the error of their values, above eigenvalues
# that are not 0. There the residual counts only up to this share of the largest eigenvalue.
APPROXIMATE_NULL = 1e-6


@record
class Spectrum(certeig.Spectrum):
    """Eigenvalues and eigenvectors of a Laplacian, with the certificate that none is missing.

    These are the k lowest eigenpairs, or all eigenpairs in an interval. `save` writes them to a
    file, and `load` reads them.

    Attributes
    ----------
    eigenvalues : (k,) float
        λ ≥ 0 in ascending order, in 1/length².
    eigenvectors : (n, k) float
        Φ with ΦᵀBΦ = I. In each column the entry of largest absolute value is positive (the first
        one, if several agree to 1e-6), so the same input gives the same columns.
    mass : (n, n) sparse
        B of the operator.
    residuals : (k,) float
        Bounds of the errors of the eigenvalues, in 1/length²: the norm of W φ - λ B φ in B⁻¹, or an
        upper bound of it.
    certificate : Certificate
        What is proved of the eigenvalues. `certificate.explain()` says it in words.

    See Also
    --------
    solve_spectrum : Compute a spectrum.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    >>> spectrum.eigenvectors.shape
    (162, 9)
    >>> gram = spectrum.eigenvectors.T @ spectrum.mass @ spectrum.eigenvectors
    >>> bool(abs(gram - [[i == j for j in range(9)] for i in range(9)]).max() < 1e-10)
    True
    >>> print(spectrum.certificate.explain()[:56])
    These are the 9 lowest eigenvalues of the operator: none
    """

    certificate: Certificate

    _certificate_class = Certificate
    maker = "eigenshape"
    least = 0.0


def count_zero_modes(spectrum: Spectrum) -> int:
    """Return how many of the first eigenvalues count as 0: one for each component of a shape."""
    values = spectrum.eigenvalues
    rounding = ZERO_RESIDUALS * spectrum.residuals
    if spectrum.certificate.count is None:
        rounding = np.minimum(rounding, APPROXIMATE_NULL * values[-1])
    zero = values <= np.maximum(NULL * values[-1], rounding)
    return len(values) if zero.all() else int(np.argmin(zero))


def require_lowest(spectrum: Spectrum, name: str) -> None:
    """Raise an error for what is no spectrum, or does not begin with the lowest eigenvalue."""
    require_type(spectrum, Spectrum, name)
    if spectrum.certificate.first:
        raise InvalidParameterError(
            f"{name} must begin with the lowest eigenvalue; it begins with number "
            f"{spectrum.certificate.first}. Use solve_spectrum without above."
        )


def exponential_decay(
    eigenvalues: Float[np.ndarray, " k"], times: ArrayLike
) -> Float[np.ndarray, "k q"]:
    """Return exp(-t λ_i) for each eigenvalue and each time, without any check."""
    return np.exp(-np.outer(eigenvalues, np.asarray(times)))


def decay_factors(
    spectrum: Spectrum, times: ArrayLike, name: str = "times"
) -> Float[np.ndarray, "k q"]:
    """Return exp(-t λ_i), the share of eigenfunction i that is left after each time t.

    `name` is what messages call the times.

    Raises an InvalidParameterError if a time is not positive and finite, or the spectrum does not
    begin with the lowest eigenvalue.
    """
    require_lowest(spectrum, "spectrum")
    return exponential_decay(spectrum.eigenvalues, positive_values(times, name))
