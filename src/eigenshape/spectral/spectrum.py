"""A spectrum of a shape."""

import numpy as np
from jaxtyping import Float

import certeig
from certeig.kit.arrays import record
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

    @property
    def point_areas(self) -> Float[np.ndarray, " n"]:
        """Area around each point, (n,) in length^m: the row sums of B."""
        return self.mass.sum(axis=1)

    @property
    def n_zero_modes(self) -> int:
        """Number of the first eigenvalues that count as 0: one for each component of a shape."""
        values = self.eigenvalues
        rounding = ZERO_RESIDUALS * self.residuals
        if self.certificate.count is None:
            rounding = np.minimum(rounding, APPROXIMATE_NULL * values[-1])
        zero = values <= np.maximum(NULL * values[-1], rounding)
        return len(values) if zero.all() else int(np.argmin(zero))
