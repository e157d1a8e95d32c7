"""Where to shift, found from the operator alone."""

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import ConvergenceError
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil

# Of the k wanted eigenvalues this share lies below the shift. On a surface counts grow like
# eigenvalues (Weyl), and below the shift the spectrum ends at 0, so that side converges sooner.
# Measured best, and flat around it.
SHARE_BELOW = 0.62
# Shares of the k eigenvalues below the shift that are accepted. A narrower range would cost more
# trial factors.
ACCEPTED_SHARES = (0.45, 0.78)
# Trial factors before the highest shift with fewer than k eigenvalues below it is used.
SHIFT_TRIALS = 12
UNIFORM_MESH = 3.6  # λ_k ≈ 3.6 (k/n) trace W / trace B on a surface of equilateral triangles
# λ_k ≈ 0.3 k^0.92 n^(-2/3) trace W / trace B for the first eigenvalues of a solid with a free surface;
# elements of order 1, 2 and 3 differ by a few per cent (measured on cuboids, k from 4 to 160).
SOLID_LEVEL, SOLID_POWER = 0.3, 0.92
# A shift above the k-th eigenvalue of a solid is aimed at number 1.2 k + 3, and serves up to number
# 1.5 k + 16: some eigenvalues too many cost less than another factor.
AIMED_ABOVE, MOST_ABOVE = (1.2, 3), (1.5, 16)
# of the first guess: where more eigenvalues than wanted lie lower still, they form a cluster at 0
LOWEST = 1e-6
# Shares of a shift that are tried if no factor near the shift itself is good enough.
LOWER_SHARES = (1.0, 0.7, 0.4, 0.2)
# Multiples of a shift that are tried if a pivot is poor or an eigenvalue is too close to it.
SHIFT_NUDGES = (1.0, 1.01, 0.985, 1.03, 0.96)
BACKWARD_ERROR = 1e-8  # of a solve, entry by entry; a poor pivot shows here
# relative distance of the shift to an eigenvalue, below which rounding shows in the others
CLEAR = 1e-5


def shift_inside(pencil: Pencil, k: int) -> Factor:
    """Factor at a shift with about 0.62 k eigenvalues below it.

    Each factor counts the eigenvalues below its shift, so trial shifts follow a secant through the
    logarithms of the counts, whatever the dimension of the shape. Where a cluster leaves no such
    shift (k smaller than the number of components, say), the highest shift with fewer than k
    eigenvalues below it serves, or one below zero.
    """
    guess = float(expected_values(pencil, np.array([SHARE_BELOW * k]))[0])
    low: Factor | None = None
    high: Factor | None = None
    factor = factor_below(pencil, guess)
    for _ in range(SHIFT_TRIALS):
        if ACCEPTED_SHARES[0] * k - 3 <= factor.count <= ACCEPTED_SHARES[1] * k + 1:
            return factor
        low, high = (factor, high) if factor.count < SHARE_BELOW * k else (low, factor)
        if high and high.shift < (1.02 * low.shift if low else LOWEST * guess):
            break
        factor = factor_below(pencil, _next_shift(factor, low, high, SHARE_BELOW * k))
    return low or factorize_near(pencil, -guess)


def shift_above(pencil: Pencil, k: int) -> Factor:
    """Factor a little above the k-th eigenvalue of a solid, as far as Weyl's law tells, or inside the spectrum.

    A factor above all wanted eigenvalues counts them, so that no other factor is needed.
    """
    number = AIMED_ABOVE[0] * k + AIMED_ABOVE[1]
    guess = SOLID_LEVEL * number**SOLID_POWER / pencil.n ** (2 / 3) * pencil.level
    factor = factor_below(pencil, guess)
    most = MOST_ABOVE[0] * k + MOST_ABOVE[1]
    fits = ACCEPTED_SHARES[0] * k - 3 <= factor.count <= most
    return factor if fits else shift_inside(pencil, k)


def expected_values(pencil: Pencil, numbers: Float[np.ndarray, " j"]) -> Float[np.ndarray, " j"]:
    """Return λ_k of a surface for some k by Weyl's law, as its operator would have it."""
    shares = UNIFORM_MESH * numbers / pencil.n
    if not pencil.saturation:
        return pencil.level * shares
    # (1 - e^{-tλ})/t, where level is 1/t
    return -pencil.level * np.expm1(-shares * pencil.saturation)


def factor_below(pencil: Pencil, shift: float) -> Factor:
    """Factor near `shift`, or at a share of it: solids and uneven masses may put a guess far up among eigenvalues."""
    for share in LOWER_SHARES:
        try:
            return factorize_near(pencil, share * shift)
        except ConvergenceError:
            continue
    return factorize_near(pencil, shift)


def factorize_near(pencil: Pencil, shift: float) -> Factor:
    """Factor at `shift`, or within a few per cent of it where pivots there are poor or an eigenvalue is too near.

    Raises a ConvergenceError if that is so at all of them.
    """
    for nudge in SHIFT_NUDGES:
        factor = Factor.at(pencil, nudge * shift)
        if factor and _serves(pencil, factor):
            return factor
    raise ConvergenceError(
        "A factor of W - σB must have its pivots on the diagonal, and little rounding; none has near "
        f"σ = {pencil.place_out(shift):.6g}{pencil.advice.units}. {pencil.advice.rounding}"
    )


def _serves(pencil: Pencil, factor: Factor) -> bool:
    start = pencil.weigh(np.random.default_rng(0).standard_normal((pencil.n, 1)))
    once = factor.solve(start)
    rest = pencil.stiffness @ once - factor.shift * pencil.weigh(once) - start
    terms = (
        abs(pencil.stiffness) @ np.abs(once)
        + abs(factor.shift) * pencil.weigh(np.abs(once))
        + np.abs(start)
    )
    # Two steps of inverse iteration: an eigenvalue very close to σ would outshine all others in any
    # vector.
    twice = factor.solve(pencil.weigh(once))
    clear = CLEAR * abs(factor.shift) * np.linalg.norm(twice) < np.linalg.norm(once)
    return bool(clear and (np.abs(rest) <= BACKWARD_ERROR * terms).all())


def _next_shift(latest: Factor, low: Factor | None, high: Factor | None, target: float) -> float:
    if low is None or high is None:
        return latest.shift * min(max(target / (latest.count + 0.5), 0.05), 20.0)
    # The secant in logarithms, kept away from the ends of the bracket.
    share = np.log(target / (low.count + 0.5)) / np.log((high.count + 0.5) / (low.count + 0.5))
    return low.shift * float((high.shift / low.shift) ** min(max(share, 0.15), 0.85))
