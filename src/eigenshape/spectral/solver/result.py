"""The last step of every method: a spectrum in the units of the user, corrected if the kernel is."""

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import freeze
from eigenshape._errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.solver.certify import in_user_units
from eigenshape.spectral.solver.kernel_values import (
    from_pencil,
    require_readable,
    user_certificate,
    user_residuals,
)
from eigenshape.spectral.solver.pairs import Pairs
from eigenshape.spectral.solver.pencil import Pencil, to_user_vectors
from eigenshape.spectral.spectrum import Spectrum

# Negative eigenvalues down to minus this share of the mean eigenvalue may be rounding.
NEGATIVE_ROUNDING = 1e-9


def spectrum_of(
    laplacian: Laplacian, pencil: Pencil, pairs: Pairs, certificate: Certificate
) -> Spectrum:
    """Convert pairs of the pencil to a spectrum in the user's units, corrected if the kernel is.

    Raises
    ------
    InvalidParameterError
        If an eigenvalue is negative by more than its error, or a corrected one is 1/t or more.
    """
    values = pencil.values_out(_without_negatives(pencil, pairs))
    residuals = pencil.values_out(pairs.residuals)
    require_readable(laplacian.kernel, values, stacklevel=4)
    return Spectrum(
        eigenvalues=freeze(from_pencil(laplacian.kernel, values)),
        eigenvectors=to_user_vectors(pencil, pairs.vectors),
        mass=laplacian.mass,
        residuals=freeze(user_residuals(laplacian.kernel, values, residuals)),
        certificate=user_certificate(
            laplacian.kernel, in_user_units(pencil, certificate), float(values[-1])
        ),
    )


def _without_negatives(pencil: Pencil, pairs: Pairs) -> Float[np.ndarray, " k"]:
    # A negative Rayleigh quotient proves a negative eigenvalue, however large its residual, up to
    # rounding.
    rounding = (
        np.minimum(4 * pairs.residuals, NEGATIVE_ROUNDING * pencil.level) + 1e-14 * pencil.level
    )
    bad = np.flatnonzero(pairs.values < -rounding)
    if bad.size:
        value, bound = pencil.values_out(np.array([pairs.values[bad[0]], rounding[bad[0]]]))
        raise InvalidParameterError(
            f"stiffness must be positive semidefinite; eigenvalue {bad[0]} is {value:.6g}, with "
            f"an error below {bound:.1e}."
        )
    return np.maximum(pairs.values, 0.0)
