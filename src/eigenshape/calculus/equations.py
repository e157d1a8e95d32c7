"""Poisson, Helmholtz and heat equations on any operator, with fixed values and loads."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components

from certeig.kit.arguments import require_type
from certeig.kit.arrays import finite_number, positive_number, real_numbers
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import point_functions, step_number, vertex_values
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.linear_solver import factor_definite, factor_equations
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.operators import elements
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.requirements import require_matrix

# Differences from a mean up to this share of the value are the rounding of sums of up to a million
# numbers.
ROUNDING = 1e-12


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
    left = functions - ((members @ functions) / sums)[labels]
    # What is rounding of a constant is removed, and where little is left, so is its own mean:
    # a solver measures the balance of loads by their size.
    left[np.abs(left) <= ROUNDING * np.abs(functions)] = 0.0
    return left - ((members @ left) / sums)[labels]


def solve_poisson(
    laplacian: Laplacian,
    source: ArrayLike = 0.0,
    *,
    load: ArrayLike = 0.0,
    fixed: ArrayLike | None = None,
    values: ArrayLike = 0.0,
) -> Float[np.ndarray, "n ..."]:
    """Solve the Poisson equation -Δu = f with fixed values, flux through the boundary or neither.

    W u = B f + load, in the sign of the library: L is -div grad. Where nothing is fixed, the flux
    through the boundary is the load, zero by default (Neumann).

    Parameters
    ----------
    laplacian : Laplacian
    source : (n,) or (n, k) float, or a number
        f at the points, in units of u per length².
    load : (n,) or (n, k) float, or a number
        Integrated loads, added to B f: `boundary_load` of a flux, or -`divergence` of a field.
    fixed : (c,) int, optional
        Points where values are given (Dirichlet).
    values : (c,) or (c, k) float, or a number
        The values there.

    Returns
    -------
    (n,) or (n, k) float
        u. On a component without fixed point its mean, weighted by the mass, is 0.

    Raises
    ------
    InvalidParameterError
        If an array has another length or a number is not finite, a point is fixed at two values, or
        on a component without fixed point B f + load does not sum to 0; if the operator has
        `correct="log"`; or as in `factor_equations`.

    See Also
    --------
    es.calculus.factor_equations : The factor, kept for many right-hand sides.

    Examples
    --------
    On a sphere of radius 1, -Δz = 2z:

    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> z = ball.vertices[:, 2]
    >>> u = es.calculus.solve_poisson(es.cotangent_laplacian(ball), 2 * z)
    >>> bool(abs(u - z).max() < 0.01)
    True
    """
    require_matrix(laplacian)
    weights = laplacian.mass.sum(axis=1)
    solver = factor_equations(laplacian.stiffness, fixed, weights=weights)
    return solver.solve(_right_hand_side(laplacian, source, load), values=values)


def solve_helmholtz(
    laplacian: Laplacian,
    squared_wavenumber: float,
    source: ArrayLike = 0.0,
    *,
    load: ArrayLike = 0.0,
    fixed: ArrayLike | None = None,
    values: ArrayLike = 0.0,
) -> Float[np.ndarray, "n ..."]:
    """Solve the Helmholtz equation -Δu - κu = f, or the screened Poisson equation where κ < 0.

    (W - κB) u = B f + load.

    Parameters
    ----------
    laplacian : Laplacian
    squared_wavenumber : float
        κ, in 1/length².
    source, load, fixed, values
        As in `solve_poisson`.

    Returns
    -------
    (n,) or (n, k) float
        u.

    Raises
    ------
    InvalidParameterError
        If κ is not finite, or an eigenvalue of the operator up to rounding, or an argument is wrong
        as in `solve_poisson`.

    See Also
    --------
    es.calculus.factor_equations : The factor, kept for many right-hand sides.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(2))
    >>> es.calculus.solve_helmholtz(laplacian, -4.0, 1.0)[0].round(12).item()
    0.25
    """
    kappa = finite_number(squared_wavenumber, "squared_wavenumber")
    if kappa == 0:
        return solve_poisson(laplacian, source, load=load, fixed=fixed, values=values)
    require_matrix(laplacian)
    matrix = laplacian.stiffness - kappa * laplacian.mass
    solver = factor_definite(matrix, fixed, indefinite=bool(kappa > 0))
    return solver.solve(_right_hand_side(laplacian, source, load), values=values)


def solve_heat(  # noqa: PLR0913 - one keyword for each part of the equation
    laplacian: Laplacian,
    start: ArrayLike,
    t: float,
    n_steps: Integer = 1,
    *,
    source: ArrayLike = 0.0,
    load: ArrayLike = 0.0,
    fixed: ArrayLike | None = None,
    values: ArrayLike = 0.0,
    progress: Progress | None = None,
) -> Float[np.ndarray, "n ..."]:
    """Let heat flow for a time t by implicit steps, with one factor for all of them.

    Each step of length τ = t / n_steps solves (B + τW) u' = B u + τ (B f + load): backward Euler,
    of first order in τ and without a bound on it. Heat is conserved, but for the source, the load
    and what fixed points let out.

    Parameters
    ----------
    laplacian : Laplacian
    start : (n,) or (n, k) float
        Values at time 0.
    t : float
        Time, in length².
    n_steps : int
    source : (n,) or (n, k) float, or a number
        f, in units of u per length², constant in time.
    load : (n,) or (n, k) float, or a number
        Integrated loads, constant in time: `boundary_load` of a flux, or -`divergence` of a field.
    fixed : (c,) int, optional
        Points where values are given (Dirichlet).
    values : (c,) or (c, k) float, or a number
        The values there, constant in time.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    (n,) or (n, k) float
        Values at time t.

    Raises
    ------
    InvalidParameterError
        If t is not positive, n_steps is not in 1..1,000,000, an array has another length or a number is not
        finite, a point is fixed at two values, or the operator has `correct="log"`; or as in
        `factor_equations`.

    See Also
    --------
    es.calculus.factor_equations : The factor of a step, B + τW, kept for many calls.
    es.spectral.apply_heat : Heat of a function, exact to a given accuracy; without sources, loads
        and fixed values.

    Examples
    --------
    The temperature of a bar whose ends are kept at 0 and 1 becomes linear.

    >>> import eigenshape as es
    >>> import numpy as np
    >>> bar = es.cotangent_laplacian(es.shapes.interval(4))
    >>> ends = {"fixed": [0, 4], "values": [0.0, 1.0]}
    >>> es.calculus.solve_heat(bar, np.zeros(5), 10.0, n_steps=20, **ends).round(6).tolist()
    [0.0, 0.25, 0.5, 0.75, 1.0]
    """
    require_matrix(laplacian)
    count = step_number(n_steps)
    time = positive_number(t, "t")
    current = point_functions(start, "start", laplacian.n_points)
    step = time / count
    solver = factor_definite(laplacian.mass + step * laplacian.stiffness, fixed)
    added = step * _right_hand_side(laplacian, source, load)
    report_progress = progress or silent
    for number in range(count):
        report_progress(number / count, f"step {number + 1} of {count}")
        current = solver.solve(_add(laplacian.mass @ current, added), values=values)
    return current


def boundary_load(mesh: MeshLike, flux: ArrayLike) -> Float[np.ndarray, " n"]:
    """Integrate a flux through the boundary of a mesh: ∫ g λ_i over its boundary, at each point.

    The load of the Neumann condition ∂u/∂ν = g, with ν the direction out of the mesh.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m, with a boundary.
    flux : (n,) float, or a number
        g at the points, linear between them; values inside are ignored.

    Returns
    -------
    (n,) float
        In units of the flux times length^(m-1); zero inside.

    Raises
    ------
    InvalidParameterError
        If `flux` does not have one number per point, or a number is not finite.
    InvalidShapeError
        If the mesh has no boundary.

    Examples
    --------
    A flux of 1 out of a unit square:

    >>> import eigenshape as es
    >>> load = es.calculus.boundary_load(es.shapes.grid(4, 4), 1.0)
    >>> load.sum().round(12).item()
    4.0
    """
    mesh = as_simplicial(mesh)
    given = real_numbers(flux, "flux")
    if given.ndim == 0:
        given = np.full(mesh.n_points, given)
    strength = vertex_values(given, "flux", mesh.n_points)
    rim = boundary_vertices(mesh)
    if not rim.size:
        raise InvalidShapeError("A flux needs a boundary to flow through; the mesh is closed.")
    load = np.zeros(mesh.n_points)
    if mesh.dim == 1:
        load[rim] = strength[rim]  # the boundary of a curve is points, of measure 1
        return load
    table = facet_table(mesh)
    edge = SimplicialMesh(mesh.points[rim], np.searchsorted(rim, table.facets[table.boundary]))
    load[rim] = elements.mass(edge, edge.simplices, 1) @ strength[rim]
    return load


def _right_hand_side(
    laplacian: Laplacian, source: ArrayLike, load: ArrayLike
) -> Float[np.ndarray, "n ..."]:
    """Return B f + load."""
    terms = []
    for name, given in (("source", source), ("load", load)):
        numbers = real_numbers(given, name)
        if numbers.ndim == 0:
            numbers = np.full(laplacian.n_points, numbers)
        terms.append(point_functions(numbers, name, laplacian.n_points))
    return _add(laplacian.mass @ terms[0], terms[1])


def _add(one: Float[np.ndarray, "n ..."], two: Float[np.ndarray, "n ..."]) -> np.ndarray:
    """Add functions; one function is added to each of several."""
    if one.ndim != two.ndim:
        one, two = one.reshape(len(one), -1), two.reshape(len(two), -1)
    return one + two
