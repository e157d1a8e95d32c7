"""Poisson, Helmholtz and heat equations on any operator, with fixed values and loads."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_values, point_functions, positive_values
from eigenshape._typing import ArrayLike
from eigenshape.calculus.linear_solver import LinearSolver, factor_equations
from eigenshape.operators.laplacian import Laplacian


def poisson_solver(
    laplacian: Laplacian,
    fixed: ArrayLike | None = None,
    constraints: sp.sparray | ArrayLike | None = None,
) -> LinearSolver:
    """Factor the Poisson equation W u = b, for many right-hand sides.

    Parameters
    ----------
    laplacian : Laplacian
    fixed : (c,) int, optional
        Points where values are given (Dirichlet). The rest of a boundary is free (Neumann).
    constraints : (p, n) sparse or float, optional
        As in `factor_equations`.

    Returns
    -------
    LinearSolver
        Its `solve` takes b integrated: B f for a source f, -`divergence` of a field, or
        `boundary_load`. On a component without fixed point the mean of u, weighted by the mass, is
        0.

    Raises
    ------
    InvalidParameterError
        As in `factor_equations`.

    See Also
    --------
    es.calculus.solve_poisson : Factor and solve at once.

    Examples
    --------
    >>> import eigenshape as es
    >>> import numpy as np
    >>> ball = es.icosphere(2)
    >>> laplacian = es.cotangent_laplacian(ball)
    >>> solver = es.calculus.poisson_solver(laplacian)
    >>> sources = es.calculus.remove_means(laplacian, np.eye(ball.n_vertices)[:, :100])
    >>> solver.solve(laplacian.mass @ sources).shape
    (162, 100)
    """
    require_type(laplacian, Laplacian, "laplacian")
    weights = laplacian.mass.sum(axis=1)
    return factor_equations(laplacian.stiffness, fixed, constraints, weights=weights)


def helmholtz_solver(
    laplacian: Laplacian, squared_wavenumber: float, fixed: ArrayLike | None = None
) -> LinearSolver:
    """Factor the Helmholtz equation (W - κ B) u = b, for many right-hand sides.

    Parameters
    ----------
    laplacian : Laplacian
    squared_wavenumber : float
        κ, in 1/length²: positive for waves, negative for the screened Poisson equation.
    fixed : (c,) int, optional
        Points where values are given (Dirichlet).

    Returns
    -------
    LinearSolver

    Raises
    ------
    InvalidParameterError
        If κ is not finite, or an eigenvalue of the operator up to rounding; or as in
        `factor_equations`.

    See Also
    --------
    es.calculus.solve_helmholtz : Factor and solve at once.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(2))
    >>> solver = es.calculus.helmholtz_solver(laplacian, -2.0)
    >>> solver.solve(laplacian.mass.sum(axis=1))[:3].round(12).tolist()
    [0.5, 0.5, 0.5]
    """
    require_type(laplacian, Laplacian, "laplacian")
    (kappa,) = finite_values(squared_wavenumber, "squared_wavenumber")
    weights = laplacian.mass.sum(axis=1)
    matrix = laplacian.stiffness - kappa * laplacian.mass
    return factor_equations(matrix, fixed, weights=weights, indefinite=bool(kappa > 0))


def heat_solver(laplacian: Laplacian, t: float, fixed: ArrayLike | None = None) -> LinearSolver:
    """Factor one implicit step of the heat equation, (B + t W) u = b, for many right-hand sides.

    Parameters
    ----------
    laplacian : Laplacian
    t : float
        Length of the step, in length².
    fixed : (c,) int, optional
        Points where values are given (Dirichlet).

    Returns
    -------
    LinearSolver
        Its `solve` takes b = B u₀, with u₀ the values before the step.

    Raises
    ------
    InvalidParameterError
        If t is not positive; or as in `factor_equations`.

    See Also
    --------
    es.calculus.solve_heat : Several steps, with sources.

    Examples
    --------
    Heat is conserved:

    >>> import eigenshape as es
    >>> import numpy as np
    >>> laplacian = es.cotangent_laplacian(es.icosphere(2))
    >>> start = np.eye(laplacian.n_points)[:, 0]
    >>> after = es.calculus.heat_solver(laplacian, 0.1).solve(laplacian.mass @ start)
    >>> bool(np.isclose((laplacian.mass @ after).sum(), (laplacian.mass @ start).sum()))
    True
    """
    require_type(laplacian, Laplacian, "laplacian")
    (step,) = positive_values(t, "t")
    return factor_equations(laplacian.mass + step * laplacian.stiffness, fixed)


def remove_means(laplacian: Laplacian, values: ArrayLike) -> Float[np.ndarray, "n ..."]:
    """Subtract from functions their mean over each component, weighted by the mass.

    What is left is a source that the Poisson equation of a closed shape can have.

    Parameters
    ----------
    laplacian : Laplacian
    values : (n,) or (n, k) float
        Values at the points; each column is one function.

    Returns
    -------
    (n,) or (n, k) float

    Raises
    ------
    InvalidParameterError
        If `values` does not have one row per point, or a value is not finite.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.shapes.grid(1, 1))
    >>> es.calculus.remove_means(laplacian, [3.0, 0.0, 0.0, 0.0]).round(12).tolist()
    [2.0, -1.0, -1.0, -1.0]
    """
    require_type(laplacian, Laplacian, "laplacian")
    functions = point_functions(values, "values", laplacian.n_points)
    count, labels = connected_components(laplacian.stiffness, directed=False)
    weights = laplacian.mass.sum(axis=1)
    members = sp.csr_array((weights, (labels, np.arange(len(labels)))), shape=(count, len(labels)))
    sums = members.sum(axis=1).reshape(-1, *[1] * (functions.ndim - 1))
    means = (members @ functions) / sums
    return functions - means[labels]
