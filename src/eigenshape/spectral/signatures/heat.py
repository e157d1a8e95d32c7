"""Heat kernel signatures: how much heat stays where it was put."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.spectrum import Spectrum, require_lowest

EVEN = 1e-9  # steps between logarithms of times that differ less are equal
NULL = 1e-9  # of the largest eigenvalue: what is below counts as 0
N_TIMES = 100


def positive_eigenvalues(spectrum: Spectrum) -> Float[np.ndarray, " k"]:
    """Return the eigenvalues above 0, of which each component of a shape has one without.

    Raises
    ------
    InvalidParameterError
        If there is none.
    """
    values = spectrum.eigenvalues
    positive = values[values > np.maximum(NULL * values[-1], 4 * spectrum.residuals)]
    if not positive.size:
        raise InvalidParameterError(
            f"A spectrum must have an eigenvalue above 0; its {len(values)} are one for each component. Solve for more."
        )
    return positive


def default_times(spectrum: Spectrum, n_times: SupportsIndex = N_TIMES) -> Float[np.ndarray, " q"]:
    """Return times in geometric sequence, between which the heat of a spectrum changes.

    4 ln 10 / λ_k to 4 ln 10 / λ_1, λ_1 the first eigenvalue above 0 (Sun, Ovsjanikov, Guibas 2009, 5): at the first of
    them the last exponential is 1e-4, and at the last the first one is. They scale with the shape.

    Parameters
    ----------
    spectrum : Spectrum
    n_times : int
        At least 2.

    Returns
    -------
    (q,) float
        In length^2, ascending.

    Raises
    ------
    InvalidParameterError
        If there are fewer than 2 times, or no eigenvalue above 0.
    """
    require_type(spectrum, Spectrum, "spectrum")
    values = positive_eigenvalues(spectrum)
    return 4 * np.log(10) / np.geomspace(values[-1], values[0], whole_number(n_times, "n_times", 2))


@one_blas_thread()
def heat_kernel_signature(spectrum: Spectrum, times: ArrayLike) -> Float[np.ndarray, "n q"]:
    """Measure the heat left at each point after each time.

    h_t(x, x) = sum_i exp(-t lambda_i) phi_i(x)^2                (thesis eq. 5.1; Sun, Ovsjanikov, Guibas 2009)

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs; stopping at k leaves out at most exp(-t lambda_k) / b_x at point x.
    times : (q,) float
        Diffusion times, in length^2, all > 0.

    Returns
    -------
    (n, q) float
        Heat per unit mass, in 1/length^dim.

    Raises
    ------
    InvalidParameterError
        If a time is not positive and finite, or the spectrum is of an interval.
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_lowest(spectrum, "spectrum")
    decay = np.exp(-np.outer(spectrum.eigenvalues, positive_values(times, "times")))
    return np.asarray(spectrum.eigenvectors**2 @ decay)


@one_blas_thread()
def reflection_free_signature(
    neumann: Spectrum, dirichlet: Spectrum, times: ArrayLike
) -> Float[np.ndarray, "n q"]:
    """Measure the heat left at each point as if the surface went on beyond its boundary.

    A boundary throws heat back with the Neumann condition and swallows it with the Dirichlet condition: near a straight
    one the kernels are those of the whole plane plus and minus the same mirror image (the method of images), so their
    mean is free of it.

    Parameters
    ----------
    neumann, dirichlet : Spectrum
        Of one surface, from `solve_spectrum`, without and with its boundary fixed.
    times : (q,) float
        Diffusion times, in length^2, all > 0.

    Returns
    -------
    (n, q) float
        Heat per unit mass, in 1/length^dim.

    Raises
    ------
    InvalidParameterError
        If a time is not positive and finite, or the spectra are of different sizes.
    """
    require_type(neumann, Spectrum, "neumann")
    require_type(dirichlet, Spectrum, "dirichlet")
    sizes = len(neumann.eigenvectors), len(dirichlet.eigenvectors)
    if sizes[0] != sizes[1]:
        raise InvalidParameterError(
            f"Both spectra must be of one surface; they have {sizes[0]} and {sizes[1]} points."
        )
    return (heat_kernel_signature(neumann, times) + heat_kernel_signature(dirichlet, times)) / 2


@one_blas_thread()
def scale_invariant_signature(
    spectrum: Spectrum, times: ArrayLike | None = None, *, n_frequencies: SupportsIndex = 6
) -> Float[np.ndarray, "n frequencies"]:
    """Measure how heat falls in time, blind to the size of the shape.

    |F[d/dτ log h(x, α^τ)](ω)|                                    (Bronstein and Kokkinos 2010; thesis reference 36)

    On a surface β times as large h'(x, t) = h(x, t/β²) / β²: in log h the factor is a constant, which the derivative
    removes, and the time a shift in τ, which the modulus of the Fourier transform F removes, as far as nothing happens
    at the ends of the times.

    Parameters
    ----------
    spectrum : Spectrum
    times : (q,) float, optional
        In geometric sequence, in length^2; `default_times` otherwise, with which the invariance is exact. Times
        of one's own make parts comparable with wholes.
    n_frequencies : int
        Lowest frequencies ω = 0, 1, ... to keep, at most q/2; the first says how far the logarithm falls in all.

    Returns
    -------
    (n, frequencies) float
        Without unit.

    Raises
    ------
    InvalidParameterError
        If the times are not positive or no geometric sequence of at least 3, or frequencies are more than q/2.
    """
    require_type(spectrum, Spectrum, "spectrum")
    moments = default_times(spectrum) if times is None else positive_values(times, "times")
    steps = np.diff(np.log(moments))
    if len(moments) < 3 or np.ptp(steps) > EVEN * np.abs(steps).max():
        raise InvalidParameterError(
            f"times must be a geometric sequence of at least 3; there are {len(moments)}, with ratios of neighbours "
            f"from {np.exp(steps.min(initial=0.0)):.6g} to {np.exp(steps.max(initial=0.0)):.6g}. Use numpy.geomspace."
        )
    kept = whole_number(n_frequencies, "n_frequencies", 1, len(moments) // 2)
    falls = np.diff(np.log(heat_kernel_signature(spectrum, moments)), axis=1)
    return np.abs(np.fft.rfft(falls, axis=1))[:, :kept]
