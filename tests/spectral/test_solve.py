from inspect import unwrap

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.topology import boundary_edges
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid
from eigenshape.spectral.solve import solve_spectrum

MESH = grid(24, 24)
RIM = np.unique(boundary_edges(MESH))


@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
def test_a_drum_of_the_unit_square(mass):
    modes = np.arange(1, 6) ** 2
    exact = np.pi**2 * np.sort(np.add.outer(modes, modes), axis=None)[:6]  # 2, 5, 5, 8, 10, 10
    laplacian = cotangent_laplacian(MESH, mass)
    found = solve_spectrum(laplacian, 6, fixed=RIM)
    np.testing.assert_allclose(found.eigenvalues, exact, rtol=0.03)
    assert found.certificate.complete
    assert not found.eigenvectors[RIM].any()
    gram = found.eigenvectors.T @ (laplacian.mass @ found.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(6), atol=1e-11)


def test_the_lowest_mode_is_a_product_of_sines():
    lowest = np.abs(solve_spectrum(cotangent_laplacian(MESH), 1, fixed=RIM).eigenvectors[:, 0])
    sines = 2 * np.sin(np.pi * MESH.vertices[:, 0]) * np.sin(np.pi * MESH.vertices[:, 1])
    np.testing.assert_allclose(lowest, sines, atol=1e-10)  # of the five-point stencil too, exactly


def test_a_point_may_be_named_twice():
    laplacian = cotangent_laplacian(grid(4, 4))
    one, two = (
        solve_spectrum(laplacian, 3, fixed=np.array(fixed)).eigenvalues
        for fixed in ([3, 0], [0, 3, 3, 0])
    )
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("bad", [-1, 25, 2**40])
def test_points_out_of_range_are_refused(bad):
    with pytest.raises(
        InvalidParameterError, match=rf"fixed must hold points 0\.\.24; entry 1 is {bad}"
    ):
        solve_spectrum(cotangent_laplacian(grid(4, 4)), 1, fixed=np.array([0, bad]))


def test_all_points_fixed_are_refused():
    with pytest.raises(
        InvalidParameterError, match="At least one point must be free; all 25 are fixed"
    ):
        solve_spectrum(cotangent_laplacian(grid(4, 4)), 1, fixed=np.arange(25))


def test_more_pairs_than_free_points_are_refused():
    with pytest.raises(InvalidParameterError, match=r"k must lie in 1\.\.9; it is 10"):
        solve_spectrum(
            cotangent_laplacian(grid(4, 4)), 10, fixed=np.unique(boundary_edges(grid(4, 4)))
        )


def test_a_mask_is_no_list_of_points():
    with pytest.raises(
        InvalidParameterError, match=r"fixed must be a list of point numbers; .* bool.*flatnonzero"
    ):
        solve_spectrum(cotangent_laplacian(grid(4, 4)), 1, fixed=np.zeros(25, dtype=bool))


def test_no_fixed_points_is_the_whole_operator():
    laplacian = cotangent_laplacian(grid(4, 4))
    one, two = solve_spectrum(laplacian, 3), solve_spectrum(laplacian, 3, fixed=[])
    np.testing.assert_array_equal(one.eigenvectors, two.eigenvectors)


@pytest.mark.parametrize("method", ["certified", "approximate"])
def test_fixed_points_method_and_cache_combine(method, tmp_path):
    laplacian = cotangent_laplacian(MESH)
    plain = solve_spectrum(laplacian, 5, fixed=RIM, method=method)
    for _ in range(2):  # computed, then loaded
        kept = solve_spectrum(laplacian, 5, fixed=RIM, method=method, cache=tmp_path)
        for name in ("eigenvalues", "eigenvectors", "residuals"):
            np.testing.assert_array_equal(getattr(kept, name), getattr(plain, name))
        assert kept.certificate == plain.certificate
        assert (kept.mass != laplacian.mass).nnz == 0
    assert len(list(tmp_path.iterdir())) == 1
    assert not plain.eigenvectors[RIM].any()


def test_each_request_has_a_file_of_its_own(tmp_path):
    laplacian = cotangent_laplacian(MESH)
    for options in (
        {},
        {"fixed": RIM},
        {"fixed": RIM[:9]},
        {"method": "approximate"},
        {"method": "approximate", "accuracy": 1e-2},
        {"method": "approximate", "max_residual": 1e-2},
    ):
        solve_spectrum(laplacian, 4, **options, cache=tmp_path)
    solve_spectrum(laplacian, 4, method="approximate", accuracy=1e-3, cache=tmp_path)  # the default
    assert len(list(tmp_path.iterdir())) == 6


def test_an_interval_with_fixed_points_is_kept(tmp_path):
    laplacian = cotangent_laplacian(MESH)
    one = solve_spectrum(laplacian, fixed=RIM, above=30.0, below=90.0)
    two = solve_spectrum(laplacian, fixed=RIM, above=30.0, below=90.0, cache=tmp_path)
    np.testing.assert_array_equal(one.eigenvectors, two.eigenvectors)
    assert one.certificate.first == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"k": None, "below": 9.0, "method": "approximate"},
            r"method='approximate' needs k, because .* below is 9\.0\. Pass k instead",
        ),
        ({"accuracy": 1e-3}, r"accuracy is for method='approximate'; it is 0\.001"),
        ({"max_residual": 1e-3}, r"max_residual is for method='approximate'; it is 0\.001"),
        ({"below": 3.0}, r"Exactly one of k and below must be given; k is 3 and below is 3\.0"),
    ],
)
def test_options_that_do_not_go_together_are_refused(options, message):
    with pytest.raises(InvalidParameterError, match=message):
        solve_spectrum(cotangent_laplacian(grid(4, 4)), **{"k": 3, **options})


def test_other_methods_are_refused():
    with pytest.raises(
        InvalidParameterError, match="method must be 'certified' or 'approximate'; it is 'exact'"
    ):
        unwrap(solve_spectrum)(cotangent_laplacian(grid(4, 4)), 3, method="exact")
