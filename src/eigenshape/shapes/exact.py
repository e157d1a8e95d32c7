"""Eigenvalues of Δ that are known exactly, ascending, each as often as its multiplicity says, in 1/length²."""

from collections.abc import Callable, Sequence
from functools import partial
from math import isqrt
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.special import comb, eval_legendre, jn_zeros, jnp_zeros, spherical_jn

from eigenshape._arrays import positive_values, real_numbers, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.operators.boundary import Condition

GAUSS = 600  # nodes: enough for degree 300 over the whole sphere
NEGLIGIBLE = 60.0  # exp(-60) is far below rounding
MOST_HARMONICS = 10**5
HIGHEST = 1000  # frequency along a period: (2 · 1000 + 1)² of them are looked at, 64 MB of numbers


def sphere_eigenvalues(k: SupportsIndex, dim: SupportsIndex = 2) -> Float[np.ndarray, " k"]:
    """Return l(l + m - 1) of the unit m-sphere, for l = 0, 1, ...; on the 2-sphere each 2l + 1 times.

    The multiplicity is that of harmonic polynomials of degree l in m + 1 variables (Chavel 1984, II.4).
    """
    count, m = whole_number(k, "k", 1, None), whole_number(dim, "dim", 1, 20)
    values: list[float] = []
    degree = 0
    while len(values) < count:
        copies = comb(m + degree, m, exact=True) - (
            comb(m + degree - 2, m, exact=True) if degree > 1 else 0
        )
        values += [float(degree * (degree + m - 1))] * copies
        degree += 1
    return np.array(values[:count])


@one_blas_thread()
def sphere_functional_eigenvalues(k: SupportsIndex, t: float) -> Float[np.ndarray, " k"]:
    """Return the first k eigenvalues of the functional approximation 𝓛_t on the unit sphere (thesis eq. 3.1).

    A kernel of the distance multiplies all harmonics of one degree by one number (Funk and Hecke). With
    |x - y|² = 2 - 2s and u = (1 - s)/2t that of 𝓛_t is (1/t) ∫ exp(-u) (1 - P_l(1 - 2tu)) du from 0 to 1/t, taken by
    Gauss' rule up to where exp(-u) is below rounding.

    Parameters
    ----------
    k : int
    t : float
        Heat time, in squared radii.

    Returns
    -------
    (k,) float
        In the order of `sphere_eigenvalues`, which they tend to as t → 0. Not always ascending: for large degrees they
        come near their limit (1 - exp(-1/t))/t from both sides.

    Raises
    ------
    InvalidParameterError
        If k is not in range, or t not positive.
    """
    count, time = whole_number(k, "k", 1, MOST_HARMONICS), float(positive_values(t, "t")[0])
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    reach = min(1 / time, NEGLIGIBLE) / 2
    u = reach * (nodes + 1)
    degrees = np.arange(isqrt(count - 1) + 1)
    missing = 1 - eval_legendre(degrees[:, None], 1 - 2 * time * u)
    values = missing @ (reach * weights * np.exp(-u)) / time
    return np.repeat(values, 2 * degrees + 1)[:count]


def projective_plane_eigenvalues(k: SupportsIndex) -> Float[np.ndarray, " k"]:
    """Return l(l + 1) for even l, each 2l + 1 times: the unit sphere with antipodes made one."""
    count = whole_number(k, "k", 1, None)
    degrees = 2 * np.arange(isqrt(count) + 1)  # up to even l there are (l + 1)(l + 2) / 2
    return np.repeat(degrees * (degrees + 1.0), 2 * degrees + 1)[:count]


def box_eigenvalues(
    k: SupportsIndex, sides: Sequence[float] = (1.0, 1.0), condition: Condition = "neumann"
) -> Float[np.ndarray, " k"]:
    """Return π² Σ (p_i / a_i)² of a box with sides a_i: an interval, a rectangle, and so on.

    p_i = 0, 1, ... with the Neumann condition, and 1, 2, ... with Dirichlet's.
    """
    count, lengths = whole_number(k, "k", 1, None), positive_values(list(sides), "sides")
    first = int(_require_condition(condition) == "dirichlet")
    frequencies = [(np.arange(first, first + count) / length) ** 2 for length in lengths]
    sums = frequencies[0]
    for others in frequencies[1:]:
        sums = _lowest_sums(sums, others)
    return np.pi**2 * sums


def _lowest_sums(
    one: Float[np.ndarray, " k"], two: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Return the k lowest sums of one number of each of two ascending lists of k.

    The sum of the i-th and the j-th has i·j sums that are no higher, itself among them: where that is over k, it need
    not be formed.
    """
    count = len(one)
    return np.sort(np.concatenate([one[: count // j] + two[j - 1] for j in range(1, count + 1)]))[
        :count
    ]


def flat_torus_eigenvalues(k: SupportsIndex, periods: ArrayLike) -> Float[np.ndarray, " k"]:
    """Return 4π² |ξ|² over the frequencies ξ that are whole on both periods, the rows of a 2 x 2 matrix."""
    count, rows = whole_number(k, "k", 1, None), real_numbers(periods, "periods").astype(np.float64)
    if rows.shape != (2, 2) or not np.isfinite(rows).all():
        raise InvalidParameterError(
            f"periods must be a finite 2 x 2 matrix; they are {rows.tolist()}."
        )
    reach = np.ceil(np.sqrt(count) * np.linalg.cond(rows)) + 1
    if not reach <= HIGHEST:
        raise InvalidParameterError(
            f"periods must span a plane and not be too slim for k; {count} eigenvalues of {rows.tolist()} ask for "
            f"frequencies up to {reach:.0e}, over {HIGHEST}."
        )
    lattice = np.linalg.inv(rows).T
    steps = np.arange(-reach, reach + 1)
    modes = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return 4 * np.pi**2 * np.sort(((modes @ lattice) ** 2).sum(axis=1))[:count]


def disc_eigenvalues(k: SupportsIndex, condition: Condition = "neumann") -> Float[np.ndarray, " k"]:
    """Return the squared zeros of Bessel functions J_p, or of their derivatives, twice where p > 0: the unit disc."""
    count = whole_number(k, "k", 1, 10_000)
    zeros = jn_zeros if _require_condition(condition) == "dirichlet" else jnp_zeros
    values = [0.0] if condition == "neumann" else []
    order, radial = 0, int(count**0.5) + 4  # more zeros of one order than lie so low
    while True:
        found = zeros(order, radial) ** 2
        values = sorted([*values, *np.repeat(found, 2 if order else 1)])[: count + 1]
        order += 1
        # The least zero grows with the order from p = 1 on; J_0' alone starts beyond J_1'.
        if order > 2 and len(values) > count and found[0] > values[count]:
            return np.array(values[:count])


def ball_eigenvalues(k: SupportsIndex, condition: Condition = "neumann") -> Float[np.ndarray, " k"]:
    """Return the squared zeros of spherical Bessel functions j_l, or of their derivatives, each 2l + 1 times."""
    count = whole_number(k, "k", 1, 2_000)
    derivative = _require_condition(condition) == "neumann"
    values = [0.0] if derivative else []
    degree = 0
    while True:
        found = _zeros(partial(spherical_jn, degree, derivative=derivative), degree, count) ** 2
        values = sorted([*values, *np.repeat(found, 2 * degree + 1)])[: count + 1]
        degree += 1
        if degree > 2 and len(values) > count and found[0] > values[count]:
            return np.array(values[:count])


def _zeros(function: Callable[[float], float], start: int, count: int) -> Float[np.ndarray, " z"]:
    """Return positive zeros of an oscillation whose zeros lie about π apart, beyond the place where it sets in."""
    grid = np.arange(max(0.5, 0.5 * start), start + np.pi * (count ** (1 / 2) + 4) * 2, 0.1)
    signs = np.sign([function(x) for x in grid])
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    return np.array(
        [brentq(function, grid[place], grid[place + 1], xtol=1e-14) for place in changes]
    )


def _require_condition(condition: str) -> str:
    if condition not in ("neumann", "dirichlet"):
        raise InvalidParameterError(
            f"condition must be 'neumann' or 'dirichlet'; it is {condition!r}."
        )
    return condition
