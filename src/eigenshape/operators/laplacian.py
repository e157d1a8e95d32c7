"""The one form that every discretisation of the Laplace operator takes."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from eigenshape._errors import InvalidParameterError
from eigenshape.operators.csr_loops import worst_asymmetry

ASYMMETRY = 1e-12  # relative to the largest entry: what rounding may leave


@dataclass(frozen=True)
class GaussianKernel:
    """The Gaussian kernel exp(-|x - y|²/4t) / (4πt)^{m/2} that an operator was built with.

    Such an operator stands for (1 - e^{-tΔ})/t, exactly so on flat space: its eigenvalue for λ is (1 - e^{-tλ})/t.

    Attributes
    ----------
    t : float
        Heat time, in length².
    edge_factor : float
        h / e: the width h = 2√t over the mean edge length e, on points the mean distance to near neighbours.
    corrected : bool
        Whether solvers report λ = -log(1 - t μ)/t for an eigenvalue μ of the pencil, which takes that bias away.
    form : "literal" or "random-walk"
        Whether the mass of a point is its own measure, or what the kernel sees of the measure there.
    cutoff : float
        Distance, in widths h, beyond which the kernel is taken for zero.
    volume : float
        What eigenvalues are over: 1 where weights are in length^m; where they are 1/n, the volume of the manifold in
        length^m, as the kernel sees it.
    """

    t: float
    edge_factor: float
    corrected: bool = False
    form: str = "literal"
    cutoff: float = 4.0
    volume: float = 1.0

    @property
    def width(self) -> float:
        """H = 2√t, in length."""
        return 2 * self.t**0.5


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
    kernel : GaussianKernel, optional
        What operators made from a Gaussian kernel keep of it.

    Raises
    ------
    InvalidParameterError
        If W and B are not sparse, square and of one size, an entry is not finite, the matrix not symmetric, or a
        diagonal entry of B not positive. (Whether W is semidefinite and B definite, the eigensolver finds out.)
    """

    stiffness: sp.csr_array
    mass: sp.csr_array
    kernel: GaussianKernel | None = None

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass"):
            object.__setattr__(self, name, _checked(name, getattr(self, name)))
        if self.stiffness.shape != self.mass.shape:
            raise InvalidParameterError(
                f"stiffness and mass must have one shape; the shapes are {self.stiffness.shape} and {self.mass.shape}."
            )
        diagonal = self.mass.diagonal()
        bad = np.flatnonzero(diagonal <= 0)
        if bad.size:
            raise InvalidParameterError(
                f"mass must be positive; the mass of point {bad[0]} is {diagonal[bad[0]]} ({bad.size} such)."
            )

    @property
    def n_points(self) -> int:
        """Number of points n that the operator acts on."""
        return int(self.stiffness.shape[0])


def _checked(name: str, value: sp.sparray) -> sp.csr_array:
    _require_square(name, value)
    matrix = sp.csr_array(value, dtype=np.float64)
    if not matrix.has_canonical_format:
        matrix = matrix.copy()  # else duplicates would be summed in the caller's own arrays
        matrix.sum_duplicates()
    _require_finite(name, matrix)
    _require_symmetric(name, matrix)
    return matrix


def _require_square(name: str, matrix: sp.sparray) -> None:
    if not sp.issparse(matrix) or matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise InvalidParameterError(
            f"{name} must be a square sparse matrix; it is a {type(matrix).__name__} of shape {np.shape(matrix)}."
        )


def _require_finite(name: str, matrix: sp.csr_array) -> None:
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        entries = matrix.tocoo()
        row, column = entries.row[bad[0]], entries.col[bad[0]]
        raise InvalidParameterError(
            f"{name} must be finite; entry ({row}, {column}) is {entries.data[bad[0]]} ({bad.size} such)."
        )


def _require_symmetric(name: str, matrix: sp.csr_array) -> None:
    # One type of indices where they fit, whatever SciPy chose: the loop is compiled once.
    kind = np.int32 if max(matrix.shape[0], matrix.nnz) < 2**31 else np.int64
    starts, columns = (each.astype(kind, copy=False) for each in (matrix.indptr, matrix.indices))
    worst, row, column = worst_asymmetry(starts, columns, matrix.data)
    if worst > ASYMMETRY * max(matrix.data.max(initial=0.0), -matrix.data.min(initial=0.0)):
        raise InvalidParameterError(
            f"{name} must be symmetric; entry ({row}, {column}) is {matrix[row, column]} "
            f"and entry ({column}, {row}) is {matrix[column, row]}."
        )
