"""A spectrum, the proof that nothing is missing from it, and how fast its modes lose heat."""

from html import escape
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly, positive_values, record
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.spectral.archive import read_spectrum, write_spectrum
from eigenshape.spectral.certificate import Certificate

# An eigenvalue counts as 0 up to this share of the largest one, or up to this many times its own
# residual. The second says so where all known eigenvalues are small beside the rounding of W.
NULL = 1e-9
ZERO_RESIDUALS = 4
# Approximate pairs have residuals near the root of the error of their values, above eigenvalues
# that are not 0. There the residual counts only up to this share of the largest eigenvalue.
APPROXIMATE_NULL = 1e-6
MOST_DOTS = 200  # eigenvalues that the plot of a notebook shows


@record
class Spectrum(ReadOnly):
    """Eigenvalues and eigenvectors of a Laplacian, with the certificate that none is missing.

    These are the k lowest eigenpairs, or all eigenpairs in an interval.

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

    eigenvalues: Float[np.ndarray, " k"]
    eigenvectors: Float[np.ndarray, "n k"]
    mass: sp.csr_array
    residuals: Float[np.ndarray, " k"]
    certificate: Certificate

    def save(self, path: str | Path, *, key: str | None = None) -> None:
        """Write the spectrum to a .npz file; `load` reads it back bit for bit.

        The file is written completely or not at all.

        Parameters
        ----------
        path : str or Path
        key : str, optional
            A label, such as a hash of the mesh, that `load` can require.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_spectrum(path, vars(self), key)

    @classmethod
    def load(cls, path: str | Path, *, key: str | None = None) -> "Spectrum":
        """Read a spectrum from a file that `save` wrote. No code in the file is ever run.

        Parameters
        ----------
        path : str or Path
        key : str, optional
            The key with which the spectrum must have been saved. By default any key is accepted.

        Raises
        ------
        OSError
            If the file cannot be read.
        FileFormatError
            If the file is not a spectrum, is truncated, its parts do not fit together, its numbers
            are not finite, its eigenvalues are negative or not ascending, or its key differs.
        """
        return cls(**read_spectrum(path, key))

    def _portrait(self) -> str:
        """Return a plot of the eigenvalues, and what is proved of them, as HTML."""
        values = self.eigenvalues
        first = self.certificate.first
        shown = np.unique(np.linspace(0, len(values) - 1, MOST_DOTS).round().astype(np.int64))
        # In a box of 300 x 100 pixels, with a margin of 10: number to the right, eigenvalue up
        right = 10 + 300 * shown / max(len(values) - 1, 1)
        height = 110 - 100 * (values[shown] / (values[-1] or 1.0))
        dots = "".join(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2"/>' for x, y in zip(right, height, strict=True)
        )
        plot = (
            '<svg width="320" height="120" fill="currentColor" role="img" '
            f'aria-label="Eigenvalues by their numbers">{dots}</svg>'
        )
        last = first + len(values) - 1
        ends = f"eigenvalues {first} to {last}: {values[0]:.4g} to {values[-1]:.4g} (1/length²)"
        return f"{plot}<p>{ends}</p><p>{escape(self.certificate.explain())}</p>"


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
