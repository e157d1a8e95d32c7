"""How fast each eigenfunction loses its heat: the one formula of operator, kernel, trace and signature."""

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values
from eigenshape._typing import ArrayLike
from eigenshape.spectral.spectrum import Spectrum, require_lowest


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
    require_type(spectrum, Spectrum, "spectrum")
    require_lowest(spectrum, "spectrum")
    return exponential_decay(spectrum.eigenvalues, positive_values(times, name))
