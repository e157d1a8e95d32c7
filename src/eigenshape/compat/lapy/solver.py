"""A class with the calls of LaPy's `Solver`."""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import DTypeLike
from scipy.sparse.linalg import eigsh

from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions
from eigenshape.calculus.linear_solver import factor_equations
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh
from eigenshape.operators.anisotropic import anisotropic_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian, linear_mass
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.solve import solve_spectrum

# LaPy's matrices are of SciPy's older class, whose `*` is the product of matrices. Its programs use
# that.
Matrix: TypeAlias = sp.csc_matrix
# Row sums of matrices in single precision count as zero up to this share of their absolute sums.
SINGLE_ROUNDING = 1e-5


class Solver:
    """Finite elements on a mesh of LaPy: matrices, eigenpairs and the Poisson equation.

    Attributes and methods are those of `lapy.Solver` in version 1.7, and the matrices are the same
    up to rounding. By design these differ:

    - Eigenpairs are proved complete, and equal to the last bit in each run, so that `v0` and `rng`
      have no effect. Signs of eigenvectors, and bases where eigenvalues are multiple, are others.
    - A triangle without area, a triangle that occurs twice and a vertex without triangle are
      refused, where LaPy puts a small area in place or gets a singular matrix.
    - Where no value is fixed, the Poisson equation has solutions only for right-hand sides of mean
      0, and these differ by constants. Here the mean is taken out of both. LaPy factors a singular
      matrix.
    - `use_cholmod` is kept and has no effect: no further package is needed.
    - Voxels are not taken.

    Parameters
    ----------
    geometry : lapy.TriaMesh or lapy.TetMesh
        Any object with vertices `v` (n, 3) and triangles `t` (f, 3) or tetrahedra `t` (f, 4).
    lump : bool
        Whether the mass matrix is diagonal.
    aniso : float or tuple of two floats, optional
        On triangles, how strongly curvature reduces conductivity: exp(-a |κ|) along each principal
        direction, with κ of `geometry.curvature_tria`. Of two numbers the first counts for the
        directions of greatest curvature κ₂, and the second for those of least curvature κ₁.
    aniso_smooth : int
        Steps of smoothing of the curvature.
    use_cholmod : bool
    dtype : numpy.dtype
        Of the matrices and results. They are computed in double precision, also from vertices in
        single precision, as files of LaPy have them.

    Attributes
    ----------
    stiffness, mass : (n, n) scipy.sparse.csc_matrix
    geotype : type
    use_cholmod : bool

    Raises
    ------
    InvalidParameterError
        If the geometry has neither triangles nor tetrahedra, or `aniso` is not one number or two.
    InvalidShapeError
        If the mesh is not valid, as in `cotangent_laplacian`.

    See Also
    --------
    install : Put this class in LaPy's place for programs that cannot be changed.
    solve_spectrum : The eigensolver, with the certificate.

    Examples
    --------
    >>> import lapy
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> mesh = lapy.TriaMesh(ball.vertices.copy(), ball.faces.copy())
    >>> eigenvalues, eigenvectors = es.compat.lapy.Solver(mesh).eigs(k=4)
    >>> eigenvalues.round(1).tolist()
    [0.0, 2.0, 2.0, 2.0]
    """

    _repr_html_ = html_repr

    def __init__(
        self,
        geometry: Any,
        lump: bool = False,
        aniso: float | Sequence[float] | None = None,
        aniso_smooth: int = 10,
        use_cholmod: bool = False,
        dtype: DTypeLike = np.float64,
    ) -> None:
        if _mesh_of(geometry).dim == 3 or aniso is None:
            self.stiffness, self.mass = self._fem_tria(geometry, lump, dtype)
        else:
            if np.shape(aniso) not in ((), (2,)):
                raise InvalidParameterError(
                    f"aniso must be one number or two; its shape is {np.shape(aniso)}."
                )
            least, greatest, c_least, c_greatest = geometry.curvature_tria(smoothit=aniso_smooth)
            bends = np.abs(np.column_stack([c_greatest, c_least]))
            self.stiffness, self.mass = self._fem_tria_aniso(
                geometry, least, greatest, np.exp(-bends * np.asarray(aniso)), lump, dtype
            )
        self.geotype = type(geometry)
        self.use_cholmod = use_cholmod

    def __repr__(self) -> str:
        # neuromodes' solver, which inherits, makes its matrix when it is asked for.
        matrix = vars(self).get("stiffness")
        size = "" if matrix is None else f"{matrix.shape[0]} points"
        return f"{type(self).__name__}({size})"

    # The static functions keep LaPy's names, also the private ones, since neuromodes calls them.

    @staticmethod
    def _fem_tria(
        tria: Any, lump: bool = False, dtype: DTypeLike = np.float64
    ) -> tuple[Matrix, Matrix]:
        return _as_theirs(cotangent_laplacian(_mesh_of(tria), _mass_name(lump)), dtype)

    _fem_tetra = _fem_tria

    @staticmethod
    def _fem_tria_aniso(
        tria: Any,
        u1: Float[np.ndarray, "f 3"],
        u2: Float[np.ndarray, "f 3"],
        aniso_mat: Float[np.ndarray, "f 2"],
        lump: bool = False,
        dtype: DTypeLike = np.float64,
    ) -> tuple[Matrix, Matrix]:
        # LaPy multiplies sides, which are gradients turned by a right angle, by these numbers: the
        # second is the conductivity along u1.
        across, along = (aniso_mat[:, [column], None] for column in (0, 1))
        tensors = along * _squares(u1) + across * _squares(u2)
        return _as_theirs(anisotropic_laplacian(_mesh_of(tria), tensors, _mass_name(lump)), dtype)

    @staticmethod
    def fem_tria_mass(tria: Any, lump: bool = False, dtype: DTypeLike = np.float64) -> Matrix:
        """Compute the mass matrix alone.

        Parameters
        ----------
        tria : lapy.TriaMesh
        lump : bool
        dtype : numpy.dtype

        Returns
        -------
        (n, n) scipy.sparse.csc_matrix
        """
        return sp.csc_matrix(linear_mass(_mesh_of(tria), _mass_name(lump)), dtype=dtype)

    def eigs(
        self,
        k: int = 10,
        sigma: float = -0.01,
        which: str = "LM",
        v0: ArrayLike | None = None,
        mode: str = "normal",
        rng: Any = None,
    ) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, "n k"]]:
        """Compute the k lowest eigenpairs, certified.

        Parameters
        ----------
        k : int
        sigma, which, mode
            A positive `sigma`, or another `which` or `mode`, asks for other eigenvalues. These come
            from `scipy.sparse.linalg.eigsh`, as in LaPy, and without certificate.
        v0, rng
            The start of `eigsh`. The certified solver needs none.

        Returns
        -------
        eigenvalues : (k,) float
            Ascending.
        eigenvectors : (n, k) float

        Raises
        ------
        InvalidParameterError, ConvergenceError
            As in `solve_spectrum`.
        """
        kind = self.stiffness.dtype
        if sigma > 0 or (which, mode) != ("LM", "normal"):
            if v0 is None:
                v0 = np.random.default_rng(rng).uniform(-1, 1, self.stiffness.shape[0])
            values, vectors = eigsh(
                self.stiffness, k, self.mass, sigma=sigma, which=which, v0=v0, mode=mode
            )
            order = np.argsort(values)
            return values[order], vectors[:, order]
        spectrum = solve_spectrum(self._laplacian(), k)
        # Columns are contiguous, as those of LaPy: programs multiply by them three times as fast.
        return spectrum.eigenvalues.astype(kind), spectrum.eigenvectors.astype(kind, order="F")

    def poisson(
        self,
        h: ArrayLike = 0.0,
        dtup: tuple[ArrayLike, ArrayLike] | tuple[()] = (),
        ntup: tuple[ArrayLike, ArrayLike] | tuple[()] = (),
        integrate: bool = True,
    ) -> Float[np.ndarray, "n ..."]:
        """Solve W u = B (h - n), with values given at some vertices.

        Parameters
        ----------
        h : (n,) or (n, q) float, or a number
        dtup : pair of (c,) int and (c,) float
            Vertices, and the values there.
        ntup : pair of (c,) int and (c,) float
            Vertices, and the numbers n there; n is 0 elsewhere.
        integrate : bool
            If False the equation is W u = h - n.

        Returns
        -------
        (n,) float, or (n, q) if h has several columns

        Raises
        ------
        InvalidParameterError
            If lengths do not fit, a number is not finite, or a vertex is given with two values.
        """
        laplacian = self._laplacian()
        n = laplacian.n_points
        given = point_functions(np.full(n, h) if np.ndim(h) == 0 else h, "h", n)
        load = np.array(given.reshape(n, -1))
        if ntup:
            np.subtract.at(load, np.asarray(ntup[0]), np.asarray(ntup[1])[:, None])
        if integrate:
            load = laplacian.mass @ load
        fixed, values = dtup or ([], 0.0)
        weights = laplacian.mass.sum(axis=1)
        solver = factor_equations(laplacian.stiffness, fixed, weights=weights)
        floating = np.flatnonzero(solver.floating >= 0)
        if len(floating):
            # Programs leave out the mean, or have it by rounding; LaPy's own test does.
            means = solver.floating_sums(load) / solver.floating_sums(weights[:, None])
            load[floating] -= weights[floating, None] * means[solver.floating[floating]]
        found = solver.solve(load, values=values).astype(self.stiffness.dtype)
        return found[:, 0] if found.shape[1] == 1 else found

    def _laplacian(self) -> Laplacian:
        """Return the operator of the matrices, which a program may have changed."""
        stiffness = sp.csr_array(self.stiffness, dtype=np.float64)
        if self.stiffness.dtype != np.float64:
            # Rounding has left row sums, by which constants would have energy.
            sums, sizes = stiffness.sum(axis=1), abs(stiffness).sum(axis=1)
            rounding = np.where(np.abs(sums) <= SINGLE_ROUNDING * sizes, sums, 0.0)
            stiffness = stiffness - sp.diags_array(rounding)
        return Laplacian(stiffness, sp.csr_array(self.mass, dtype=np.float64))


def _mesh_of(geometry: Any) -> Mesh:
    """Return a mesh of LaPy as ours."""
    corners = np.shape(getattr(geometry, "t", 0))
    if len(corners) != 2 or corners[1] not in (3, 4) or not hasattr(geometry, "v"):
        raise InvalidParameterError(
            "geometry must be a lapy.TriaMesh or a lapy.TetMesh, with vertices v and triangles or "
            f"tetrahedra t; it is of type {type(geometry).__name__}."
        )
    kind = TriangleMesh if corners[1] == 3 else SimplicialMesh
    return kind(geometry.v, geometry.t)


def _mass_name(lump: bool) -> Literal["lumped", "consistent"]:
    return "lumped" if lump else "consistent"


def _as_theirs(laplacian: Laplacian, dtype: DTypeLike) -> tuple[Matrix, Matrix]:
    """Return stiffness and mass as LaPy does."""
    return (
        sp.csc_matrix(laplacian.stiffness, dtype=dtype),
        sp.csc_matrix(laplacian.mass, dtype=dtype),
    )


def _squares(directions: Float[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3 3"]:
    """Return u uᵀ of each direction u."""
    return np.asarray(directions[:, :, None] * directions[:, None, :])
