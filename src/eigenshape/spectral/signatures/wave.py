"""Wave kernel signatures: how often a particle of some energy is seen at a point."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_values, positive_values, whole_number
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.signatures.heat import positive_eigenvalues
from eigenshape.spectral.spectrum import Spectrum

N_ENERGIES = 100
SPREAD = 7.0  # standard deviations in steps between energies
MARGIN = 2.0  # standard deviations between the ends of the spectrum and the first and last energy


def default_energies(
    spectrum: Spectrum, n_energies: SupportsIndex = N_ENERGIES
) -> tuple[Float[np.ndarray, " q"], float]:
    """Return evenly spaced energies and the standard deviation that a spectrum suggests.

    From log λ_1 + 2σ to log λ_k - 2σ with σ = 7 steps, λ_1 the first eigenvalue above 0 (Aubry, Schlickewei and Cremers
    2011, 4).

    Parameters
    ----------
    spectrum : Spectrum
        With at least two different eigenvalues above 0.
    n_energies : int
        At least 2.

    Returns
    -------
    energies : (q,) float
        Logarithms of eigenvalues in 1/length^2: a shape β times as large has them 2 log β lower.
    sigma : float
        Without unit.

    Raises
    ------
    InvalidParameterError
        If there are fewer than 2 energies, or no two different eigenvalues above 0.
    """
    require_type(spectrum, Spectrum, "spectrum")
    count = whole_number(n_energies, "n_energies", 2)
    ends = np.log(positive_eigenvalues(spectrum)[[0, -1]])
    sigma = SPREAD * float(ends[1] - ends[0]) / (count - 1 + 2 * MARGIN * SPREAD)
    positive_values(sigma, "the range of logarithms of eigenvalues")
    return np.linspace(ends[0] + MARGIN * sigma, ends[1] - MARGIN * sigma, count), sigma


@one_blas_thread()
def wave_kernel_signature(
    spectrum: Spectrum, energies: ArrayLike | None = None, *, sigma: float | None = None
) -> Float[np.ndarray, "n q"]:
    """Measure the mean probability over time to meet a quantum particle of an energy at each point.

    w_e(x) = sum_i phi_i(x)^2 g(e - log lambda_i) / sum_i g(e - log lambda_i), g(d) = exp(-d^2 / 2 sigma^2), over the
    eigenvalues above 0 (Aubry, Schlickewei and Cremers 2011). Where heat is a low-pass filter, this is one of bands:
    w_e tells details of size exp(-e/2) alone. The sum over x of b_x w_e(x) is 1.

    Parameters
    ----------
    spectrum : Spectrum
    energies : (q,) float, optional
        Logarithms of eigenvalues in 1/length^2; those of `default_energies` otherwise.
    sigma : float, optional
        Standard deviation of the bands, > 0; that of `default_energies` otherwise.

    Returns
    -------
    (n, q) float
        In 1/length^dim. With default energies the product with the shape's measure does not depend on its size.

    Raises
    ------
    InvalidParameterError
        If an energy is not finite, sigma not positive, or the spectrum has no two different eigenvalues above 0.
    """
    require_type(spectrum, Spectrum, "spectrum")
    values = positive_eigenvalues(spectrum)
    if energies is None or sigma is None:
        suggested, spread = default_energies(spectrum)
        energies, sigma = (
            suggested if energies is None else energies,
            spread if sigma is None else sigma,
        )
    levels, width = finite_values(energies, "energies"), positive_values(sigma, "sigma")[0]
    exponents = -((np.log(values)[:, None] - levels) ** 2) / (2 * width**2)
    bands = np.exp(
        exponents - exponents.max(axis=0)
    )  # far from all eigenvalues the nearest counts, not 0 / 0
    return np.asarray(spectrum.eigenvectors[:, -len(values) :] ** 2 @ (bands / bands.sum(axis=0)))
