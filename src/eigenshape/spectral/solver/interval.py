"""All eigenpairs between two values, proved by a count in a gap on either side."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.solver.certify import quality
from eigenshape.spectral.solver.eigenpairs import Pairs, error_bound, lowest_pairs, polish
from eigenshape.spectral.solver.factor import Factor
from eigenshape.spectral.solver.inertia import count_beside
from eigenshape.spectral.solver.lanczos import Wanted, block_lanczos
from eigenshape.spectral.solver.pencil import Pencil
from eigenshape.spectral.solver.shift import factorize_near
from eigenshape.spectral.solver.slices import (
    CLEAR_GAP,
    OVERLAP,
    Report,
    factor_beyond,
    next_slice,
    walk_on,
)

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
        gaps = _clear_gaps(pairs.values, interval)
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
            gap=(float(pairs.values[after[0]]) + error_bound(pairs), upper.shift),
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
    values: Float[np.ndarray, " k"], interval: Interval
) -> tuple[tuple[int, float], ...] | None:
    """Return where to count on each side: a pair, and the step from it into the widest gap outside the interval."""
    starts, ends = values[:-1], values[1:]
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
