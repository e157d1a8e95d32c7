"""Polynomials in one implicit step that approximate the exponential, with a bound of their error."""

import numpy as np
from jaxtyping import Float
from scipy.fft import dct

# Times over τ, the time of one implicit step. Between 6 and 48 an accuracy of 1e-10 takes at most
# 30 steps, and 25 at best (at 17): one factor serves times within a factor of 8 of each other.
SMALLEST_RATIO = 6.0
TIMES_OF_ONE_FACTOR = 8.0
# Chebyshev coefficients that are computed. At these ratios those beyond 60 are below 1e-16.
N_COEFFICIENTS = 256


def step_time(times: Float[np.ndarray, " q"]) -> float:
    """Return the time τ of one implicit step that suits some times; the last is at most 8 times the first."""
    middle = SMALLEST_RATIO * TIMES_OF_ONE_FACTOR**0.5
    return float(np.sqrt(times.min()) * np.sqrt(times.max()) / middle)


def group_times(times: Float[np.ndarray, " q"]) -> list[np.ndarray]:
    """Return the places of times that share a factor, from the shortest times on."""
    groups: list[list[int]] = []
    for place in np.argsort(times, kind="stable"):
        if not groups or times[place] > TIMES_OF_ONE_FACTOR * times[groups[-1][0]]:
            groups.append([])
        groups[-1].append(int(place))
    return [np.array(group) for group in groups]


def step_coefficients(ratio: float, accuracy: float) -> Float[np.ndarray, " d"]:
    """Return the Chebyshev coefficients of a polynomial p in S = 1/(1 + τλ) near e^{-tλ}, ratio = t/τ.

    With s = 1/(1 + τλ) in (0, 1] for every λ ≥ 0, e^{-tλ} = exp(-(t/τ)(1/s - 1)) is a smooth
    function of s. Its Chebyshev series in 2s - 1 is cut where the sum of the absolute values of the
    rest falls below half of `accuracy`, and two coefficients are changed by at most as much so that
    p(1) = 1 (constants stay) and p(0) = 0 (λ = ∞ vanishes). So |p(s) - e^{-tλ}| ≤ accuracy for all
    λ ≥ 0. The number of steps grows with log(1/accuracy); the best rational function with one real
    pole of order d errs by about 0.414^d (Andersson 1981; van den Eshof and Hochbruck 2006).
    """
    angles = (np.arange(N_COEFFICIENTS) + 0.5) * np.pi / N_COEFFICIENTS
    s = (1 + np.cos(angles)) / 2
    coefficients = dct(np.exp(-ratio * (1 / s - 1)), type=2) / N_COEFFICIENTS
    coefficients[0] /= 2
    rest = np.cumsum(np.abs(coefficients)[::-1])[::-1]  # rest[d] is the error of degree d - 1
    kept = coefficients[: int(np.argmax(rest <= accuracy / 2))].copy()
    signs = (-1.0) ** np.arange(len(kept))
    above, below = 1 - kept.sum(), -(kept * signs).sum()
    kept[0] += (above + below) / 2
    kept[1] += (above - below) / 2
    return kept
