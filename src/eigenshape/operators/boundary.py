"""Boundary conditions, by the points at which functions are fixed at zero.

Every operator has the Neumann condition by default: points that are not fixed are free. Fixing the
whole boundary gives the Dirichlet condition, fixing a part of it the mixed one.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_type
from eigenshape._arrays import as_array
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.operators.laplacian import Laplacian


def dirichlet_laplacian(
    laplacian: Laplacian, fixed: ArrayLike
) -> tuple[Laplacian, Int[np.ndarray, " free"]]:
    """Restrict an operator to functions that are zero at some points.

    Parameters
    ----------
    laplacian : Laplacian
    fixed : (c,) int
        Points where functions are zero; duplicates are allowed.
        `es.geometry.boundary_vertices(mesh)` is the whole boundary of a mesh.

    Returns
    -------
    inner : Laplacian
        On the free points. Rows of W no longer sum to zero, and W is positive definite on each
        component that has a fixed point.
    free : (n - c,) int
        The free points, ascending: row i of `inner` is point free[i].

    Raises
    ------
    InvalidParameterError
        If a fixed point is out of range, or no point is free.

    See Also
    --------
    solve_spectrum : Its argument `fixed` solves this operator and returns all points.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = es.shapes.grid(3, 3)
    >>> rim = es.geometry.boundary_vertices(square)
    >>> inner, free = es.operators.dirichlet_laplacian(es.cotangent_laplacian(square), rim)
    >>> inner.n_points, free.tolist()
    (4, [5, 6, 9, 10])
    """
    require_type(laplacian, Laplacian, "laplacian")
    points = require_points(fixed, laplacian.n_points)
    if not points.size:  # a copy of a million rows takes a second
        return laplacian, np.arange(laplacian.n_points)
    free = np.setdiff1d(np.arange(laplacian.n_points), points)
    if not free.size:
        raise InvalidParameterError(
            f"At least one point must be free; all {laplacian.n_points} are fixed."
        )
    cut = {name: getattr(laplacian, name)[free][:, free] for name in ("stiffness", "mass")}
    return replace(laplacian, **cut), free


def require_points(fixed: ArrayLike, n_points: int) -> Int[np.ndarray, " c"]:
    """Return `fixed` as an array of points, in its order and with its duplicates.

    Raises
    ------
    InvalidParameterError
        If an entry is no point number, or out of range.
    """
    points = np.atleast_1d(as_array(fixed, "fixed"))
    if points.size and points.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"fixed must be a list of point numbers; the type of its entries is {points.dtype}. "
            f"Pass np.flatnonzero(mask) for a mask."
        )
    bad = np.flatnonzero((points < 0) | (points >= n_points))
    if bad.size:
        raise InvalidParameterError(
            f"fixed must hold points 0..{n_points - 1}; entry {bad[0]} is {points[bad[0]]}."
        )
    return points.astype(np.int64)
