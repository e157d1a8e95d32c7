"""What is wrong with an operator that could not be solved."""

import numpy as np

from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape.spectral.factor import Factor, factorise, rounding
from eigenshape.spectral.pencil import Pencil

DIGITS = 1e10  # of W_ii/B_ii from the stiffest point to the softest: beyond it rounding at one hides the other
BELOW_ZERO = 1e-12  # of the pencil's level
TRIALS = 6
LOWER = 8.0
DEPTH = 60


def require_solvable(pencil: Pencil, error: ConvergenceError) -> None:
    """Refuse an operator that no solver could have solved, where that is why `error` was raised.

    Raises
    ------
    InvalidParameterError
        If W has a negative eigenvalue, or W_ii/B_ii spans more digits than floats have.
    """
    _require_near_scales(pencil, error)
    _require_semidefinite(pencil, error)


def _require_near_scales(pencil: Pencil, error: ConvergenceError) -> None:
    ratios = pencil.stiffness.diagonal() / pencil.mass_diagonal
    scales = np.where(ratios > 0, ratios, np.nan)
    if np.isnan(scales).all():
        return
    soft, stiff = int(np.nanargmin(scales)), int(np.nanargmax(scales))
    if scales[stiff] > DIGITS * scales[soft]:
        low, high = pencil.values_out(scales[[soft, stiff]])
        raise InvalidParameterError(
            f"W_ii/B_ii must not span more digits than floats have; it is {high:.3g} at point {stiff} and {low:.3g} at "
            f"point {soft}, and rounding at the one hides the eigenvalues of the other. Solve parts of so different "
            f"sizes apart, or repair nearly degenerate elements."
        ) from error


def _require_semidefinite(pencil: Pencil, error: ConvergenceError) -> None:
    shift = -BELOW_ZERO * pencil.level
    count = _surely_below(pencil, shift)
    if not count:
        return
    lowest = shift
    for _ in range(DEPTH):
        lowest *= LOWER
        if not _surely_below(pencil, lowest):
            break
    high, low, least = pencil.values_out(np.array([shift, lowest / LOWER, lowest]))
    raise InvalidParameterError(
        f"stiffness must be positive semidefinite; eigenvalue 0 lies between {least:.3g} and {low:.3g}, and "
        f"{count} lie below {high:.1e}."
    ) from error


def _surely_below(pencil: Pencil, shift: float) -> int:
    """Count eigenvalues that lie below a negative shift whatever the rounding; 0 where that cannot be told.

    The mirror image of the proof in `certify`: W - σB + S with S beyond the rounding has no more negative pivots than
    W - σB has negative eigenvalues.
    """
    slack = np.zeros(pencil.n)
    for _ in range(TRIALS):
        factor: Factor | None = factorise(pencil, shift, -slack)
        loss = rounding(factor) if factor else np.full(pencil.n, np.abs(shift) * pencil.mass_diagonal)
        if factor and (loss <= slack).all():
            return factor.count
        slack = np.maximum(slack, 3 * loss)
    return 0
