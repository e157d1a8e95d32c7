"""How far eigenvalues may move, as powers of the closeness δ and the heat time t, and what is measured of it."""

from dataclasses import dataclass
from math import e, exp, lgamma, pi, sqrt
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike

THEOREMS = ("3.1.1", "3.1.3", "3.1.4", "3.1.5", "4.1.1", "4.3.1", "lipschitz", "dense")
MOST_DIM = 100


@dataclass(frozen=True)
class Rate:
    """A law: constant · δ^`delta` · t^`t`.

    Attributes
    ----------
    delta, t : float
        Exponents of the closeness and of the heat time.
    constant : float
        1 where theory hides it.
    """

    delta: float
    t: float
    constant: float = 1.0

    def at(self, delta: ArrayLike, t: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the law's value at each closeness and heat time."""
        return np.asarray(self.constant * np.asarray(delta) ** self.delta * np.asarray(t) ** self.t)


def theorem_rate(theorem: str, dim: SupportsIndex) -> Rate:
    """Return what a theorem proves of the distance of eigenvalues on m-manifolds.

    - "3.1.1": t^(2/(m+6)) between Δ and the functional approximation 𝓛_t (Belkin and Niyogi 2008).
    - "3.1.3": ε t^-(m/2+3) between 𝓛_t and the mesh Laplacian of an ε-approximation; δ stands for ε.
    - "3.1.4": δ t^-(m/4+2), the Hausdorff distance between the spectra of 𝓛_t on two δ_H-close manifolds.
    - "3.1.5": δ^(8/(m²+14m+56)) between the eigenvalues of Δ on them: 3.1.1 and 3.1.4 at the t that makes them equal.
    - 3.1.6 has no rate: mesh Laplacians on such meshes have eigenvalues that come together when t, 3.1.3 and 3.1.4 all
      go to 0.
    - "4.1.1", "4.3.1": δ^(4/5) t^-(m/2+7/5) between Gaussian graph Laplacians of points at most δ apart one by one;
      δ^(1/3) where t ≥ δ^(14/(15m+42)). 4.1.1 says it of random samples of δ-close manifolds.
    - "lipschitz": δ t^-(m/2+3/2), ours for the same, with its constant. A Gaussian exp(-r²/4t) changes by at most
      e^(-1/2)/√(2t) a unit of r, and r by at most 2δ; D = L_P - L_Q has rows whose entries sum to 0, those off its
      diagonal being at most that over n, so ‖D‖₂ ≤ ‖D‖_∞ ≤ 4δ e^(-1/2)/√(2t) / (t (4πt)^(m/2)). Weyl's theorem makes
      it a bound for every eigenvalue, at any t. It is (δ²/t)^(1/10) of 4.3.1, smaller wherever t > δ².
    - "dense": δ t^(-3/2), ours, what "lipschitz" comes to where points sample a manifold of volume 1 ever more densely,
      and δ ≪ √t ≪ 1/curvature. A row then sums to an integral instead of n times its largest term: on average the slope
      of a Gaussian is Γ((m+1)/2)/Γ(m/2)/√t, and ‖D‖₂ ≤ 4δ Γ((m+1)/2)/Γ(m/2) t^(-3/2).

    Raises
    ------
    InvalidParameterError
        If the theorem is none of these, or `dim` is not in 1..100.
    """
    m = whole_number(dim, "dim", 1, MOST_DIM)
    rates = {
        "3.1.1": Rate(0.0, 2 / (m + 6)),
        "3.1.3": Rate(1.0, -(m / 2 + 3)),
        "3.1.4": Rate(1.0, -(m / 4 + 2)),
        "3.1.5": Rate(8 / (m**2 + 14 * m + 56), 0.0),
        "4.1.1": Rate(4 / 5, -(m / 2 + 7 / 5)),
        "4.3.1": Rate(4 / 5, -(m / 2 + 7 / 5)),
        "lipschitz": Rate(1.0, -(m / 2 + 3 / 2), 4 / sqrt(2 * e) / (4 * pi) ** (m / 2)),
        "dense": Rate(1.0, -3 / 2, 4 * exp(lgamma((m + 1) / 2) - lgamma(m / 2))),
    }
    if theorem not in rates:
        raise InvalidParameterError(
            f"theorem must be one of {', '.join(THEOREMS)}; it is {theorem!r}."
        )
    return rates[theorem]


def bounding_rate(rate: Rate, delta: ArrayLike, t: ArrayLike, measured: ArrayLike) -> Rate:
    """Give a law the least constant with which it covers all that was measured.

    Parameters
    ----------
    rate : Rate
    delta, t, measured : (q,) float
        All > 0.

    Raises
    ------
    InvalidParameterError
        If a value is not positive and finite, or their numbers differ.
    """
    require_type(rate, Rate, "rate")
    deltas, times, values = _measurements(delta, t, measured)
    shape = Rate(rate.delta, rate.t)
    return Rate(rate.delta, rate.t, float((values / shape.at(deltas, times)).max()))


def fit_rate(delta: ArrayLike, t: ArrayLike, measured: ArrayLike) -> Rate:
    """Fit the exponents and the constant to what was measured, by least squares of the logarithms.

    The exponent of what has one value throughout is 0.

    Parameters
    ----------
    delta, t, measured : (q,) float
        All > 0.

    Raises
    ------
    InvalidParameterError
        If a value is not positive and finite, their numbers differ, or too few differ to tell exponents apart.
    """
    deltas, times, values = _measurements(delta, t, measured)
    columns = np.log(np.column_stack([deltas, times]))
    centred = columns - columns.mean(axis=0)
    varied = np.ptp(columns, axis=0) > 0
    if not varied.any() or np.linalg.matrix_rank(centred[:, varied]) < np.count_nonzero(varied):
        raise InvalidParameterError(
            f"delta and t must vary, and not together, to tell their exponents; {len(values)} measurements do not."
        )
    exponents = np.zeros(2)
    logs = np.log(values)
    exponents[varied] = np.linalg.lstsq(centred[:, varied], logs - logs.mean(), rcond=None)[0]
    constant = float(np.exp(logs.mean() - columns.mean(axis=0) @ exponents))
    return Rate(float(exponents[0]), float(exponents[1]), constant)


def _measurements(
    delta: ArrayLike, t: ArrayLike, measured: ArrayLike
) -> tuple[Float[np.ndarray, " q"], ...]:
    named = {"delta": delta, "t": t, "measured": measured}
    rows = [np.atleast_1d(positive_values(value, name)) for name, value in named.items()]
    counts = [len(row) for row in rows]
    if len(set(counts)) > 1:
        raise InvalidParameterError(
            f"delta, t and measured must be equally many; they are {counts}."
        )
    return tuple(rows)
