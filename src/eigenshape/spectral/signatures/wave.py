"""Wave kernel signatures: the probability to find a particle of some energy at a point."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import finite_values, positive_number, positive_values, whole_number
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.spectral.signatures.heat import positive_eigenvalues
from eigenshape.spectral.spectrum import Spectrum

# All three from Aubry, Schlickewei and Cremers 2011, section 4.
N_ENERGIES = 100
MOST_ENERGIES = 1_000_000  # a signature holds each for each point
BAND_STEPS = 7.0  # standard deviation of the bands, in steps between energies
# Distance of the first and last energy from the ends of the spectrum, in σ.
MARGIN = 2.0


def default_energies(
    spectrum: Spectrum, n_energies: Integer = N_ENERGIES
) -> tuple[Float[np.ndarray, " q"], float]:
    """Return evenly spaced energies and a band width that suit a spectrum.

    The energies range from log λ_1 + 2σ to log λ_k - 2σ, with σ = 7 steps and λ_1 the first
    eigenvalue above 0 (Aubry, Schlickewei and Cremers 2011, section 4).

    Parameters
    ----------
    spectrum : Spectrum
        With at least two different eigenvalues above 0.
    n_energies : int
        At least 2.

    Returns
    -------
    energies : (q,) float
        Logarithms of eigenvalues in 1/length². On a shape β times as large they are lower by 2 log
        β.
    sigma : float
        Standard deviation of the bands, without unit.

    Raises
    ------
    InvalidParameterError
        If `n_energies` is not in 2..1,000,000, or no two different eigenvalues are above 0.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 30)
    >>> energies, sigma = es.spectral.default_energies(spectrum, 4)
    >>> len(energies)
    4
    """
    require_type(spectrum, Spectrum, "spectrum")
    count = whole_number(
        n_energies, "n_energies", 2, MOST_ENERGIES, "each takes a number for each point"
    )
    ends = np.log(positive_eigenvalues(spectrum)[[0, -1]])
    sigma = BAND_STEPS * float(ends[1] - ends[0]) / (count - 1 + 2 * MARGIN * BAND_STEPS)
    positive_values(sigma, "the range of logarithms of eigenvalues")
    return np.linspace(ends[0] + MARGIN * sigma, ends[1] - MARGIN * sigma, count), sigma


@one_blas_thread()
def wave_kernel_signature(
    spectrum: Spectrum, energies: ArrayLike | None = None, *, sigma: float | None = None
) -> Float[np.ndarray, "n q"]:
    """Compute the wave kernel signature: the probability to find a particle of an energy at a point.

    w_e(x) = Σ_i φ_i(x)² g(e - log λ_i) / Σ_i g(e - log λ_i),  g(d) = exp(-d² / 2σ²),

    over the eigenvalues above 0 (Aubry, Schlickewei and Cremers 2011): the mean probability over
    time to find a quantum particle with energy distribution g at x. Heat is a low-pass filter; this
    signature is a band-pass filter, which separates details of size exp(-e/2) from all others. The
    sum over x of b_x w_e(x), with b_x the mass of point x, is 1.

    Parameters
    ----------
    spectrum : Spectrum
    energies : (q,) float, optional
        Logarithms of eigenvalues in 1/length². The default is that of `default_energies`.
    sigma : float, optional
        Standard deviation of the bands, > 0. The default is that of `default_energies`.

    Returns
    -------
    (n, q) float
        In 1/length^dim. With default energies the product with the area does not depend on scale.

    Raises
    ------
    InvalidParameterError
        If an energy is not finite, sigma is not positive, or no two different eigenvalues are above
        0.

    See Also
    --------
    heat_kernel_signature : Signature over diffusion times.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 50)
    >>> waves = es.wave_kernel_signature(spectrum)
    >>> waves.shape
    (642, 100)
    >>> total = spectrum.mass.diagonal() @ waves
    >>> total.min().round(9).item(), total.max().round(9).item()
    (1.0, 1.0)
    """
    require_type(spectrum, Spectrum, "spectrum")
    if energies is None or sigma is None:
        suggested, spread = default_energies(spectrum)
        energies = suggested if energies is None else energies
        sigma = spread if sigma is None else sigma
    bands = wave_bands(spectrum, energies, sigma)
    return spectrum.eigenvectors[:, -len(bands) :] ** 2 @ bands


def wave_bands(
    spectrum: Spectrum, energies: ArrayLike, sigma: float
) -> Float[np.ndarray, "k_positive q"]:
    """Return the share of each eigenvalue above 0 in each band: g(e - log λ_i) / Σ_i g(e - log λ_i).

    Raise InvalidParameterError if an energy is not finite, sigma is not positive, or no eigenvalue
    is above 0.
    """
    logs = np.log(positive_eigenvalues(spectrum))
    levels = finite_values(energies, "energies")
    width = positive_number(sigma, "sigma")
    # Far from all eigenvalues every exponential is 0, so they are taken relative to the nearest one,
    # n: (e - log λ)² - (e - n)² = (log λ - n) (log λ + n - 2e), whose factors do not overflow.
    nearest = logs[np.searchsorted((logs[1:] + logs[:-1]) / 2, levels)]
    logs = logs[:, None]
    with np.errstate(over="ignore", under="ignore"):
        exponents = (nearest - logs) * ((logs + nearest) / 2 - levels) / width / width
        bands = np.exp(exponents)
    return bands / bands.sum(axis=0)
