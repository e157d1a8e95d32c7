"""The one form that every discretization of the Laplace operator takes, and its boundary conditions.

Every operator has the Neumann condition by default: points that are not fixed are free. Fixing the
whole boundary gives the Dirichlet condition, fixing a part of it the mixed one.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import as_symmetric, require_points
from certeig.kit.text import html_repr
from certeig.kit.typing import ArrayLike


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
