"""Boundary conditions, by the points where functions are held at zero.

Every operator here has the Neumann condition by itself: what is not held is free. Holding the whole boundary gives the
Dirichlet condition, a part of it the mixed one.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_type
from eigenshape._arrays import as_array
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.operators.laplacian import Laplacian

Condition = Literal["neumann", "dirichlet"]


def dirichlet_laplacian(
    laplacian: Laplacian, fixed: ArrayLike
) -> tuple[Laplacian, Int[np.ndarray, " free"]]:
    """Cut an operator down to the functions that are zero at the fixed points.

    Parameters
    ----------
    laplacian : Laplacian
    fixed : (c,) int
        Points, each once or more; `boundary_vertices(mesh)` for the whole boundary of a mesh.

    Returns
    -------
    inner : Laplacian
        On the free points: rows of W no longer sum to zero, and W is positive definite on each component that has a
        fixed point.
    free : (n - c,) int
        The free points, ascending: row i of `inner` is point free[i].

    Raises
    ------
    InvalidParameterError
        If a fixed point is out of range, or none is free.
    """
    require_type(laplacian, Laplacian, "laplacian")
    points = np.atleast_1d(as_array(fixed, "fixed"))
    if points.size and points.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"fixed must be a list of point numbers; the type of its entries is {points.dtype}. "
            f"Pass np.flatnonzero(mask) for a mask."
        )
    bad = np.flatnonzero((points < 0) | (points >= laplacian.n_points))
    if bad.size:
        raise InvalidParameterError(
            f"fixed must hold points 0..{laplacian.n_points - 1}; entry {bad[0]} is {points[bad[0]]}."
        )
    free = np.setdiff1d(np.arange(laplacian.n_points), points)
    if not free.size:
        raise InvalidParameterError(f"Some point must be free; all {laplacian.n_points} are fixed.")
    cut = {name: getattr(laplacian, name)[free][:, free] for name in ("stiffness", "mass")}
    return replace(laplacian, **cut), free
