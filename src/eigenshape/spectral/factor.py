"""Symmetric factors of W - σB, and what their pivots count."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import SuperLU, splu

from eigenshape.spectral.pencil import SYMMETRIC_MODE, Pencil

EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Factor:
    """W - σB - S = L D Lᵀ up to rounding, with S diagonal and small.

    Attributes
    ----------
    shift : float
        σ, in the pencil's units.
    count : int
        Negative entries of D.
    slack : (n,) float
        The diagonal of S.
    lu : SuperLU
        L and U = D Lᵀ, both with rows in the order of `lu.perm_r`.
    """

    shift: float
    count: int
    slack: Float[np.ndarray, " n"]
    lu: SuperLU

    def solve(self, right: Float[np.ndarray, "n b"]) -> Float[np.ndarray, "n b"]:
        """Solve (W - σB - S) x = right."""
        return np.asarray(self.lu.solve(right))


def factorise(pencil: Pencil, shift: float, slack: Float[np.ndarray, " n"] | None = None) -> Factor | None:
    """Factor W - σB - S, S = diag(slack), pivots on the diagonal; None where one is zero or left the diagonal."""
    slack = np.zeros(pencil.n) if slack is None else slack
    matrix = pencil.stiffness - shift * pencil.mass - sp.diags_array(slack)
    try:
        lu = splu(sp.csc_array(matrix), **SYMMETRIC_MODE)
    except RuntimeError:  # SuperLU's word for a pivot of exactly zero
        return None
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    return Factor(shift, int(np.count_nonzero(lu.U.diagonal() < 0)), slack, lu)


def rounding(factor: Factor) -> Float[np.ndarray, " n"]:
    """Bound the rounding of a factor, row by row.

    By Sylvester's law of inertia D has as many negative entries as L D Lᵀ has negative eigenvalues. That matrix is
    W - σB - S + E with |xᵀEx| ≤ Σ r_i x_i², and r is returned. So where S ≥ r, L D Lᵀ is nowhere above W - σB, and
    `factor.count` is at least the number of eigenvalues below σ, whatever the rounding.
    """
    # L D Lᵀ - A = (LU - A) - L (U - D Lᵀ). The first is at most m_i eps (|L||U|)_ij with m_i terms in row i of L
    # (Higham 2002, theorem 9.3; four more terms for forming A and for what is formed here). The second is there
    # because SuperLU computes L and U each on its own, and is measured. A symmetric matrix lies, as a quadratic form,
    # between plus and minus the diagonal one of the row sums of its sizes.
    lower, upper = factor.lu.L, factor.lu.U
    scaled = lower.copy()
    scaled.data *= np.repeat(upper.diagonal(), np.diff(lower.indptr))
    uneven = abs(sp.csc_array(upper.T) - scaled).sum(axis=0)
    sizes = abs(lower)
    terms = np.bincount(lower.indices, minlength=lower.shape[0]) + 4
    rows = EPS * terms * (sizes @ (abs(upper) @ np.ones(len(terms)))) + sizes @ uneven
    return np.asarray(rows[factor.lu.perm_r])
