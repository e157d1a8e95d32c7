"""The one form that every discretization of the Laplace operator takes, and its boundary conditions.

Every operator has the Neumann condition by default: points that are not fixed are free. Fixing the
whole boundary gives the Dirichlet condition, fixing a part of it the mixed one.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly, as_array, record
from eigenshape._errors import InvalidParameterError
from eigenshape._text import html_repr
from eigenshape._typing import ArrayLike


def freeze_sparse(matrix: sp.csr_array) -> sp.csr_array:
    """Return a copy with sorted indices whose arrays are read-only."""
    copy = matrix.copy()
    copy.sum_duplicates()  # sorts, too: SciPy would do so later in place, where it no longer can
    for part in (copy.data, copy.indices, copy.indptr):
        part.flags.writeable = False
    return copy


# Largest difference of W_ij and W_ji, relative to the largest entry, that is accepted as rounding.
ASYMMETRY = 1e-12
# Row sums up to this share of the absolute row sums count as zero: those of stiffness matrices are
# zero up to the rounding of their entries.
ZERO_ROW_SUM = 1e-12


@dataclass(frozen=True)
class GaussianKernel:
    """The Gaussian kernel exp(-|x - y|²/4t) / (4πt)^{m/2} from which an operator was built.

    The operator approximates (1 - e^{-tΔ})/t, exactly on flat space: an eigenvalue λ of Δ becomes
    (1 - e^{-tλ})/t.

    Attributes
    ----------
    t : float
        Heat time, in length².
    edge_factor : float
        h / e, the width h = 2√t over the mean edge length e. On points, e is the mean distance to
        near neighbors.
    corrected : bool
        Whether solvers report λ = -log(1 - t μ)/t for an eigenvalue μ of the pencil, which removes
        that bias.
    form : {"literal", "random-walk"}
        Whether the mass of a point is its own volume, or the volume that the kernel sees there.
    cutoff : float
        Distance, in widths h, beyond which the kernel is set to zero.
    volume : float
        Factor by which eigenvalues are divided: 1 if weights are in length^m; if weights are 1/n,
        the volume of the manifold in length^m, as estimated by the kernel.

    Examples
    --------
    >>> import eigenshape as es
    >>> kernel = es.mesh_laplacian(es.icosphere(2)).kernel
    >>> kernel.edge_factor, kernel.corrected
    (2.0, False)
    """

    t: float
    edge_factor: float
    corrected: bool = False
    form: str = "literal"
    cutoff: float = 4.0
    volume: float = 1.0

    _repr_html_ = html_repr

    @property
    def width(self) -> float:
        """Width h = 2√t of the kernel, in length."""
        return 2 * self.t**0.5


@record
class Laplacian(ReadOnly):
    """A discrete Laplace operator L = B⁻¹W, given by its stiffness and mass matrices.

    The matrices are copied, and the copies are read-only.

    The eigenvalue problem is W φ = λ B φ with λ ≥ 0: the sign is that of -div grad (thesis 1.1,
    eq. 1.1: b_i = B_ii, w_ij = -W_ij).

    Parameters
    ----------
    stiffness : (n, n) sparse
        W, symmetric and positive semidefinite, with W·1 = 0.
    mass : (n, n) sparse
        B, symmetric and positive definite, in length^m; diagonal if it is lumped. The inner product
        of functions f and g is fᵀBg (thesis eq. 1.2).
    kernel : GaussianKernel, optional
        The kernel, if the operator was built from one.

    Raises
    ------
    InvalidParameterError
        If W or B is not sparse, square, finite and symmetric, their sizes differ, or a diagonal
        entry of B is not positive. The eigensolver checks that W is semidefinite and B definite.

    See Also
    --------
    cotangent_laplacian, robust_laplacian, mesh_laplacian, point_cloud_laplacian : Build operators.
    solve_spectrum : Compute eigenvalues and eigenvectors.
    check_operator : Check the laws of an operator of your own.

    Examples
    --------
    Two points joined by a weight of 3, with masses 1 and 2:

    >>> import eigenshape as es
    >>> from scipy.sparse import csr_array
    >>> W = csr_array([[3.0, -3.0], [-3.0, 3.0]])
    >>> B = csr_array([[1.0, 0.0], [0.0, 2.0]])
    >>> laplacian = es.Laplacian(W, B)
    >>> laplacian.n_points
    2
    >>> es.solve_spectrum(laplacian, 2).eigenvalues.round(6).tolist()
    [0.0, 4.5]
    """

    stiffness: sp.csr_array
    mass: sp.csr_array
    kernel: GaussianKernel | None = None

    # A c with B ≥ c diag(B), known from how B was built (`with_mass_floor`). Where it is 0, solvers
    # prove one by a factor of B. It is no field, so that `replace` with another mass forgets it.
    mass_floor = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass"):
            object.__setattr__(self, name, as_symmetric(name, getattr(self, name)))
        if self.stiffness.shape != self.mass.shape:
            raise InvalidParameterError(
                f"stiffness and mass must have the same shape; the shapes are {self.stiffness.shape} and "
                f"{self.mass.shape}."
            )
        diagonal = self.mass.diagonal()
        bad = np.flatnonzero(diagonal <= 0)
        if bad.size:
            raise InvalidParameterError(
                f"mass must be positive; the mass of point {bad[0]} is {diagonal[bad[0]]} ({bad.size} such)."
            )

    @property
    def n_points(self) -> int:
        """Number of points n on which the operator acts."""
        return int(self.stiffness.shape[0])


def with_mass_floor(laplacian: Laplacian, floor: float) -> Laplacian:
    """Note in an operator that is new, and return it, that B ≥ floor · diag(B)."""
    object.__setattr__(laplacian, "mass_floor", floor)
    return laplacian


def find_zero_row_sums(matrix: sp.sparray) -> Bool[np.ndarray, " n"]:
    """Return for each row whether it sums to zero, up to rounding.

    Constants on a component have no energy if all its rows do. Each row is compared with its own
    entries: beside one stiff edge, the rows at a fixed boundary are small and not zero.
    """
    sums, sizes = np.abs(matrix.sum(axis=1)), abs(matrix).sum(axis=1)
    return sums <= ZERO_ROW_SUM * sizes


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
    >>> boundary = es.geometry.boundary_vertices(square)
    >>> inner, free = es.operators.dirichlet_laplacian(es.cotangent_laplacian(square), boundary)
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
    return with_mass_floor(replace(laplacian, **cut), laplacian.mass_floor), free


def require_points(fixed: ArrayLike, n_points: int) -> Int[np.ndarray, " c"]:
    """Return `fixed` as an array of points, in its order and with its duplicates.

    Raise InvalidParameterError if an entry is no point number, or out of range.
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


def require_matrix(laplacian: Laplacian, name: str = "laplacian") -> None:
    """Raise an error if the matrices of an operator are not all of it.

    The correction of a kernel changes eigenvalues after they are computed, so an equation with the
    matrices would silently be that of the uncorrected operator.
    """
    if laplacian.kernel is not None and laplacian.kernel.corrected:
        raise InvalidParameterError(
            f"{name} must be given by its matrices alone; it has correct='log', which changes "
            "eigenvalues after they are computed. Build it with correct=None, or use its spectrum, "
            "es.solve_spectrum(laplacian, k)."
        )


def require_square(matrix: Any, name: str, wanted: str = "a square sparse matrix") -> None:
    """Raise an error if a value is not a square sparse matrix with rows."""
    shape = np.shape(matrix)
    if not sp.issparse(matrix) or len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise InvalidParameterError(
            f"{name} must be {wanted}; it is a {type(matrix).__name__} of shape {shape}."
        )


def as_symmetric(name: str, value: sp.sparray) -> sp.csr_array:
    """Return a read-only copy of a matrix, or raise an error if it is not finite and symmetric."""
    require_square(value, name)
    matrix = freeze_sparse(sp.csr_array(value, dtype=np.float64))
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        entries = matrix.tocoo()
        row, column = entries.row[bad[0]], entries.col[bad[0]]
        raise InvalidParameterError(
            f"{name} must be finite; entry ({row}, {column}) is {entries.data[bad[0]]} ({bad.size} such)."
        )
    differences = abs(matrix - matrix.T).tocoo()
    worst = differences.data.argmax() if differences.nnz else 0
    if differences.nnz and differences.data[worst] > ASYMMETRY * abs(matrix.data).max():
        row, column = differences.row[worst], differences.col[worst]
        raise InvalidParameterError(
            f"{name} must be symmetric; entry ({row}, {column}) is {matrix[row, column]} "
            f"and entry ({column}, {row}) is {matrix[column, row]}."
        )
    return matrix
