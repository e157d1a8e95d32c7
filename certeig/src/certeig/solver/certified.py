"""The lowest eigenpairs of a pencil, or those of an interval, proved complete."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from certeig.certificate import Certificate
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.progress import Progress
from certeig.solver.certify import quality, take_pairs
from certeig.solver.diagnosis import require_solvable
from certeig.solver.eigenpairs import Pairs, lowest_pairs, polish
from certeig.solver.factor import Factor
from certeig.solver.inertia import count_beside
from certeig.solver.lanczos import Wanted, block_lanczos
from certeig.solver.pencil import Pencil, largest_bound
from certeig.solver.shift import factor_below, factorize_near
from certeig.solver.slices import (
    CLEAR_GAP,
    OVERLAP,
    Report,
    factor_beyond,
    next_slice,
    walk_on,
)
from certeig.solver.strategy import dense_serves, require_memory_for_pairs, solve_lowest

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
        # A value beyond the range of floats in the pencil's units is as good as infinite.
        with np.errstate(over="ignore"):
            low, high = pencil.places_in(interval).tolist()
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
    # No factor serves far beyond all eigenvalues, and none is needed there.
    ceiling = max(largest_bound(pencil), pencil.level)
    if low > ceiling:
        raise _none_between(pencil, low, high, pencil.n)
    high = min(high, ceiling)
    if low > 0 and not dense_serves(pencil, 1):
        interval = count_interval(pencil, low, high)
        within = interval.below_high - interval.below_low
        few_below = interval.below_low < max(within, FEW_BELOW)
        if not few_below and not dense_serves(pencil, within):
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
    if number:
        raise _none_between(pencil, low, high, number)
    lowest, below = pencil.places_out(np.array([pairs.values[0], high])).tolist()
    raise InvalidParameterError(
        f"below must exceed the lowest eigenvalue, {lowest:.6g}; it is {below:.6g}."
    )


def _none_between(pencil: Pencil, low: float, high: float, number: int) -> InvalidParameterError:
    above, below = pencil.places_out(np.array([low, high])).tolist()
    return InvalidParameterError(
        f"There must be eigenvalues between above and below; {number} lie below {above:.6g} and none from there to "
        f"{below:.6g}."
    )


def _lowest_below(pencil: Pencil, limit: float, report: Progress) -> tuple[Pairs, Certificate]:
    """Certify one pair more than there are below the limit; then none of those is missing."""
    # No eigenvalue is negative but by rounding, and no factor serves at zero.
    k = min(factor_below(pencil, limit).count + 1, pencil.n) if limit > 0 else 1
    while True:
        pairs, certificate = solve_lowest(pencil, k, report)
        count = int(np.count_nonzero(pairs.values < limit))
        if count < k or k == pencil.n:
            return pairs, certificate
        k = min(k + max(k // 10, RETRY_PAIRS), pencil.n)


# Runs of block Lanczos for missing pairs of an interval before giving up.
INTERVAL_RUNS = 20
# Factor by which the search past the ends grows if there was no clear gap.
WIDER_OVERLAP = 4


@dataclass(frozen=True)
class Interval:
    """low ≤ λ < high in a pencil's units, and the eigenvalues below each as trial factors counted them."""

    low: float
    high: float
    below_low: int
    below_high: int


def count_interval(pencil: Pencil, low: float, high: float) -> Interval:
    """Count the eigenvalues below both ends, or near them."""
    below = sorted(factorize_near(pencil, end).count for end in (low, high))
    return Interval(low, high, *below)


def solve_interval(pencil: Pencil, interval: Interval, report: Report) -> tuple[Pairs, Certificate]:
    """Find all eigenpairs of an interval far up in the spectrum, and those past its ends up to a clear gap.

    Block Lanczos as in `solve_spectrum`, a slice at a time. With N(σ) the number of eigenvalues
    below σ, as many are to be found between σ and τ as N(τ) - N(σ) says; the certificate holds both
    shifts.

    Raises a ConvergenceError if the counts and what was found do not agree in the end.
    """
    extra = OVERLAP
    while True:
        first, last = max(interval.below_low - extra, 0), min(interval.below_high + extra, pencil.n)
        target = next_slice(last, first)
        spacing = (interval.high - interval.low) / (interval.below_high - interval.below_low + 1)
        start = interval.low - spacing * min(extra, interval.below_low)
        factor = factor_beyond(pencil, max(start, interval.low / 2), spacing, first, target)
        vectors, factor = walk_on(pencil, factor, first, last, report)
        found = _complete(pencil, factor, vectors, interval, report)
        if found:
            return found
        if first == 0 and last == pencil.n:
            raise ConvergenceError(
                "An interval must end in a gap between eigenvalues; no gap is wider than rounding."
            )
        extra *= WIDER_OVERLAP


def _complete(
    pencil: Pencil,
    factor: Factor,
    vectors: Float[np.ndarray, "n j"],
    interval: Interval,
    report: Report,
) -> tuple[Pairs, Certificate] | None:
    """Search for pairs that are missing by the counts; None if there is no clear gap on one of the sides."""
    for _ in range(INTERVAL_RUNS):
        pairs = polish(pencil, factor, lowest_pairs(pencil, vectors, vectors.shape[1]))
        report(0.9)
        gaps = _clear_gaps(pairs.values, interval, pencil.n)
        if gaps is None:
            return None
        (index, step), after = gaps
        lower = count_beside(pencil, pairs, index, step, most=False)
        upper = count_beside(pencil, pairs, *after)
        inner = pairs.select((pairs.values > lower.shift) & (pairs.values < upper.shift))
        certificate = replace(
            quality(pencil, pairs),
            n_found=len(inner.values),
            floor=lower.shift,
            first=lower.count,
            shift=upper.shift,
            count=upper.count - lower.count,
            gap=(float(pairs.values[after[0]]) + pairs.error_bound, upper.shift),
            resolution=float(np.abs(pairs.values - upper.shift).min()),
        )
        missing = certificate.n_missing
        if missing == 0:
            return inner, certificate
        if missing < 0:
            break
        wanted = Wanted(
            below=missing, above=missing, floor=certificate.floor, ceiling=certificate.shift
        )
        _, more = block_lanczos(pencil, factor, wanted, locked=pairs.vectors, report=report)
        if not more.shape[1]:
            break
        vectors = np.hstack([pairs.vectors, more])
    raise ConvergenceError(
        f"Every eigenvalue that inertia counts must be found; {certificate.n_found} of {certificate.count} in the "
        f"interval were."
    )


def _clear_gaps(
    values: Float[np.ndarray, " k"], interval: Interval, n: int
) -> tuple[tuple[int, float], ...] | None:
    """Return where to count on each side: a pair, and the step from it into the widest gap outside the interval."""
    starts, ends = values[:-1], values[1:]
    if interval.below_high == n:  # nothing lies above the interval, so the count is made there
        starts, ends = values, np.append(ends, 1.01 * max(interval.high, float(values[-1])))
    before, after = (
        np.minimum(ends, interval.low) - starts,
        ends - np.maximum(starts, interval.high),
    )
    if len(values) < 2:
        return None
    lower, upper = int(before.argmax()), int(after.argmax())
    if min(before[lower], after[upper]) < CLEAR_GAP * values[-1]:
        return None
    return (lower, before[lower] / 2), (upper, ends[upper] - after[upper] / 2 - starts[upper])
