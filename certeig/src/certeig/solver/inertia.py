"""Counts of the eigenvalues below σ that hold in spite of the rounding of the factor."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import ConvergenceError
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil

# Factor by which σ moves away from the eigenvalue if rounding could move it across.
WIDENING = 3.7
# Slack of every row at least, relative to the step: rounding wanders from factor to factor, most in
# rows where there was little, and another factor costs far more than a sixteenth of that distance.
SPARE = 1 / 16
# Factors for one count before giving up.
COUNT_TRIALS = 12
# Slack of a count far from what is known, in multiples of the rounding of a factor without.
SLACK = 2.0
# Where no factor serves at a value, or rounding is too large there, eigenvalues are counted this far on
# both sides of it, in shares of trace W / trace B: the same count proves that none is between.
COUNT_STEPS = (0.0, 1e-9, 1e-6, 1e-4)
# Values are moved to at most this size, far beyond any eigenvalue, where factors still have no infinities.
LARGEST_SHIFT = 1e200


def count_below_shift(pencil: Pencil, shift: float) -> int:
    """Count the eigenvalues below a shift in the pencil's units, without knowing any of them.

    Raises a ConvergenceError if an eigenvalue is at the shift, up to rounding.
    """
    shift = min(max(shift, -LARGEST_SHIFT), LARGEST_SHIFT)
    for step in COUNT_STEPS:
        below, above = shift - step * pencil.level, shift + step * pencil.level
        least, most = bound_count(pencil, below, -1.0), bound_count(pencil, above, 1.0)
        if least is not None and least == most:
            return least
    raise ConvergenceError(
        f"To count eigenvalues below a value none may be at it, up to rounding; {pencil.place_out(shift):.6g} "
        f"is too near to one. Choose a value a little higher or lower."
    )


def bound_count(pencil: Pencil, shift: float, side: float) -> int | None:
    """Bound the number of eigenvalues below a shift, from above or (side -1) below; None if rounding forbids it."""
    plain = Factor.at(pencil, shift)
    if plain is None or not np.isfinite(loss := plain.rounding()).all():
        return None
    # W - σB - S with S above the rounding is nowhere above W - σB, and has at least as many negative
    # eigenvalues; with -S it has at most as many.
    slack = SLACK * loss
    moved = Factor.at(pencil, shift, side * slack)
    return moved.count if moved and (moved.rounding() <= slack).all() else None


def count_again(pencil: Pencil, pairs: Pairs, factor: Factor) -> Factor | None:
    """Return a factor above all pairs as `count_beside` returns one; None if its rounding is too large."""
    over = _move_of_shift(pencil, factor.rounding())
    shift = factor.shift - over
    clear = 2 * (pairs.error_bound + over) < shift - float(pairs.values[-1])
    return replace(factor, shift=shift) if clear else None


def _move_of_shift(pencil: Pencil, loss: Float[np.ndarray, " n"]) -> float:
    """Return how far rounding moves σ.

    W - σB - S + E ≤ W - (σ - ρ)B where no row of E has more than ρ c D of it above the slack.
    """
    return float((loss / pencil.mass_diagonal).max(initial=0.0)) / pencil.mass_floor


def count_beside(
    pencil: Pencil,
    pairs: Pairs,
    index: int,
    step: float,
    beside: Factor | None = None,
    *,
    most: bool = True,
) -> Factor:
    """Count at `step` from a value, or farther off where rounding would move a value found across σ.

    The count is not less than the number of eigenvalues below `shift` of what is returned; with
    `most=False` it is not more. A factor tells how much slack the next one needs for its count to
    stand above rounding (`rounding`). One at another shift, which is spent, tells the first what to
    expect.

    Raises a ConvergenceError if rounding exceeds the distance to the nearest value found at every σ
    that is tried.
    """
    value, shape, side = (
        float(pairs.values[index]),
        pairs.vectors[:, index] ** 2,
        1.0 if most else -1.0,
    )
    found_error = pairs.error_bound

    def uncertainty(slack: Float[np.ndarray, " n"]) -> float:
        # How far the slack moves this eigenvalue, to first order, and the error of the value.
        return found_error + float(slack @ shape)

    def too_much(loss: float, shift: float) -> bool:
        return not 2 * loss < np.abs(pairs.values - shift).min()

    def padded(loss: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        return 3 * loss + SPARE * abs(step) * pencil.mass_diagonal

    factor, none, sigma = beside, np.zeros(pencil.n), value + step
    slack = none
    if beside:
        # What was enough for this factor, or would have been.
        slack = beside.slack if beside.slack.any() else padded(beside.rounding())
    if too_much(uncertainty(slack), sigma):
        slack = none
    for _ in range(COUNT_TRIALS):
        factor = Factor.at(pencil, sigma, side * slack, factor)
        loss = factor.rounding() if factor else np.full(pencil.n, np.inf)
        over = _move_of_shift(pencil, loss - slack)
        moved = sigma - side * over
        if factor and not too_much(uncertainty(slack) + over, moved):
            return replace(factor, shift=moved)
        slack = wanted = np.maximum(slack, padded(loss))
        if too_much(uncertainty(slack), sigma):
            step, slack = WIDENING * step, none
            sigma = value + step
    raise ConvergenceError(
        f"To count eigenvalues, rounding must be smaller than their distance to σ; near "
        f"{pencil.place_out(value):.6g}{pencil.advice.units} it is "
        f"{np.ldexp(uncertainty(wanted), pencil.value_exponent):.1e}. {pencil.advice.rounding}"
    )
