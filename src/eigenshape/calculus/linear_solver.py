"""Symmetric systems of equations on points: factored once, solved for many right-hand sides."""

from dataclasses import replace
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import ReadOnly, real_numbers, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import as_symmetric, find_zero_row_sums, require_points
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from certeig.sparse.symmetric_factor import SymmetricFactor
from eigenshape._arrays import point_functions, require_finite_rows
from eigenshape._errors import InvalidShapeError

Columns = Float[np.ndarray, "n k"]

# Loads on a component where nothing is fixed may sum to this share of their absolute sum. Sums of a
# million numbers round to 1e-10 of it at most; a source that is not balanced is far above.
BALANCED = 1e-9
# Singular values of the constraints' equations up to this share of the largest count as zero:
# redundant constraints give some near 1e-16, and the conditions of meshes stay above.
DEPENDENT = 1e-12
# Of a system that no pins or fixed points make regular.
SINGULAR = (
    "The equations of the free points must have one solution; {}. "
    "Fix a point of each component, or change t or the squared wavenumber."
)
# Constraints count as met up to this share of their terms.
MET = 1e-8

SparseMatrix: TypeAlias = sp.sparray | sp.spmatrix


@record
class LinearSolver(ReadOnly):
    """A symmetric system A x = b on points, factored once for many right-hand sides.

    Some points may be fixed at values, and linear constraints C x = d may hold; then x is the
    stationary point of ½ xᵀAx - xᵀb among those, the minimum if A is positive semidefinite.
    Where a component has no fixed point and constants on it have no energy, such as with pure
    Neumann conditions, x is determined up to a constant: constraints choose it, else the weighted
    mean over the component is 0.

    A solver is a value without scratch memory; several threads may use it at once.

    Attributes
    ----------
    n_points : int
    free : (f,) int
        The points that the factor solves for, ascending.
    fixed : (c,) int
        The points with given values, ascending, without duplicates.
    floating : (n,) int
        Number of the component of each point among those determined up to a constant, else -1.

    See Also
    --------
    es.calculus.factor_equations : Make a solver for any symmetric matrix.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.shapes.interval(2))
    >>> solver = es.calculus.factor_equations(laplacian.stiffness, fixed=[0, 2])
    >>> solver.solve(values=[1.0, 3.0]).round(12).tolist()
    [1.0, 2.0, 3.0]
    """

    n_points: int
    free: Int[np.ndarray, " f"]
    fixed: Int[np.ndarray, " c"]
    floating: Int[np.ndarray, " n"]
    _given: Int[np.ndarray, " g"]  # `fixed` as it was given, in its order
    _weights: Float[np.ndarray, " n"]  # of the means
    _block: sp.csr_array  # A on the free points
    _coupling: sp.csr_array  # A from the fixed to the free points
    _factor: SymmetricFactor | None  # None if no point is free
    _refined: bool  # whether solutions take a step of refinement
    _constraints: "Constraints | None" = None

    def __repr__(self) -> str:
        numbers = f"{len(self.fixed)} fixed, {self._n_constraints} constraints"
        return f"LinearSolver({self.n_points} points, {numbers})"

    @property
    def _n_constraints(self) -> int:
        return 0 if self._constraints is None else self._constraints.matrix.shape[0]

    def solve(
        self, right: ArrayLike = 0.0, *, values: ArrayLike = 0.0, targets: ArrayLike = 0.0
    ) -> Float[np.ndarray, "n ..."]:
        """Solve for one or many right-hand sides.

        Parameters
        ----------
        right : (n,) or (n, k) float, or 0
            b, integrated: one number per point for each right-hand side, such as B f for a source f
            or -`divergence`. Its rows at fixed points do not count.
        values : (c,) or (c, k) float, or a number
            At the fixed points, in the order in which they were given.
        targets : (p,) or (p, k) float, or a number
            d, of the constraints.

        Returns
        -------
        (n,) or (n, k) float
            Two-dimensional if any argument is.

        Raises
        ------
        InvalidParameterError
            If an array has another length or a number is not finite, values are given where no
            point is fixed, or targets without constraints, a point that is fixed twice has two
            values, the right-hand side does not sum to 0 on a component where nothing is fixed, no
            x meets all constraints, or x is too large for floating-point numbers.
        """
        load = _columns(right, "right", self.n_points, "point")
        given = _columns(values, "values", len(self._given), "fixed point")
        wanted = _columns(targets, "targets", self._n_constraints, "constraint")
        widths = {each.shape[1] for each in (load, given, wanted)} - {1}
        if len(widths) > 1:
            raise InvalidParameterError(
                "right, values and targets must have one column, or equally many; "
                f"they have {load.shape[1]}, {given.shape[1]} and {wanted.shape[1]}."
            )
        width = max(widths, default=1)
        # Values at `fixed`, where each point stands once.
        _, first, inverse = np.unique(self._given, return_index=True, return_inverse=True)
        at_fixed = given[first]
        clash = np.argwhere(at_fixed[inverse] != given)
        if len(clash):
            entry, column = clash[0]
            raise InvalidParameterError(
                f"A point can be fixed at one value only; point {self._given[entry]} is fixed at "
                f"{at_fixed[inverse[entry], column]} and at {given[entry, column]}."
            )
        with one_blas_thread():
            found = self._solve_pinned(load, at_fixed, width)
            if self._constraints is None:
                self._require_balanced(load)
                found = self._without_means(found)
            else:
                found = self._constraints.correct(self, found, load, wanted)
        bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
        if bad.size:
            raise InvalidParameterError(
                f"A solution must fit into floating-point numbers; at point {bad[0]} it does not "
                f"({bad.size} such). Scale the shape to a size near 1 first, or the right-hand side."
            )
        flat = max(np.ndim(each) for each in (right, values, targets)) < 2
        return found[:, 0] if flat else found

    def _solve_pinned(
        self, load: Float[np.ndarray, "n w"], at_fixed: Float[np.ndarray, "c v"], width: int
    ) -> Columns:
        """Solve with the first point of each floating component at 0."""
        found = np.zeros((self.n_points, width))
        found[self.fixed] = at_fixed
        if self._factor is None:
            return found
        right = np.broadcast_to(
            load[self.free] - self._coupling @ at_fixed, (len(self.free), width)
        )
        inner = self._factor.solve(right)
        if self._refined:
            inner += self._factor.solve(right - self._block @ inner)
        found[self.free] = inner
        return found

    def _require_balanced(self, load: Columns) -> None:
        """Raise an error if loads do not sum to zero on a floating component."""
        sums, sizes = self.floating_sums(load), self.floating_sums(np.abs(load))
        bad = np.argwhere(np.abs(sums) > BALANCED * sizes)
        if len(bad):
            component, column = bad[0]
            point = int(np.argmax(self.floating == component))
            raise InvalidParameterError(
                "Where no point of a component is fixed, the right-hand side must sum to 0 on it "
                f"(what flows in must flow out); on the component of point {point} it sums to "
                f"{sums[component, column]:.6g} ({len(np.unique(bad[:, 0]))} such components). "
                "Pass es.calculus.remove_means(laplacian, source) as the source, or fix a point."
            )

    def floating_sums(self, load: Columns) -> Float[np.ndarray, "u k"]:
        """Return the sums of loads over each component that is determined up to a constant.

        Parameters
        ----------
        load : (n, k) float
            One load in each column.
        """
        points = np.flatnonzero(self.floating >= 0)
        count = int(self.floating.max(initial=-1)) + 1
        members = sp.csr_array(
            (np.ones(len(points)), (self.floating[points], points)), shape=(count, self.n_points)
        )
        return members @ load

    def _without_means(self, found: Columns) -> Columns:
        """Subtract the weighted mean over each floating component."""
        inside = self.floating >= 0
        if not inside.any():
            return found
        # Relative weights: those of a large shape times its values would overflow.
        weights = self._weights[:, None] / self._weights.max()
        means = self.floating_sums(weights * found) / self.floating_sums(weights)
        found[inside] -= means[self.floating[inside]]
        return found


@record
class Constraints:
    """Linear constraints C x = d of a solver, eliminated by a small dense system.

    x = x₀ - R μ + Z α, with x₀ the solution without constraints, R = A⁻¹Cᵀ, and Z the constants on
    floating components. The multipliers μ and constants α solve C x = d and Zᵀ(b - Cᵀμ) = 0.

    Attributes
    ----------
    matrix : (p, n) sparse
        C, as given.
    response : (n, p) float
        R.
    constants : (p, u) float
        C Z.
    scale : float
        Unit of the constants α that balances the system.
    system : (p+u, p+u) float
    inverse : (p+u, p+u) float
        Its pseudo-inverse: redundant constraints do no harm.
    """

    matrix: sp.csr_array
    response: Float[np.ndarray, "n p"]
    constants: Float[np.ndarray, "p u"]
    scale: float
    system: Float[np.ndarray, "q q"]
    inverse: Float[np.ndarray, "q q"]

    def correct(
        self,
        solver: LinearSolver,
        start: Columns,
        load: Float[np.ndarray, "n w"],
        targets: Float[np.ndarray, "p v"],
    ) -> Columns:
        """Return the solution that meets the constraints, given that without them.

        Raise InvalidParameterError if the constraints conflict, or leave a component where loads do
        not sum to 0.
        """
        n_rows, width = self.constants.shape[0], start.shape[1]
        reached = self.matrix @ start
        sums = np.broadcast_to(solver.floating_sums(load), (self.constants.shape[1], width))
        right = np.concatenate([reached - targets, -self.scale * sums])
        shares = self.inverse @ right
        left = self.system @ shares - right
        terms = np.abs(self.system) @ np.abs(shares)
        sizes = np.concatenate([np.abs(reached) + np.abs(targets), np.zeros_like(sums)])
        # A load that sums to rounding has no share in what is left.
        sizes[n_rows:] = self.scale * solver.floating_sums(np.abs(load))
        bad = np.argwhere(np.abs(left) > MET * (terms + sizes))
        if len(bad):
            row, column = bad[0]
            if row >= n_rows:
                solver._require_balanced(load)
            target = targets[row, min(column, targets.shape[1] - 1)]
            raise InvalidParameterError(
                "The constraints must not contradict each other or the fixed values; "
                f"constraint {row} would hold with target {target - left[row, column]:.6g} only, "
                f"not {target:.6g} ({len(bad)} such)."
            )
        multipliers, constants = shares[:n_rows], self.scale * shares[n_rows:]
        found = start - self.response @ multipliers
        # Components that no constraint concerns have mean 0, as without constraints.
        inside = solver.floating >= 0
        untouched = np.flatnonzero(~self.constants.any(axis=0))
        free_mean = inside & np.isin(solver.floating, untouched)
        shifted = inside & ~free_mean
        found[shifted] += constants[solver.floating[shifted]]
        if free_mean.any():
            found[free_mean] = solver._without_means(found.copy())[free_mean]
        return found


def factor_equations(
    matrix: SparseMatrix,
    fixed: ArrayLike | None = None,
    constraints: SparseMatrix | ArrayLike | None = None,
    *,
    weights: ArrayLike | None = None,
    indefinite: bool = False,
) -> LinearSolver:
    """Factor a symmetric system, for many right-hand sides.

    With the matrices of a Laplacian, W is the Poisson equation, for which `weights=B.sum(axis=1)`
    makes means those over the shape; W - κB is the Helmholtz equation, `indefinite` if κ > 0; and
    B + tW is one implicit step of the heat equation. `solve` takes integrated right-hand sides.

    Fixed points are eliminated and the rest is factored as L D Lᵀ; constraints follow by the Schur
    complement, a dense system of their number. That takes one solve and n numbers of memory for
    each constraint, which is meant for hundreds of them.

    Parameters
    ----------
    matrix : (n, n) sparse
        A, symmetric; positive semidefinite unless `indefinite`.
    fixed : (c,) int, optional
        Points at which values are given.
    constraints : (p, n) sparse or float, optional
        C, one row per linear constraint C x = d.
    weights : (n,) float, optional
        Weights of the means that are 0 where x is determined up to a constant; ones by default.
    indefinite : bool
        Whether A may have negative eigenvalues. Then x is a stationary point, and each solve takes
        a step of refinement.

    Returns
    -------
    LinearSolver

    Raises
    ------
    InvalidParameterError
        If the matrix is not square, finite and symmetric; is singular, or not positive semidefinite
        though not called indefinite; a fixed point is out of range; or constraints or weights have
        another size or are not finite.

    See Also
    --------
    es.calculus.solve_poisson, es.calculus.solve_helmholtz, es.calculus.solve_heat : Factor and solve
        the equations of a Laplacian at once.

    Examples
    --------
    The stiffest string through 0 and 1 whose values sum to 3:

    >>> import eigenshape as es
    >>> W = es.cotangent_laplacian(es.shapes.interval(4)).stiffness
    >>> solver = es.calculus.factor_equations(W, fixed=[0, 4], constraints=[[1, 1, 1, 1, 1]])
    >>> solver.solve(values=[0, 1], targets=[3]).round(4).tolist()
    [0.0, 0.4, 0.7, 0.9, 1.0]

    The Poisson equation on a closed surface, for 100 sources:

    >>> import numpy as np
    >>> laplacian = es.cotangent_laplacian(es.icosphere(2))
    >>> weights = laplacian.mass.sum(axis=1)
    >>> solver = es.calculus.factor_equations(laplacian.stiffness, weights=weights)
    >>> sources = es.calculus.remove_means(laplacian, np.eye(laplacian.n_points)[:, :100])
    >>> solver.solve(laplacian.mass @ sources).shape
    (162, 100)
    """
    system = as_symmetric("The matrix of a system", matrix)
    points = require_points([] if fixed is None else fixed, system.shape[0])
    # Components without a fixed point where constants have no energy float; they are numbered.
    count, labels = connected_components(system, directed=False)
    rigid = np.bincount(labels, weights=~find_zero_row_sums(system), minlength=count) > 0
    rigid[labels[points]] = True
    floating = np.where(rigid, -1, np.cumsum(~rigid) - 1)[labels].astype(np.int64)
    solver = factor_system(system, points, floating, weights, indefinite=indefinite)
    if constraints is None:
        return solver
    # The small system of the multipliers and of the constants on floating components.
    given = constraints if sp.issparse(constraints) else real_numbers(constraints, "constraints")
    if len(np.shape(given)) != 2 or np.shape(given)[1] != solver.n_points:
        raise InvalidParameterError(
            f"constraints must have one column per point, shape (p, {solver.n_points}); "
            f"the shape is {np.shape(given)}."
        )
    matrix = sp.csr_array(given, dtype=np.float64)
    if not np.isfinite(matrix.data).all():
        raise InvalidParameterError("constraints must be finite; they are not.")
    rows = matrix.T.toarray()
    with one_blas_thread():
        zero = np.zeros((len(solver.fixed), 1))
        response = solver._solve_pinned(rows, zero, rows.shape[1])
        constants = solver.floating_sums(rows).T
        schur = matrix @ response
        unit = np.abs(constants).max(initial=0.0)
        scale = float(np.abs(schur).max() / unit) if unit > 0 and schur.any() else 1.0
        corner = np.zeros((constants.shape[1],) * 2)
        multipliers = np.block([[schur, -scale * constants], [-scale * constants.T, corner]])
        inverse = np.linalg.pinv(multipliers, rcond=DEPENDENT, hermitian=True)
    eliminated = Constraints(matrix, response, constants, scale, multipliers, inverse)
    return replace(solver, _constraints=eliminated)


def factor_definite(
    matrix: SparseMatrix, fixed: ArrayLike | None = None, *, indefinite: bool = False
) -> LinearSolver:
    """Factor a symmetric system in which constants have an energy, however small.

    Errors are those of `factor_equations`.
    """
    system = sp.csr_array(matrix)
    points = require_points([] if fixed is None else fixed, system.shape[0])
    return factor_system(system, points, np.full(system.shape[0], -1), indefinite=indefinite)


def factor_system(
    system: sp.csr_array,
    points: Int[np.ndarray, " g"],
    floating: Int[np.ndarray, " n"],
    weights: ArrayLike | None = None,
    *,
    indefinite: bool,
) -> LinearSolver:
    """Factor a symmetric system whose components that float are known, -1 elsewhere.

    Errors are those of `factor_equations`.
    """
    n, held = system.shape[0], np.unique(points)
    means = np.ones(n) if weights is None else point_functions(weights, "weights", n)
    _, pins = np.unique(floating, return_index=True)
    pins = pins[floating[pins] >= 0]
    free = np.setdiff1d(np.arange(n), np.concatenate([held, pins]))
    rows = system[free]
    block, coupling = rows[:, free], rows[:, held]
    factor = SymmetricFactor.of(block) if len(free) else None
    if len(free) and factor is None:
        raise InvalidParameterError(SINGULAR.format("a pivot is 0"))
    if factor is not None:
        order = factor.elimination.order
        small = np.flatnonzero(np.abs(factor.pivots) <= factor.rounding()[order])
        if small.size:
            point = free[order[small[0]]]
            raise InvalidParameterError(
                SINGULAR.format(f"the pivot of point {point} is zero up to rounding")
            )
        n_negative = np.count_nonzero(factor.pivots < 0)
        if n_negative and not indefinite:
            raise InvalidParameterError(
                "A minimum exists only if the matrix is positive semidefinite; it has "
                f"{n_negative} negative eigenvalues. Pass indefinite=True for a stationary point."
            )
    return LinearSolver(
        n_points=n,
        free=free,
        fixed=held,
        floating=floating,
        _given=points,
        _weights=means,
        _block=block,
        _coupling=coupling,
        _factor=factor,
        _refined=indefinite,
    )


def _columns(value: ArrayLike, name: str, n_rows: int, noun: str) -> Float[np.ndarray, "r k"]:
    """Return `value` as a table with one row per point, fixed point or constraint."""
    numbers = real_numbers(value, name).astype(np.float64)
    if numbers.ndim == 0:
        if not n_rows and numbers != 0:
            raise InvalidParameterError(
                f"{name} must be 0 where there is no {noun}; it is {numbers}."
            )
        numbers = np.full((n_rows, 1), numbers)
    if numbers.ndim not in (1, 2) or len(numbers) != n_rows:
        raise InvalidParameterError(
            f"{name} must hold one number per {noun}, shape ({n_rows},) or ({n_rows}, k); "
            f"the shape is {numbers.shape}."
        )
    require_finite_rows(numbers, name, noun)
    return numbers if numbers.ndim == 2 else numbers[:, None]


# `LinearSolver` is for the systems of users: it checks pivots and right-hand sides at each call. What
# follows is for systems that are built inside, where the remedy is a repair of the mesh.
@record
class GroundedFactor(ReadOnly):
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

    def solve(self, loads: Columns) -> Columns:
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
    factor = SymmetricFactor.of(matrix)
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
