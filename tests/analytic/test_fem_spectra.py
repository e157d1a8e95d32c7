"""Orders at which finite elements approach eigenvalues that are known, fitted and not assumed."""

import numpy as np
import pytest

from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.domains import ball, box, disc, interval, irregular_grid
from eigenshape.shapes.surfaces import grid
from eigenshape.spectral.solve import solve_spectrum


def worst(mesh, order, eigenvalues, condition):
    laplacian, k = fem_laplacian(mesh, order), len(eigenvalues)
    if condition == "neumann":
        found = solve_spectrum(laplacian, k).eigenvalues
    else:
        found = solve_spectrum(laplacian, k, fixed=fem_boundary_nodes(mesh, order)).eigenvalues
    some = eigenvalues > 0
    return np.abs(found[some] / eigenvalues[some] - 1).max()


def fitted_order(errors, steps):
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
@pytest.mark.parametrize(
    ("make", "sides"),
    [(lambda n: interval(2 * n), [1.0]), (lambda n: grid(n, n, width=2.0), [2.0, 1.0])],
)
def test_flat_domains_converge_with_twice_the_order(make, sides, condition, order):
    eigenvalues = exact.box_eigenvalues(8, sides, condition)
    steps = (8, 12, 16)
    errors = [worst(make(n), order, eigenvalues, condition) for n in steps]
    assert fitted_order(errors, steps) == pytest.approx(2 * order, abs=0.25)


@pytest.mark.parametrize(("order", "times"), [(2, 10), (3, 10)])
@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
def test_at_equal_unknowns_higher_orders_are_ten_times_better(order, times, condition):
    eigenvalues = exact.box_eigenvalues(20, (1.0, 1.0), condition)
    one = worst(grid(36, 36), 1, eigenvalues, condition)
    higher = worst(grid(36 // order, 36 // order), order, eigenvalues, condition)  # 1369 nodes each
    assert one > times * higher


@pytest.mark.parametrize("order", [2, 3])
def test_irregular_triangles_keep_the_order(order):
    eigenvalues, errors, steps = exact.box_eigenvalues(8), [], (6, 9, 13)
    for n in steps:
        errors.append(
            worst(
                irregular_grid(n, n, jitter=0.25, rng=np.random.default_rng(n)),
                order,
                eigenvalues,
                "neumann",
            )
        )
    assert fitted_order(errors, steps) == pytest.approx(2 * order, abs=0.7)


@pytest.mark.parametrize(
    ("make", "steps", "eigenvalues"),
    [
        (disc, (8, 12, 18), exact.disc_eigenvalues),
        (ball, (6, 9, 12), exact.ball_eigenvalues),
        (
            lambda n: box(n, n, n),
            (5, 8, 11),
            lambda k, condition: exact.box_eigenvalues(k, (1, 1, 1), condition),
        ),
    ],
)
@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
def test_linear_elements_converge_with_order_two(make, steps, eigenvalues, condition):
    expected = eigenvalues(9, condition)
    errors = [worst(make(n), 1, expected, condition) for n in steps]
    assert fitted_order(errors, steps) == pytest.approx(2, abs=0.35)


def test_averaged_mass_on_irregular_triangles_is_of_order_two_with_a_small_factor():
    eigenvalues, steps = exact.box_eigenvalues(16), (8, 16, 32)
    errors = {"lumped": [], "consistent": [], "averaged": []}
    mesh = irregular_grid(4, 4, rng=np.random.default_rng(0))
    for _ in steps:
        mesh = subdivide(mesh)
        for mass, found in errors.items():
            values = solve_spectrum(cotangent_laplacian(mesh, mass), 16).eigenvalues
            found.append(np.abs(values[1:] / eigenvalues[1:] - 1).max())
    for found in errors.values():
        assert fitted_order(found, steps) == pytest.approx(2, abs=0.3)
    assert errors["averaged"][-1] < errors["lumped"][-1] / 1.5
    assert errors["averaged"][-1] < errors["consistent"][-1] / 1.5


def test_held_points_may_be_a_part_of_the_boundary():
    mesh = grid(20, 20)
    left = np.flatnonzero(mesh.vertices[:, 0] == 0)
    assert set(left) < set(boundary_vertices(mesh))
    found = solve_spectrum(cotangent_laplacian(mesh, "averaged"), 4, fixed=left).eigenvalues
    modes = np.add.outer(
        (np.arange(4) + 0.5) ** 2, np.arange(4) ** 2
    )  # a sine of odd quarters across, cosines along
    np.testing.assert_allclose(found, np.pi**2 * np.sort(modes, axis=None)[:4], rtol=0.01)
