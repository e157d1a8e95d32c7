"""Exact eigenfunctions of Δ, in the order of their eigenvalues in `shapes.exact`."""

from math import isqrt

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import freeze, whole_number
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import unit_vectors

# Degrees up to 316. Beyond degree 1400 the functions divided by (1 - z²)^{m/2} overflow.
MOST_HARMONICS = 10**5


def sphere_harmonics(points: ArrayLike, k: Integer) -> Float[np.ndarray, "n k"]:
    """Evaluate real spherical harmonics: eigenfunctions of the unit sphere.

    The functions are orthonormal with respect to area. Y_l^0 = N P_l(z), and Y_l^±m = √2 N P_l^m(z)
    times cos mφ for +m and sin mφ for -m.

    Parameters
    ----------
    points : (n, 3) float
        Points in any length unit; only their directions from the origin count.
    k : int
        Number of functions, 1 to 100,000. Function l² + l + m has degree l, order m = -l..l and the
        eigenvalue l(l + 1), as in `sphere_eigenvalues`.

    Returns
    -------
    (n, k) float
        Values on the unit sphere. On a sphere of radius r divide them by r.

    Raises
    ------
    InvalidParameterError
        If `k` is out of range.
    InvalidShapeError
        If a point is not finite or is the origin.

    See Also
    --------
    sphere_eigenvalues : The eigenvalues.

    Notes
    -----
    The normalized associated Legendre functions come from their recurrence upwards in l, which is
    stable (Press and others 2007, section 6.7).

    Examples
    --------
    The first function is constant, 1/√(4π).

    >>> import eigenshape as es
    >>> es.shapes.sphere_harmonics([[1, 0, 0], [0, 0, 1]], 1).round(4).tolist()
    [[0.2821], [0.2821]]
    """
    count = whole_number(k, "k", 1, MOST_HARMONICS)
    rows = finite_rows(points, "points", 3)
    sizes = np.abs(rows).max(axis=1, initial=0.0)
    origin = np.flatnonzero(sizes == 0)
    if origin.size:
        raise InvalidShapeError(
            f"points must have a direction from the origin; point {origin[0]} is the origin."
        )
    # Scale each point to size 1 first: squares of tiny or huge coordinates underflow or overflow.
    rows = np.ldexp(rows, -np.frexp(sizes)[1][:, None])
    x, y, z = unit_vectors(rows).T
    last = isqrt(count - 1)
    harmonics = np.empty((len(rows), (last + 1) ** 2))
    turn = x + 1j * y
    power, top = np.ones(len(rows), dtype=np.complex128), (4 * np.pi) ** -0.5
    for order in range(last + 1):
        if order:
            power = power * turn
            top *= ((2 * order + 1) / (2 * order)) ** 0.5
        # N P_l^m(z) / (1 - z²)^{m/2} for each degree l, from its value `top` for l = m upwards.
        legendre = np.empty((last - order + 1, len(rows)))
        legendre[0] = top
        if order < last:
            legendre[1] = (2 * order + 3) ** 0.5 * z * top
        for degree in range(order + 2, last + 1):
            ahead = ((4 * degree**2 - 1) / (degree**2 - order**2)) ** 0.5
            behind = (((degree - 1) ** 2 - order**2) / (4 * (degree - 1) ** 2 - 1)) ** 0.5
            before, nearest = legendre[degree - order - 2 : degree - order]
            legendre[degree - order] = ahead * (z * nearest - behind * before)
        values = (2**0.5 if order else 1.0) * legendre.T
        degrees = np.arange(order, last + 1)
        harmonics[:, degrees * (degrees + 1) - order] = values * power.imag[:, None]
        harmonics[:, degrees * (degrees + 1) + order] = values * power.real[:, None]
    return freeze(harmonics[:, :count])
