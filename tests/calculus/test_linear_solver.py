"""One factor for many right-hand sides, with fixed values and constraints."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.sparse as sp

import eigenshape as es
from eigenshape.calculus import factor_equations, remove_means, solve_heat, solve_helmholtz

BALL = es.cotangent_laplacian(es.icosphere(2))
SQUARE = es.shapes.grid(5, 5)
PLATE = es.cotangent_laplacian(SQUARE)
RIM = es.geometry.boundary_vertices(SQUARE)
TWO = es.cotangent_laplacian(es.geometry.disjoint_union(es.icosphere(1), es.icosphere(2)))


def poisson_solver(laplacian, fixed=None, constraints=None):
    weights = laplacian.mass.sum(axis=1)
    return factor_equations(laplacian.stiffness, fixed, constraints, weights=weights)


def test_poisson_on_a_closed_shape_has_mean_zero():
    source = remove_means(BALL, np.random.default_rng(0).standard_normal((BALL.n_points, 11)))
    found = poisson_solver(BALL).solve(BALL.mass @ source)
    np.testing.assert_allclose(BALL.stiffness @ found, BALL.mass @ source, atol=1e-12)
    np.testing.assert_allclose(BALL.mass.diagonal() @ found, 0.0, atol=1e-12)


def test_each_component_has_a_constant_of_its_own():
    source = remove_means(TWO, np.random.default_rng(0).standard_normal(TWO.n_points))
    solver = poisson_solver(TWO, fixed=[0])
    found = solver.solve(TWO.mass @ source, values=7.0)
    assert found[0] == 7.0
    np.testing.assert_allclose(TWO.stiffness @ found, TWO.mass @ source, atol=1e-12)
    second = solver.floating == 0
    assert second.sum() == 162
    assert TWO.mass.diagonal()[second] @ found[second] == pytest.approx(0.0, abs=1e-12)


def test_fixed_values_are_met_and_harmonic_functions_are_linear():
    values = SQUARE.vertices[RIM, 0] - 3 * SQUARE.vertices[RIM, 1]
    found = poisson_solver(PLATE, RIM).solve(values=values)
    np.testing.assert_allclose(found, SQUARE.vertices @ [1, -3, 0], atol=1e-13)


def test_one_column_of_values_serves_all_right_hand_sides():
    rng = np.random.default_rng(1)
    right = rng.standard_normal((PLATE.n_points, 3))
    solver = poisson_solver(PLATE, RIM)
    found = solver.solve(right, values=rng.standard_normal((len(RIM), 1)))
    assert found.shape == (PLATE.n_points, 3)
    assert (found[RIM, 0] == found[RIM, 2]).all()


def test_constraints_are_met_by_the_stationary_point():
    rng = np.random.default_rng(2)
    C = sp.random_array((3, PLATE.n_points), density=0.3, rng=rng)
    fixed, right = [0, 7], rng.standard_normal(PLATE.n_points)
    solver = poisson_solver(PLATE, fixed, C)
    found = solver.solve(right, values=[1.0, 2.0], targets=[3.0, 4.0, 5.0])
    np.testing.assert_allclose(C @ found, [3, 4, 5])
    # The gradient of the energy is a combination of the constraints, but for fixed points.
    slope = np.delete(PLATE.stiffness @ found - right, fixed)
    rows = np.delete(C.toarray(), fixed, axis=1)
    rest = slope - rows.T @ np.linalg.lstsq(rows.T, slope, rcond=None)[0]
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)


def test_a_constraint_chooses_the_constant_of_a_closed_shape():
    source = remove_means(TWO, np.random.default_rng(3).standard_normal(TWO.n_points))
    row = np.zeros((1, TWO.n_points))
    row[0, 3] = 2.0
    found = poisson_solver(TWO, constraints=row).solve(TWO.mass @ source, targets=[10.0])
    assert found[3] == pytest.approx(5.0)
    np.testing.assert_allclose(TWO.stiffness @ found, TWO.mass @ source, atol=1e-11)
    other = np.arange(TWO.n_points) >= 42
    assert TWO.mass.diagonal()[other] @ found[other] == pytest.approx(0.0, abs=1e-11)


def test_redundant_constraints_do_no_harm_and_contradictions_are_named():
    row = np.zeros((2, PLATE.n_points))
    row[:, 9] = [1.0, 2.0]
    solver = poisson_solver(PLATE, [0], row)
    assert solver.solve(targets=[1.0, 2.0])[9] == pytest.approx(1.0)
    with pytest.raises(es.InvalidParameterError, match="must not contradict each other"):
        solver.solve(targets=[1.0, 3.0])
    at_fixed = np.zeros((1, PLATE.n_points))
    at_fixed[0, 0] = 1.0
    with pytest.raises(
        es.InvalidParameterError, match="constraint 0 would hold with target 2 only"
    ):
        poisson_solver(PLATE, [0], at_fixed).solve(values=[2.0], targets=[5.0])


def test_a_screened_equation_is_definite_and_a_wave_equation_is_solved_too():
    right = np.random.default_rng(4).standard_normal(BALL.n_points)
    for kappa in (-3.0, 4.0):
        found = solve_helmholtz(BALL, kappa, load=right)
        np.testing.assert_allclose(
            BALL.stiffness @ found - kappa * (BALL.mass @ found), right, atol=1e-12
        )


def test_heat_keeps_its_sum_and_a_constant():
    start = np.random.default_rng(5).random(TWO.n_points)
    after = solve_heat(TWO, start, 0.3)
    assert (TWO.mass @ after).sum() == pytest.approx((TWO.mass @ start).sum())
    np.testing.assert_allclose(solve_heat(TWO, np.ones(TWO.n_points), 0.3), 1.0)


def test_threads_share_a_solver():
    rights = remove_means(BALL, np.random.default_rng(6).standard_normal((BALL.n_points, 16)))
    loads = BALL.mass @ rights
    solver = poisson_solver(BALL)
    alone = [solver.solve(load) for load in loads.T]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(solver.solve, loads.T))
    np.testing.assert_array_equal(alone, together)


def test_a_solver_says_what_it_solves():
    assert repr(poisson_solver(PLATE, [0, 7])) == "LinearSolver(36 points, 2 fixed, 0 constraints)"


def test_everything_may_be_fixed():
    solver = poisson_solver(PLATE, np.arange(PLATE.n_points))
    assert (solver.solve(values=4.0) == 4.0).all()


def test_a_load_that_does_not_balance_is_named_and_the_remedy_works():
    with pytest.raises(es.InvalidParameterError, match="the right-hand side must sum to 0") as info:
        poisson_solver(TWO).solve(TWO.mass @ np.ones(TWO.n_points))
    assert "on the component of point 0 it sums to" in str(info.value)
    assert "(2 such components)" in str(info.value)
    for source in (np.ones(204), 1 + 1e-9 * np.sin(np.arange(204))):
        left = remove_means(TWO, source)
        np.testing.assert_allclose(poisson_solver(TWO).solve(TWO.mass @ left), 0.0, atol=1e-8)


@pytest.mark.parametrize("scale", [1e-100, 1e-6, 1e6, 1e100])
def test_whether_a_load_balances_does_not_depend_on_its_unit(scale):
    load = TWO.mass @ remove_means(TWO, np.sin(np.arange(TWO.n_points)))
    solver = poisson_solver(TWO)
    np.testing.assert_allclose(solver.solve(scale * load) / scale, solver.solve(load), atol=1e-12)
    load[0] += 1e-6
    with pytest.raises(es.InvalidParameterError, match="the right-hand side must sum to 0"):
        solver.solve(scale * load)


def test_wrong_arguments_are_named():
    solver = poisson_solver(PLATE, [0, 7, 0])
    assert solver.solve(values=[1.0, 2.0, 1.0])[0] == 1.0
    with pytest.raises(
        es.InvalidParameterError, match="A point can be fixed at one value only; point 0"
    ):
        solver.solve(values=[1.0, 2.0, 3.0])
    with pytest.raises(
        es.InvalidParameterError, match="values must hold one number per fixed point"
    ):
        solver.solve(values=[1.0, 2.0])
    with pytest.raises(
        es.InvalidParameterError, match="right must be finite; that of point 2 is nan"
    ):
        solver.solve(np.where(np.arange(36) == 2, np.nan, 0.0))
    with pytest.raises(es.InvalidParameterError, match="must have one column, or equally many"):
        solver.solve(np.zeros((36, 2)), values=np.zeros((3, 4)))
    with pytest.raises(es.InvalidParameterError, match=r"fixed must hold points 0\.\.35"):
        poisson_solver(PLATE, [36])
    with pytest.raises(
        es.InvalidParameterError, match="constraints must have one column per point"
    ):
        poisson_solver(PLATE, [0], np.zeros((2, 3)))
    with pytest.raises(es.InvalidParameterError, match="constraints must be finite"):
        poisson_solver(PLATE, [0], np.full((1, 36), np.nan))
    with pytest.raises(es.InvalidParameterError, match="t must be positive"):
        solve_heat(PLATE, np.zeros(36), 0.0)
    with pytest.raises(es.InvalidParameterError, match="squared_wavenumber must be finite"):
        solve_helmholtz(PLATE, np.inf)


def test_matrices_without_a_solution_are_named():
    with pytest.raises(es.InvalidParameterError, match="must be a square sparse matrix"):
        factor_equations(sp.csr_array(np.ones((2, 3))))
    with pytest.raises(es.InvalidParameterError, match="matrix of a system must be finite"):
        factor_equations(sp.csr_array([[np.inf]]))
    with pytest.raises(es.InvalidParameterError, match="matrix of a system must be symmetric"):
        factor_equations(sp.csr_array([[1.0, 2.0], [0.0, 1.0]]))
    with pytest.raises(es.InvalidParameterError, match="only if the matrix is positive semidef"):
        factor_equations(sp.csr_array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(es.InvalidParameterError, match="must have one solution; a pivot is 0"):
        factor_equations(sp.csr_array([[0.0, 1.0], [1.0, 0.0]]), indefinite=True)
    rows = np.random.default_rng(7).standard_normal((2, 3))
    with pytest.raises(es.InvalidParameterError, match="is zero up to rounding"):
        factor_equations(sp.csr_array(rows.T @ rows))
