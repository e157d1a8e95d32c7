"""Diagnosis of operators that could not be solved."""

from contextlib import suppress

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import Factor
from certeig.solver.inertia import count_beside
from certeig.solver.pencil import Pencil

# Ratio of W_ii/B_ii between two points beyond which rounding at the one hides the eigenvalues of
# the other.
DIGITS = 1e10
# First negative value at which eigenvalues are counted, in the pencil's level: rounding of a zero
# stays above.
BELOW_ZERO = 1e-12
# Factor between the negative values at which eigenvalues are counted,
STEP_DOWN = 8.0
# and how many there are at most: 8^60 is 1e54.
MOST_STEPS_DOWN = 60


def require_solvable(pencil: Pencil, error: ConvergenceError) -> None:
    """Raise a specific error if `error` was caused by an operator that no solver can solve.

    An InvalidParameterError, if W has a negative eigenvalue, or W_ii/B_ii spans more digits than
    floats have.
    """
    scales = _scales(pencil)
    if not np.isnan(scales).all():
        soft, stiff = int(np.nanargmin(scales)), int(np.nanargmax(scales))
        if scales[stiff] > DIGITS * scales[soft]:
            row = pencil.advice.row
            low, high = pencil.places_out(scales[[soft, stiff]])
            raise InvalidParameterError(
                f"W_ii/B_ii must not span more digits than floats have; it is {high:.3g} at {row} {stiff} and "
                f"{low:.3g} at {row} {soft}, and rounding at the one hides the eigenvalues of the other. "
                f"{remedy_for(pencil)}"
            ) from error

    # Count eigenvalues below ever lower values, to say about how low the lowest is.
    first = last = _count_below(pencil, -BELOW_ZERO * pencil.level)
    if first is None or last is None:
        return
    for _ in range(MOST_STEPS_DOWN):
        farther = _count_below(pencil, STEP_DOWN * last.shift)
        if farther is None:
            break
        last = farther
    high, low, least = pencil.places_out(
        np.array([first.shift, last.shift, STEP_DOWN * last.shift])
    )
    raise InvalidParameterError(
        f"{pencil.advice.stiffness} must be positive semidefinite; eigenvalue 0 lies between {least:.3g} "
        f"and {low:.3g}, and {first.count} lie below {high:.1e}."
    ) from error


def remedy_for(pencil: Pencil) -> str:
    """Return what to try where points of very different scales cannot be solved together."""
    scales = _scales(pencil)
    if not np.isnan(scales).all():
        _, component = connected_components(pencil.stiffness, directed=False)
        if component[np.nanargmin(scales)] != component[np.nanargmax(scales)]:
            return pencil.advice.separate
    return pencil.advice.scales


def _scales(pencil: Pencil) -> Float[np.ndarray, " n"]:
    """Return W_ii/B_ii, and nan where it is not positive."""
    ratios = pencil.stiffness.diagonal() / pencil.mass_diagonal
    return np.where(ratios > 0, ratios, np.nan)


def _count_below(pencil: Pencil, shift: float) -> Factor | None:
    """Count eigenvalues below a negative value or a lower one, safely against rounding; None if none is proved.

    No eigenpair is known. 0 and the constant should be one, and `count_beside` keeps rounding away
    from it.
    """
    constant = np.full((pencil.n, 1), pencil.mass_diagonal.sum() ** -0.5)
    with suppress(ConvergenceError):
        found = count_beside(
            pencil, Pairs(np.zeros(1), constant, np.zeros(1)), 0, shift, most=False
        )
        return found if found.count else None
    return None
