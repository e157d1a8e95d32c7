"""Factors of the definite systems of a shape, whose singularity means simplices that are too thin.

`LinearSolver` is for the systems of users: it checks its pivots and right-hand sides at each call.
Here matrices and right-hand sides are built inside, and the remedy is a repair of the mesh.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from eigenshape._errors import InvalidShapeError
from eigenshape._text import html_repr, short_repr
from eigenshape.sparse.symmetric_factor import SymmetricFactor, factor_matrix


@dataclass(frozen=True, eq=False)
class GroundedFactor:
    """A stiffness matrix, factored with fixed points and one point of each component at 0.

    `factorize_grounded` makes it.

    Attributes
    ----------
    components : (n,) int
        Connected component of each point.
    free : (f,) int
        The points that the factor solves for.
    factor : SymmetricFactor, optional
        None if no point is free.
    """

    components: Int[np.ndarray, " n"]
    free: Int[np.ndarray, " f"]
    factor: SymmetricFactor | None

    __repr__ = short_repr
    _repr_html_ = html_repr

    def solve(self, loads: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Solve W x = loads, which sum to 0 on each component without a fixed point."""
        solution = np.zeros(loads.shape)
        if self.factor is not None:
            solution[self.free] = self.factor.solve(loads[self.free])
        return solution


def factorize_definite(matrix: sp.sparray) -> SymmetricFactor:
    """Factor a symmetric positive definite matrix.

    Raise InvalidShapeError if rounding makes a pivot vanish, as it may where simplices are
    extremely thin.
    """
    factor = factor_matrix(matrix)
    if factor is None:
        raise InvalidShapeError(
            "Simplices must have angles well above 0 for the equations to be factored; some are "
            'too thin. Try repair(mesh, ["collapse_needles"]), or robust=True for triangles.'
        )
    return factor


def factorize_grounded(
    stiffness: sp.csr_array, fixed: Bool[np.ndarray, " n"] | None = None
) -> GroundedFactor:
    """Factor W with x = 0 at fixed points, and at the first point of each component without one.

    Errors are those of `factorize_definite`.
    """
    _, components = connected_components(stiffness, directed=False)
    _, firsts = np.unique(components, return_index=True)
    zero = np.zeros(len(components), dtype=bool) if fixed is None else fixed.copy()
    has_fixed = np.isin(components[firsts], components[zero])
    zero[firsts[~has_fixed]] = True
    free = np.flatnonzero(~zero)
    factor = factorize_definite(stiffness[free][:, free]) if free.size else None
    return GroundedFactor(components.astype(np.int64), free, factor)
