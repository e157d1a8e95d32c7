"""Symmetric factors of W - σB, and what their pivots count."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import record
from certeig.solver.pencil import Pencil
from certeig.sparse.symmetric_factor import SymmetricFactor


@record
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
    lower : SymmetricFactor
        L and D.
    """

    shift: float
    count: int
    slack: Float[np.ndarray, " n"]
    lower: SymmetricFactor

    @classmethod
    def at(
        cls,
        pencil: Pencil,
        shift: float,
        slack: Float[np.ndarray, " n"] | None = None,
        spent: "Factor | None" = None,
    ) -> "Factor | None":
        """Factor W - σB - S, S = diag(slack), pivots on the diagonal; None where one is zero or not finite.

        A factor of the same pencil that is spent gives its room: what it solved before, it solves no
        more.
        """
        slack = np.zeros(pencil.n) if slack is None else slack
        pattern = pencil.shift_pattern
        data = pattern.stiffness - shift * pattern.mass
        data[pattern.diagonal] -= slack
        lower = SymmetricFactor.of_entries(
            pattern.elimination, data, pattern.memory, spent.lower if spent else None
        )
        return cls(shift, lower.n_negative, slack, lower) if lower else None

    def solve(self, right: Float[np.ndarray, "n b"]) -> Float[np.ndarray, "n b"]:
        """Solve (W - σB - S) x = right."""
        return self.lower.solve(right)

    def rounding(self) -> Float[np.ndarray, " n"]:
        """Bound the rounding of a factor, row by row.

        By Sylvester's law of inertia D has as many negative entries as L D Lᵀ has negative eigenvalues.
        That matrix is W - σB - S + E with |xᵀEx| ≤ Σ r_i x_i², and r is returned. So where S ≥ r, L D
        Lᵀ is nowhere above W - σB, and `count` is at least the number of eigenvalues below σ,
        whatever the rounding.
        """
        return self.lower.rounding()
