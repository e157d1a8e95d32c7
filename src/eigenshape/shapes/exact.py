"""Exact eigenvalues of Δ, ascending and repeated by multiplicity, in 1/length²."""

from collections.abc import Callable, Sequence
from functools import partial
from math import isqrt

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.special import comb, eval_legendre, jn_zeros, jnp_zeros, spherical_jn

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import positive_number, positive_values, real_numbers, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.operators.choices import Condition

# Nodes of the Gauss rule of `sphere_functional_eigenvalues`: enough for harmonics of degree 300
# over the whole sphere.
N_GAUSS_NODES = 600
# The integral of exp(-u) ends here: exp(-60) is 1e-26, far below rounding.
NEGLIGIBLE_EXPONENT = 60.0
MOST_EIGENVALUES = 10**7  # of shapes that have a formula: 80 MB, and some times as much meanwhile
MOST_HARMONICS = 10**5  # up to degree 316, which N_GAUSS_NODES is made for
# Frequencies of a flat torus are looked for up to this number along each period: (2·1000 + 1)²
# pairs of them take 64 MB.
MOST_FREQUENCY = 1000


def sphere_eigenvalues(k: Integer, dim: Integer = 2) -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of the unit m-sphere: l(l + m - 1) for l = 0, 1, ...

    The multiplicity is the number of harmonic polynomials of degree l in m + 1 variables (Chavel
    1984, II.4); on the 2-sphere it is 2l + 1.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 10,000,000.
    dim : int
        Dimension m of the sphere, 1 to 20; 1 for a circle.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range, or `dim` is not in 1..20.

    See Also
    --------
    sphere_harmonics : The eigenfunctions on the 2-sphere.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.sphere_eigenvalues(5).tolist()
    [0.0, 2.0, 2.0, 2.0, 6.0]
    """
    count, m = _eigenvalue_number(k), whole_number(dim, "dim", 1, 20)
    values: list[float] = []
    degree = 0
    while len(values) < count:
        copies = comb(m + degree, m, exact=True) - comb(m + degree - 2, m, exact=True)
        values += [float(degree * (degree + m - 1))] * copies
        degree += 1
    return np.array(values[:count])


@one_blas_thread()
def sphere_functional_eigenvalues(k: Integer, t: float) -> Float[np.ndarray, " k"]:
    """Return eigenvalues of the functional Laplacian 𝓛_t on the unit sphere (thesis eq. 3.1).

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 100,000.
    t : float
        Heat time, in squared radii.

    Returns
    -------
    (k,) float
        Eigenvalues in the order of `sphere_eigenvalues`, to which they converge as t → 0. They are
        not always ascending: for large degrees they approach their limit (1 - exp(-1/t))/t from
        both sides.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range or `t` is not positive.

    See Also
    --------
    functional_laplacian : The operator 𝓛_t on a quadrature.

    Notes
    -----
    A kernel that depends only on the distance multiplies all harmonics of one degree by one number
    (Funk and Hecke). With |x - y|² = 2 - 2s and u = (1 - s)/2t the eigenvalue of 𝓛_t for degree l is
    (1/t) ∫ exp(-u) (1 - P_l(1 - 2tu)) du from 0 to 1/t. The integral is computed by a Gauss rule up
    to where exp(-u) is below rounding.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.sphere_functional_eigenvalues(4, 0.01).round(4).tolist()
    [0.0, 2.0, 2.0, 2.0]
    """
    count, time = whole_number(k, "k", 1, MOST_HARMONICS), positive_number(t, "t")
    nodes, weights = np.polynomial.legendre.leggauss(N_GAUSS_NODES)
    reach = min(1 / time, NEGLIGIBLE_EXPONENT) / 2
    u = reach * (nodes + 1)
    degrees = np.arange(isqrt(count - 1) + 1)
    missing = 1 - eval_legendre(degrees[:, None], 1 - 2 * time * u)
    values = missing @ (reach * weights * np.exp(-u)) / time
    return np.repeat(values, 2 * degrees + 1)[:count]


def projective_plane_eigenvalues(k: Integer) -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of the projective plane: l(l + 1) for even l, each 2l + 1 times.

    The projective plane is the unit sphere with antipodes identified.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 10,000,000.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range.

    See Also
    --------
    projective_plane : A mesh of the projective plane.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.projective_plane_eigenvalues(7).tolist()
    [0.0, 6.0, 6.0, 6.0, 6.0, 6.0, 20.0]
    """
    count = _eigenvalue_number(k)
    degrees = 2 * np.arange(isqrt(count) + 1)  # up to even l there are (l + 1)(l + 2) / 2
    return np.repeat(degrees * (degrees + 1.0), 2 * degrees + 1)[:count]


def box_eigenvalues(
    k: Integer, sides: Sequence[float] = (1.0, 1.0), condition: Condition = "neumann"
) -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of a box: an interval, a rectangle, a cuboid and so on.

    The eigenvalues are π² Σ (p_i / a_i)² with sides a_i and integers p_i, which start at 0 for the
    Neumann condition and at 1 for the Dirichlet condition.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 10,000,000.
    sides : sequence of float
        Lengths of the sides; their number is the dimension.
    condition : "neumann" or "dirichlet"
        Boundary condition.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range, a side is not positive, or the condition is unknown.

    See Also
    --------
    interval, grid, box : Meshes of boxes.

    Examples
    --------
    >>> import eigenshape as es
    >>> (es.shapes.box_eigenvalues(4, [1, 1]) / 3.141592653589793**2).round(6).tolist()
    [0.0, 1.0, 1.0, 2.0]
    """
    count = _eigenvalue_number(k)
    lengths = positive_values(list(sides), "sides")
    require_choice(condition, Condition, "condition")
    first = int(condition == "dirichlet")
    frequencies = [(np.arange(first, first + count) / length) ** 2 for length in lengths]
    sums = frequencies[0]
    for others in frequencies[1:]:
        # Of two ascending lists, the lowest sums: the j-th of one needs few of the other.
        pairs = [sums[: count // j] + others[j - 1] for j in range(1, count + 1)]
        sums = np.sort(np.concatenate(pairs))[:count]
    return np.pi**2 * sums


@one_blas_thread()
def flat_torus_eigenvalues(k: Integer, periods: ArrayLike) -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of a flat torus: 4π² |ξ|² for ξ in the dual lattice.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 10,000,000.
    periods : (2, 2) float
        The two periods of the torus, as rows, in length.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range, the periods are not finite, or they do not span the plane well
        enough for k.

    Examples
    --------
    >>> import eigenshape as es
    >>> values = es.shapes.flat_torus_eigenvalues(5, [[1, 0], [0, 1]])
    >>> (values / (2 * 3.141592653589793) ** 2).round(6).tolist()
    [0.0, 1.0, 1.0, 1.0, 1.0]
    """
    count = _eigenvalue_number(k)
    rows = real_numbers(periods, "periods").astype(np.float64)
    if rows.shape != (2, 2) or not np.isfinite(rows).all():
        raise InvalidParameterError(
            f"periods must be a finite 2 x 2 matrix; they are {rows.tolist()}."
        )
    reach = np.ceil(np.sqrt(count) * np.linalg.cond(rows)) + 1
    if not reach <= MOST_FREQUENCY:
        raise InvalidParameterError(
            "periods must span a plane and must not be too slender for k; "
            f"{count} eigenvalues of {rows.tolist()} need frequencies up to {reach:.0e}, "
            f"more than {MOST_FREQUENCY}."
        )
    lattice = np.linalg.inv(rows).T
    steps = np.arange(-reach, reach + 1)
    modes = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return 4 * np.pi**2 * np.sort(((modes @ lattice) ** 2).sum(axis=1))[:count]


def disc_eigenvalues(k: Integer, condition: Condition = "neumann") -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of the unit disc.

    The eigenvalues are the squared zeros of the Bessel functions J_p for the Dirichlet condition,
    and of their derivatives for the Neumann condition; each occurs twice for p > 0.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 10,000.
    condition : "neumann" or "dirichlet"
        Boundary condition.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range or the condition is unknown.

    See Also
    --------
    disc : A mesh of the disc.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.disc_eigenvalues(3, "dirichlet").round(4).tolist()
    [5.7832, 14.682, 14.682]
    """
    count = whole_number(k, "k", 1, 10_000)
    require_choice(condition, Condition, "condition")
    zeros = jn_zeros if condition == "dirichlet" else jnp_zeros
    # More zeros of each order than can be among the first `count` eigenvalues.
    radial = int(count**0.5) + 4
    return _lowest_squares(
        count,
        condition,
        lambda order: zeros(order, radial),
        lambda order: 2 if order else 1,
    )


def ball_eigenvalues(k: Integer, condition: Condition = "neumann") -> Float[np.ndarray, " k"]:
    """Return the first eigenvalues of the unit ball in R³.

    The eigenvalues are the squared zeros of the spherical Bessel functions j_l for the Dirichlet
    condition, and of their derivatives for the Neumann condition, each 2l + 1 times.

    Parameters
    ----------
    k : int
        Number of eigenvalues, 1 to 2,000.
    condition : "neumann" or "dirichlet"
        Boundary condition.

    Returns
    -------
    (k,) float
        Eigenvalues in 1/length², ascending, repeated by multiplicity.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range or the condition is unknown.

    See Also
    --------
    ball : A mesh of the ball.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.ball_eigenvalues(2, "dirichlet").round(4).tolist()
    [9.8696, 20.1907]
    """
    count = whole_number(k, "k", 1, 2_000)
    require_choice(condition, Condition, "condition")
    derivative = condition == "neumann"
    return _lowest_squares(
        count,
        condition,
        lambda degree: _zeros(partial(spherical_jn, degree, derivative=derivative), degree, count),
        lambda degree: 2 * degree + 1,
    )


def _lowest_squares(
    count: int,
    condition: Condition,
    zeros: Callable[[int], Float[np.ndarray, " z"]],
    copies: Callable[[int], int],
) -> Float[np.ndarray, " k"]:
    """Return the lowest squares of the zeros of Bessel functions of all orders, with copies."""
    values = [0.0] if condition == "neumann" else []
    order = 0
    while True:
        found = zeros(order) ** 2
        values = sorted([*values, *np.repeat(found, copies(order))])[: count + 1]
        order += 1
        # From order 1 on the first zero grows with the order. Only J_0' has a larger one than J_1'.
        if order > 2 and len(values) > count and found[0] > values[count]:
            return np.array(values[:count])


def _zeros(function: Callable[[float], float], start: int, count: int) -> Float[np.ndarray, " z"]:
    """Return positive zeros of an oscillating function, beyond about `start`.

    The zeros must be about π apart.
    """
    grid = np.arange(max(0.5, 0.5 * start), start + np.pi * (count ** (1 / 2) + 4) * 2, 0.1)
    signs = np.sign([function(x) for x in grid])
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    return np.array(
        [brentq(function, grid[place], grid[place + 1], xtol=1e-14) for place in changes]
    )


def _eigenvalue_number(k: Integer) -> int:
    return whole_number(k, "k", 1, MOST_EIGENVALUES, "more eigenvalues would fill the memory")
