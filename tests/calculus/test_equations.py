"""Poisson, Helmholtz and heat equations, and constrained quadratic problems."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

import eigenshape as es
from eigenshape.calculus import (
    boundary_load,
    divergence,
    factor_equations,
    gradient,
    polyharmonic_matrix,
    remove_means,
    solve_harmonic,
    solve_heat,
    solve_helmholtz,
    solve_poisson,
)

BALL = es.icosphere(2)
SQUARE = es.shapes.grid(8, 8)
PLATE = es.cotangent_laplacian(SQUARE)
RIM = es.geometry.boundary_vertices(SQUARE)
SOLID = es.shapes.box(4, 4, 4)


def test_neumann_flux_of_a_linear_function_gives_it_back():
    # u = x on the unit square has flux 1 out on the right, -1 on the left.
    x, y, _ = SQUARE.vertices.T
    load = np.zeros(SQUARE.n_vertices)
    for side, sign in ((x == 1.0, 1.0), (x == 0.0, -1.0)):
        ends = np.array([0.5 if y_ in (0.0, 1.0) else 1.0 for y_ in y[side]])
        load[side] = sign * ends / 8
    found = solve_poisson(PLATE, load=load)
    np.testing.assert_allclose(found - found.mean(), x - x.mean(), atol=1e-12)


@pytest.mark.parametrize(
    ("mesh", "size"), [(SQUARE, 4.0), (SOLID, 6.0), (es.shapes.interval(5), 2.0)]
)
def test_a_flux_of_one_integrates_to_the_boundary(mesh, size):
    load = boundary_load(mesh, 1.0)
    assert load.sum() == pytest.approx(size)
    inside = np.setdiff1d(np.arange(mesh.n_points), es.geometry.boundary_vertices(mesh))
    assert (load[inside] == 0).all()


def test_a_linear_flux_is_integrated_exactly():
    load = boundary_load(SOLID, SOLID.points[:, 0])
    assert load.sum() == pytest.approx(1.0 + 0.0 + 4 * 0.5)


def test_poisson_inverts_the_gradient():
    values = np.random.default_rng(0).standard_normal((BALL.n_vertices, 2))
    laplacian = es.cotangent_laplacian(BALL)
    found = solve_poisson(laplacian, load=-divergence(BALL, gradient(BALL, values)))
    np.testing.assert_allclose(found, remove_means(laplacian, values), atol=1e-12)


def test_poisson_in_a_solid_with_dirichlet_values():
    laplacian, rim = es.cotangent_laplacian(SOLID), es.geometry.boundary_vertices(SOLID)
    plane = SOLID.points @ [1.0, -2.0, 0.5]
    found = solve_poisson(laplacian, fixed=rim, values=plane[rim])
    np.testing.assert_allclose(found, plane, atol=1e-13)


def test_steps_of_heat_are_solves_of_the_kept_factor():
    laplacian = es.cotangent_laplacian(BALL)
    start = np.random.default_rng(1).random((BALL.n_vertices, 2))
    solver = factor_equations(laplacian.mass + 0.05 * laplacian.stiffness)
    expected = start
    for _ in range(4):
        expected = solver.solve(laplacian.mass @ expected)
    np.testing.assert_array_equal(solve_heat(laplacian, start, 0.2, 4), expected)


def test_a_source_adds_heat_and_fixed_ends_let_it_out():
    laplacian = es.cotangent_laplacian(es.shapes.interval(20))
    start = np.zeros(21)
    kept = solve_heat(laplacian, start, 3.0, 5, source=2.0)
    np.testing.assert_allclose(kept, 6.0)
    # The steady state of u'' + 2 = 0 with u(0) = u(1) = 0.
    steady = solve_heat(laplacian, start, 10.0, 50, source=2.0, fixed=[0, 20])
    x = np.linspace(0, 1, 21)
    np.testing.assert_allclose(steady, x * (1 - x), atol=1e-12)
    columns = solve_heat(laplacian, start, 3.0, source=np.ones((21, 2)))
    np.testing.assert_allclose(columns, 3.0)


def test_heat_that_flows_in_through_one_end():
    # u = x²/2 + t solves u_t = u_xx with flux 0 in on the left and 1 on the right; implicit steps
    # and linear elements are exact for it.
    line = es.shapes.interval(20)
    x, laplacian = line.points[:, 0], es.cotangent_laplacian(line)
    found = solve_heat(laplacian, x**2 / 2, 0.7, 3, load=boundary_load(line, x))
    np.testing.assert_allclose(found, x**2 / 2 + 0.7, atol=1e-12)


def test_helmholtz_of_an_eigenfunction():
    laplacian = es.cotangent_laplacian(BALL)
    values, modes = eigh(laplacian.stiffness.toarray(), laplacian.mass.toarray())
    value, mode = values[4], modes[:, 4]
    found = solve_helmholtz(es.cotangent_laplacian(BALL), 1.0, mode)
    np.testing.assert_allclose(found, mode / (value - 1.0), atol=1e-8)


def test_biharmonic_functions_through_linear_values_are_linear_in_one_dimension():
    bar = es.cotangent_laplacian(es.shapes.interval(10))
    x = np.linspace(0, 1, 11)
    found = solve_harmonic(bar, [0, 1, 9, 10], x[[0, 1, 9, 10]], order=2)
    np.testing.assert_allclose(found, x, atol=1e-9)


def test_biharmonic_functions_have_no_slope_where_the_boundary_is_free():
    # Linear functions have energy there, in proportion to the number of points at the boundary.
    energies = []
    for n in (8, 16):
        sheet = es.shapes.grid(n, n)
        laplacian, x = es.cotangent_laplacian(sheet), sheet.vertices[:, 0]
        energies.append(x @ polyharmonic_matrix(laplacian) @ x)
    assert energies[1] == pytest.approx(2 * energies[0], rel=0.05)
    # With values on two sides alone, the solution has slope 0 there: 3x² - 2x³, not x.
    ends = np.flatnonzero((x == 0) | (x == 1))
    found = solve_harmonic(laplacian, ends, x[ends], order=2)
    np.testing.assert_allclose(found, 3 * x**2 - 2 * x**3, atol=0.02)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_polyharmonic_energies_are_symmetric_and_leave_constants(order):
    energy = polyharmonic_matrix(es.cotangent_laplacian(BALL), order)
    assert abs(energy - energy.T).max() == 0
    largest = abs(energy).max()
    np.testing.assert_allclose(energy @ np.ones(BALL.n_vertices) / largest, 0.0, atol=1e-13)
    rest = es.cotangent_laplacian(BALL)
    u = np.random.default_rng(2).standard_normal(BALL.n_vertices)
    for _ in range(order - 1):
        u = (rest.stiffness @ u) / rest.mass.diagonal()
    v = np.random.default_rng(2).standard_normal(BALL.n_vertices)
    assert v @ energy @ v == pytest.approx(v @ rest.stiffness @ u)


def test_quadratic_problems_with_bounds_on_sums():
    rng = np.random.default_rng(3)
    Q = sp.csr_array(np.diag(rng.random(6) + 1))
    C, b = rng.standard_normal((2, 6)), rng.standard_normal(6)
    found = factor_equations(Q, constraints=C).solve(b, targets=[1.0, 2.0])
    np.testing.assert_allclose(C @ found, [1.0, 2.0])
    kernel = np.linalg.svd(C)[2][2:]
    np.testing.assert_allclose(kernel @ (Q @ found - b), 0.0, atol=1e-12)


def test_solutions_scale_exactly_with_the_unit():
    unit = 2.0**100
    large = es.cotangent_laplacian(es.TriangleMesh(BALL.vertices * unit, BALL.faces))
    small = es.cotangent_laplacian(BALL)
    source = remove_means(small, np.random.default_rng(4).standard_normal(BALL.n_vertices))
    found = solve_poisson(large, source / unit / unit)
    np.testing.assert_array_equal(found, solve_poisson(small, source))


def test_an_operator_with_corrected_eigenvalues_has_no_equation():
    corrected = es.mesh_laplacian(BALL, correct="log")
    for build in (
        solve_poisson,
        lambda operator: solve_helmholtz(operator, 1.0),
        lambda operator: solve_heat(operator, np.ones(operator.n_points), 1.0),
        polyharmonic_matrix,
    ):
        with pytest.raises(es.InvalidParameterError, match="must be given by its matrices alone"):
            build(corrected)
        build(es.mesh_laplacian(BALL))  # the remedy


def test_wrong_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="source must hold one number per point"):
        solve_poisson(PLATE, np.zeros(3))
    with pytest.raises(es.InvalidParameterError, match="load must be finite"):
        solve_poisson(PLATE, load=np.full(81, np.nan))
    with pytest.raises(es.InvalidShapeError, match="A flux needs a boundary"):
        boundary_load(BALL, 1.0)
    with pytest.raises(es.InvalidParameterError, match="flux must hold one number per vertex"):
        boundary_load(SQUARE, np.zeros(3))
    with pytest.raises(es.InvalidParameterError, match="n_steps must be at least 1"):
        solve_heat(PLATE, np.zeros(81), 1.0, 0)
    with pytest.raises(es.InvalidParameterError, match="t must be positive"):
        solve_heat(PLATE, np.zeros(81), -1.0)
    with pytest.raises(es.InvalidParameterError, match="needs a diagonal mass"):
        polyharmonic_matrix(es.cotangent_laplacian(BALL, "consistent"))
    pair = es.cotangent_laplacian(es.geometry.disjoint_union(BALL, BALL))
    with pytest.raises(es.InvalidParameterError, match="Each component must have a fixed point"):
        solve_harmonic(pair, [0], [1.0])


def test_a_solution_that_overflows_is_refused():
    ball = es.icosphere(1)
    source = 2 * ball.vertices[:, 2]
    huge = es.cotangent_laplacian(es.TriangleMesh(1e150 * ball.vertices, ball.faces))
    found = es.calculus.solve_poisson(huge, source)
    expected = es.calculus.solve_poisson(es.cotangent_laplacian(ball), source)
    np.testing.assert_allclose(found / 1e150 / 1e150, expected, rtol=1e-9, atol=1e-12)
    with pytest.raises(
        es.InvalidParameterError, match="must fit into floating-point numbers; at po"
    ):
        es.calculus.solve_poisson(huge, 1e8 * source)
