"""The one form that every discretisation of the Laplace operator takes."""

from dataclasses import dataclass

import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class Laplacian:
    """A discrete Laplace operator L = B⁻¹W, positive, as the pencil (W, B).

    W φ = λ B φ with λ ≥ 0: the sign is that of -div grad (thesis 1.1, eq. 1.1: b_i = B_ii, w_ij = -W_ij).

    Parameters
    ----------
    stiffness : (n, n) sparse
        W: symmetric, positive semidefinite, W·1 = 0.
    mass : (n, n) sparse
        B: symmetric, positive definite, in length^m; diagonal where it is lumped. Functions f and g have the
        inner product fᵀBg (thesis eq. 1.2).
    """

    stiffness: sp.csr_array
    mass: sp.csr_array

    @property
    def n_points(self) -> int:
        """Number of points n that the operator acts on."""
        return int(self.stiffness.shape[0])
