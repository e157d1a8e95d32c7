import numpy as np
import pytest

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.topology import boundary_edges
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid
from eigenshape.spectral.solver.dirichlet import solve_dirichlet

MESH = grid(24, 24)
RIM = np.unique(boundary_edges(MESH))


@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
def test_a_drum_of_the_unit_square(mass):
    modes = np.arange(1, 6) ** 2
    exact = np.pi**2 * np.sort(np.add.outer(modes, modes), axis=None)[:6]  # 2, 5, 5, 8, 10, 10
    laplacian = cotangent_laplacian(MESH, mass)
    found = solve_dirichlet(laplacian, 6, RIM)
    np.testing.assert_allclose(found.eigenvalues, exact, rtol=0.03)
    assert found.certificate.complete
    assert not found.eigenvectors[RIM].any()
    gram = found.eigenvectors.T @ (laplacian.mass @ found.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(6), atol=1e-11)


def test_the_lowest_mode_is_a_product_of_sines():
    lowest = np.abs(solve_dirichlet(cotangent_laplacian(MESH), 1, RIM).eigenvectors[:, 0])
    sines = 2 * np.sin(np.pi * MESH.vertices[:, 0]) * np.sin(np.pi * MESH.vertices[:, 1])
    np.testing.assert_allclose(lowest, sines, atol=1e-10)  # of the five-point stencil too, exactly


def test_a_point_may_be_named_twice():
    laplacian = cotangent_laplacian(grid(4, 4))
    one, two = (
        solve_dirichlet(laplacian, 3, np.array(fixed)).eigenvalues
        for fixed in ([3, 0], [0, 3, 3, 0])
    )
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("bad", [-1, 25, 2**40])
def test_points_out_of_range_are_refused(bad):
    with pytest.raises(
        InvalidParameterError, match=rf"fixed must hold points 0\.\.24; entry 1 is {bad}"
    ):
        solve_dirichlet(cotangent_laplacian(grid(4, 4)), 1, np.array([0, bad]))


def test_all_points_fixed_are_refused():
    with pytest.raises(InvalidParameterError, match="Some point must be free; all 25 are fixed"):
        solve_dirichlet(cotangent_laplacian(grid(4, 4)), 1, np.arange(25))


def test_more_pairs_than_free_points_are_refused():
    with pytest.raises(InvalidParameterError, match=r"k must lie in 1\.\.9; it is 10"):
        solve_dirichlet(cotangent_laplacian(grid(4, 4)), 10, np.unique(boundary_edges(grid(4, 4))))
