"""Boundary conditions, by the points where functions are held at zero.

Every operator here has the Neumann condition by itself: what is not held is free. Holding the whole boundary gives the
Dirichlet condition, a part of it the mixed one.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian

Condition = Literal["neumann", "dirichlet"]


def dirichlet_laplacian(
    laplacian: Laplacian, fixed: Int[np.ndarray, " c"]
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
    bad = np.flatnonzero((fixed < 0) | (fixed >= laplacian.n_points))
    if bad.size:
        raise InvalidParameterError(
            f"fixed must hold points 0..{laplacian.n_points - 1}; entry {bad[0]} is {fixed[bad[0]]}."
        )
    free = np.setdiff1d(np.arange(laplacian.n_points), fixed)
    if not free.size:
        raise InvalidParameterError(f"Some point must be free; all {laplacian.n_points} are fixed.")
    cut = {name: getattr(laplacian, name)[free][:, free] for name in ("stiffness", "mass")}
    return replace(laplacian, **cut), free
