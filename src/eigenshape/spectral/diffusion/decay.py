"""How fast the modes of a spectrum lose heat."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import positive_values
from certeig.kit.typing import ArrayLike
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum


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
