"""Rates at which eigenvalues change, as powers of the closeness δ and the heat time t."""

from dataclasses import dataclass
from math import e, exp, lgamma, pi, sqrt

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.typing import ArrayLike, Integer

THEOREMS = ("3.1.1", "3.1.3", "3.1.4", "3.1.5", "4.1.1", "4.3.1", "lipschitz", "dense")
# Largest dimension m of a manifold. The constants are finite far beyond, but no data reach there.
MOST_DIM = 100


@dataclass(frozen=True)
class Rate:
    """A power law: constant · δ^`delta` · t^`t`.

    Attributes
    ----------
    delta, t : float
        Exponents of the closeness and of the heat time.
    constant : float
        The factor; 1 if the theorem does not give it.

    See Also
    --------
    theorem_rate : Rates that theorems prove.

    Examples
    --------
    >>> import eigenshape as es
    >>> float(es.stability.Rate(delta=1, t=-0.5, constant=2).at(3, 4))
    3.0
    """

    delta: float
    t: float
    constant: float = 1.0

    _repr_html_ = html_repr

    def at(self, delta: ArrayLike, t: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the value of the law at each closeness and heat time.

        Parameters
        ----------
        delta, t : float, or arrays that broadcast
            Closeness and heat time.
        """
        return np.asarray(self.constant * np.asarray(delta) ** self.delta * np.asarray(t) ** self.t)


def theorem_rate(theorem: str, dim: Integer) -> Rate:
    """Return the rate that a theorem proves for the distance of eigenvalues on m-manifolds.

    - "3.1.1": t^(2/(m+6)) between Δ and the functional approximation 𝓛_t (Belkin and Niyogi 2008).
    - "3.1.3": ε t^-(m/2+3) between 𝓛_t and the mesh Laplacian of an ε-approximation; δ stands for
      ε.
    - "3.1.4": δ t^-(m/4+2), the Hausdorff distance between the spectra of 𝓛_t on two δ_H-close
      manifolds.
    - "3.1.5": δ^(8/(m²+14m+56)) between the eigenvalues of Δ on such manifolds: 3.1.1 and 3.1.4 at
      the t at which they are equal.
    - 3.1.6 has no rate: the eigenvalues of mesh Laplacians on such meshes converge to each other if
      t and the bounds of 3.1.3 and 3.1.4 tend to 0.
    - "4.1.1", "4.3.1": δ^(4/5) t^-(m/2+7/5) between Gaussian graph Laplacians of points at most δ
      apart one by one; δ^(1/3) if t ≥ δ^(14/(15m+42)). 4.1.1 is for random samples of δ-close
      manifolds.
    - "lipschitz": δ t^-(m/2+3/2), with its constant; derived here for the same situation. A
      Gaussian exp(-r²/4t) changes by at most e^(-1/2)/√(2t) per unit of r, and r by at most 2δ. The
      rows of D = L_P - L_Q sum to 0, and the entries off the diagonal are at most the change
      divided by n, so ‖D‖₂ ≤ ‖D‖_∞ ≤ 4δ e^(-1/2)/√(2t) / (t (4πt)^(m/2)). By Weyl's theorem it
      bounds every eigenvalue, at any t. It is (δ²/t)^(1/10) times the rate of 4.3.1, so it is
      smaller if t > δ².
    - "dense": δ t^(-3/2), derived here: the limit of "lipschitz" for points that sample a manifold
      of volume 1 densely, with δ ≪ √t ≪ 1/curvature. A row then sums to an integral, instead of n
      times its largest term. The mean slope of a Gaussian is Γ((m+1)/2)/Γ(m/2)/√t, so ‖D‖₂ ≤ 4δ
      Γ((m+1)/2)/Γ(m/2) t^(-3/2).

    Parameters
    ----------
    theorem : str
        One of `THEOREMS`: "3.1.1", "3.1.3", "3.1.4", "3.1.5", "4.1.1", "4.3.1", "lipschitz" or
        "dense".
    dim : int
        Dimension m of the manifolds, 1 to 100.

    Returns
    -------
    Rate

    Raises
    ------
    InvalidParameterError
        If the theorem is unknown, or `dim` is not in 1..100.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.stability.theorem_rate("3.1.4", dim=2)
    Rate(delta=1.0, t=-2.5, constant=1.0)
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
