"""Counts of the eigenvalues below σ that hold in spite of the rounding of the factor."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import ConvergenceError
from certeig.solver.eigenpairs import Pairs, error_bound
from certeig.solver.factor import Factor, factorize, rounding
from certeig.solver.pencil import Pencil

# Factor by which σ moves away from the eigenvalue if rounding could move it across.
WIDENING = 3.7
# Slack of every row at least, relative to the step: rounding wanders from factor to factor, most in
# rows where there was little, and another factor costs far more than a sixteenth of that distance.
SPARE = 1 / 16
# Factors for one count before giving up.
COUNT_TRIALS = 12


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
    found_error = error_bound(pairs)

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
        slack = beside.slack if beside.slack.any() else padded(rounding(beside))
    if too_much(uncertainty(slack), sigma):
        slack = none
    for _ in range(COUNT_TRIALS):
        factor = factorize(pencil, sigma, side * slack, factor)
        loss = rounding(factor) if factor else np.full(pencil.n, np.inf)
        # What is above the slack moves σ: W - σB - S + E ≤ W - (σ - ρ)B where no row has more than
        # ρ c D of it.
        over = float(((loss - slack) / pencil.mass_diagonal).max(initial=0.0)) / pencil.mass_floor
        moved = sigma - side * over
        if factor and not too_much(uncertainty(slack) + over, moved):
            return replace(factor, shift=moved)
        slack = wanted = np.maximum(slack, padded(loss))
        if too_much(uncertainty(slack), sigma):
            step, slack = WIDENING * step, none
            sigma = value + step
    raise ConvergenceError(
        f"To count eigenvalues, rounding must be smaller than their distance to σ; near "
        f"{np.ldexp(value, pencil.value_exponent):.6g}{pencil.advice.units} it is "
        f"{np.ldexp(uncertainty(wanted), pencil.value_exponent):.1e}. {pencil.advice.rounding}"
    )
