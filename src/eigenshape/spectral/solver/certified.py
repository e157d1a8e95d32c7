"""The lowest eigenpairs of a pencil, or those of an interval, proved complete."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape._progress import Progress
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.solver.certify import take_pairs
from eigenshape.spectral.solver.diagnosis import require_solvable
from eigenshape.spectral.solver.eigenpairs import Pairs
from eigenshape.spectral.solver.interval import count_interval, solve_interval
from eigenshape.spectral.solver.pencil import Pencil
from eigenshape.spectral.solver.shift import factor_below
from eigenshape.spectral.solver.strategy import dense_serves, require_memory_for_pairs, solve_lowest

# Pairs added if a trial factor counted too few eigenvalues below the limit.
RETRY_PAIRS = 8
# Eigenvalues below an interval up to which they are computed too: cheaper than a second count. With
# more, the interval alone is less work than all eigenvalues below its upper end.
FEW_BELOW = 50


def certified_pairs(
    pencil: Pencil, k: int, interval: Float[np.ndarray, " 2"], report: Progress
) -> tuple[Pairs, Certificate]:
    """Return the k lowest pairs, or where k is 0 those of an interval in the operator's units, and their proof.

    Raises an InvalidParameterError if no eigenvalue lies in the interval, the memory is too small,
    or the operator cannot be solved, and a ConvergenceError if the proof cannot be completed.
    """
    try:
        if k:
            return solve_lowest(pencil, k, report)
        low, high = np.ldexp(interval, -pencil.value_exponent).tolist()
        return _solve_between(pencil, low, high, report)
    except ConvergenceError as error:
        require_solvable(pencil, error)
        raise


def _solve_between(
    pencil: Pencil, low: float, high: float, report: Progress
) -> tuple[Pairs, Certificate]:
    report(0.01, "counting eigenvalues")
    found = None
    fallbacks: tuple[str, ...] = ()
    if low > 0 and not dense_serves(pencil, 1):
        interval = count_interval(pencil, low, high)
        within = interval.below_high - interval.below_low
        few_below = interval.below_low < max(within, FEW_BELOW)
        if not few_below and not dense_serves(pencil, interval.below_high):
            require_memory_for_pairs(pencil, within)
            try:
                found = solve_interval(
                    pencil,
                    interval,
                    lambda done: report(0.05 + 0.9 * done, "slices of the interval"),
                )
            except ConvergenceError as error:
                fallbacks = (f"slices of the interval: {error}",)
    pairs, certificate = found or _lowest_below(pencil, high, report)
    certificate = replace(certificate, fallbacks=fallbacks + certificate.fallbacks)

    start, stop = np.searchsorted(pairs.values, [low, high]).tolist()
    if start < stop:
        return take_pairs(pencil, pairs, certificate, start, stop)
    number = certificate.first + start
    below, above = pencil.values_out(np.array([high, low])).tolist()
    if number == 0:
        lowest = pencil.values_out(pairs.values[:1])[0]
        raise InvalidParameterError(
            f"below must exceed the lowest eigenvalue, {lowest:.6g}; it is {below:.6g}."
        )
    raise InvalidParameterError(
        f"There must be eigenvalues between above and below; {number} lie below {above:.6g} and none from there to "
        f"{below:.6g}."
    )


def _lowest_below(pencil: Pencil, limit: float, report: Progress) -> tuple[Pairs, Certificate]:
    """Certify one pair more than there are below the limit; then none of those is missing."""
    k = min(factor_below(pencil, limit).count + 1, pencil.n)
    while True:
        pairs, certificate = solve_lowest(pencil, k, report)
        count = int(np.count_nonzero(pairs.values < limit))
        if count < k or k == pencil.n:
            return pairs, certificate
        k = min(k + max(k // 10, RETRY_PAIRS), pencil.n)
