"""Eigenpairs, and the proof that nothing is missing from them."""

from html import escape
from pathlib import Path
from typing import TypeVar

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from certeig.archive import read_spectrum, write_spectrum
from certeig.certificate import Certificate
from certeig.kit.arrays import ReadOnly, record

ZERO_RESIDUALS = 4  # an eigenvalue counts as 0 up to this many times its own residual
MOST_DOTS = 200  # eigenvalues that the plot of a notebook shows

AnySpectrum = TypeVar("AnySpectrum", bound="Spectrum")


@record
class Spectrum(ReadOnly):
    """Eigenpairs of W φ = λ B φ, with the certificate that none is missing.

    These are the k lowest eigenpairs, or all eigenpairs in an interval.

    Attributes
    ----------
    eigenvalues : (k,) float
        λ in ascending order, of W and B as they were given.
    eigenvectors : (n, k) float
        Φ with ΦᵀBΦ = I. In each column the entry of largest absolute value is positive (the first
        one, if several agree to 1e-6), so the same input gives the same columns.
    mass : (n, n) sparse
        B.
    residuals : (k,) float
        Bounds of the errors of the eigenvalues: the norm of W φ - λ B φ in B⁻¹, or an upper bound
        of it.
    certificate : Certificate
        What is proved of the eigenvalues. `certificate.explain()` says it in words.

    See Also
    --------
    eigenpairs : Compute a spectrum.

    Examples
    --------
    >>> import certeig
    >>> from scipy.sparse import diags_array
    >>> chain = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(9, 9))
    >>> spectrum = certeig.eigenpairs(chain, k=2)
    >>> spectrum.eigenvectors.shape
    (9, 2)
    >>> print(spectrum.certificate.explain()[:57])
    These are the 2 lowest eigenvalues of the pencil: none is
    """

    eigenvalues: Float[np.ndarray, " k"]
    eigenvectors: Float[np.ndarray, "n k"]
    mass: sp.csr_array
    residuals: Float[np.ndarray, " k"]
    certificate: Certificate

    _certificate_class = Certificate  # of `load`
    maker = "certeig"  # what files say
    least = -np.inf  # what files may hold

    def save(self, path: str | Path, *, key: str | None = None) -> None:
        """Write the spectrum to a .npz file; `load` reads it back bit for bit.

        The file is written completely or not at all.

        Parameters
        ----------
        path : str or Path
        key : str, optional
            A label, such as a hash of the input, that `load` can require.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_spectrum(path, vars(self), key, self.maker)

    @classmethod
    def load(cls: type[AnySpectrum], path: str | Path, *, key: str | None = None) -> AnySpectrum:
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
            are not finite, its eigenvalues are not ascending, or its key differs.
        """
        return cls(**read_spectrum(path, key, cls._certificate_class, cls.maker, cls.least))

    def _portrait(self) -> str:
        """Return a plot of the eigenvalues, and what is proved of them, as HTML."""
        values = self.eigenvalues
        first = self.certificate.first
        shown = np.unique(np.linspace(0, len(values) - 1, MOST_DOTS).round().astype(np.int64))
        # In a box of 300 x 100 pixels, with a margin of 10: number to the right, eigenvalue up
        right = 10 + 300 * shown / max(len(values) - 1, 1)
        low = min(values[0], 0.0)
        span = max(values[-1], 0.0) - low
        height = 110 - 100 * ((values[shown] - low) / (span or 1.0))
        dots = "".join(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2"/>' for x, y in zip(right, height, strict=True)
        )
        plot = (
            '<svg width="320" height="120" fill="currentColor" role="img" '
            f'aria-label="Eigenvalues by their numbers">{dots}</svg>'
        )
        last = first + len(values) - 1
        units = self.certificate.units
        ends = f"eigenvalues {first} to {last}: {values[0]:.4g} to {values[-1]:.4g}{units}"
        return f"{plot}<p>{ends}</p><p>{escape(self.certificate.explain())}</p>"
