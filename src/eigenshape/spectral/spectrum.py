"""A spectrum and the proof that nothing is missing from it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape.spectral.archive import read_archive, write_archive
from eigenshape.spectral.certificate import Certificate


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The k lowest eigenpairs of a Laplacian, or those of an interval, with their proof.

    Attributes
    ----------
    eigenvalues : (k,) float
        λ ≥ 0 in ascending order, in 1/length².
    eigenvectors : (n, k) float
        Φ with ΦᵀBΦ = I. The entry of largest size in a column is positive (the first one, where several come within
        1e-6 of it), so the same input gives the same columns.
    mass : (n, n) sparse
        B of the operator.
    residuals : (k,) float
        |λ - true eigenvalue| is at most this, in 1/length²: the norm of W φ - λ B φ in B⁻¹, or a bound of it.
    certificate : Certificate
    """

    eigenvalues: Float[np.ndarray, " k"]
    eigenvectors: Float[np.ndarray, "n k"]
    mass: sp.csr_array
    residuals: Float[np.ndarray, " k"]
    certificate: Certificate

    def save(self, path: str | Path, *, key: str | None = None) -> None:
        """Write the spectrum to a .npz file, whole or not at all; `load` reads it again to the last digit.

        Parameters
        ----------
        path : str or Path
        key : str, optional
            What tells this spectrum from others, such as a hash of the mesh; `load` can require it.

        Raises
        ------
        OSError
            If the system cannot write there.
        """
        arrays = {
            "eigenvalues": self.eigenvalues,
            "eigenvectors": self.eigenvectors,
            "residuals": self.residuals,
        }
        write_archive(path, arrays, self.mass, self.certificate, key)

    @classmethod
    def load(cls, path: str | Path, *, key: str | None = None) -> "Spectrum":
        """Read a spectrum that `save` wrote; no code in a file is ever run.

        Parameters
        ----------
        path : str or Path
        key : str, optional
            The one that it must have been saved with; by default any.

        Raises
        ------
        OSError
            If the system cannot read it.
        FileFormatError
            If it is no such file, is cut off, its parts do not fit one another, it holds what no spectrum holds
            (numbers that are not finite, eigenvalues that descend or are negative), or its key is another.
        """
        parts = read_archive(path, key)
        arrays = {
            name: frozen(parts[name]) for name in ("eigenvalues", "eigenvectors", "residuals")
        }
        return cls(**arrays, mass=parts["mass"], certificate=parts["certificate"])


def require_lowest(spectrum: Spectrum, name: str) -> None:
    """Refuse the spectrum of an interval.

    Raises
    ------
    InvalidParameterError
        If it does not begin with number 0.
    """
    if spectrum.certificate.first:
        raise InvalidParameterError(
            f"{name} must begin with the lowest eigenvalue; it begins with number {spectrum.certificate.first}."
        )
