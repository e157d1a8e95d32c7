"""Heat kernel signatures: how much heat stays where it was put."""

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from eigenshape._arrays import positive_values
from eigenshape._errors import InvalidParameterError
from eigenshape.spectral.spectrum import Spectrum


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
    if spectrum.certificate.first:
        raise InvalidParameterError(
            f"spectrum must begin with the lowest eigenvalue; it begins with number {spectrum.certificate.first}."
        )
    decay = np.exp(-np.outer(spectrum.eigenvalues, positive_values(times, "times")))
    return np.asarray(spectrum.eigenvectors**2 @ decay)


def reflection_free_signature(neumann: Spectrum, dirichlet: Spectrum, times: ArrayLike) -> Float[np.ndarray, "n q"]:
    """Measure the heat left at each point as if the surface went on beyond its boundary.

    A boundary throws heat back with the Neumann condition and swallows it with the Dirichlet condition: near a straight
    one the kernels are those of the whole plane plus and minus the same mirror image (the method of images), so their
    mean is free of it.

    Parameters
    ----------
    neumann, dirichlet : Spectrum
        Of one surface, from `solve_spectrum` and `solve_dirichlet` with its boundary fixed.
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
    sizes = len(neumann.eigenvectors), len(dirichlet.eigenvectors)
    if sizes[0] != sizes[1]:
        raise InvalidParameterError(f"Both spectra must be of one surface; they have {sizes[0]} and {sizes[1]} points.")
    return (heat_kernel_signature(neumann, times) + heat_kernel_signature(dirichlet, times)) / 2
