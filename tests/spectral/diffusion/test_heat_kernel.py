"""Entries of the heat kernel, and the heat trace with what is missing from it."""

from itertools import pairwise

import numpy as np
import pytest

from certeig.kit import memory
from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_laplacian
from eigenshape.shapes.exact import sphere_eigenvalues
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.diffusion.heat_flow import apply_heat
from eigenshape.spectral.diffusion.heat_kernel import heat_kernel, heat_trace
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum

LAPLACIAN = cotangent_laplacian(torus(12, 9), "consistent")
SPECTRUM = solve_spectrum(LAPLACIAN, 40)
TIMES = [0.02, 0.3, 2.0]


def test_its_diagonal_is_the_heat_kernel_signature():
    kernel = heat_kernel(SPECTRUM, np.arange(108), None, TIMES)
    assert kernel.shape == (108, 108, 3)
    np.testing.assert_allclose(
        np.einsum("iiq->iq", kernel), heat_kernel_signature(SPECTRUM, TIMES), rtol=1e-12
    )
    np.testing.assert_allclose(kernel, kernel.transpose(1, 0, 2), atol=1e-14)


def test_it_is_the_density_of_the_heat_operator():
    kernel = heat_kernel(SPECTRUM, np.arange(108), None, 0.3)
    values = np.random.default_rng(0).standard_normal(108)
    np.testing.assert_allclose(
        kernel @ (LAPLACIAN.mass @ values), apply_heat(SPECTRUM, values, 0.3), atol=1e-12
    )
    np.testing.assert_allclose(kernel @ (LAPLACIAN.mass @ np.ones(108)), 1, atol=1e-10)


def test_single_numbers_have_no_axis():
    assert heat_kernel(SPECTRUM, 3, 5, 0.1).shape == ()
    assert heat_kernel(SPECTRUM, [3], 5, 0.1).shape == (1,)
    assert heat_kernel(SPECTRUM, 3, None, 0.1).shape == (108,)
    assert heat_kernel(SPECTRUM, 3, [5, 6], TIMES).shape == (2, 3)
    assert heat_kernel(SPECTRUM, [1, 2], None, [0.1]).shape == (2, 108, 1)


def test_points_and_times_that_are_not_there_are_named(monkeypatch):
    with pytest.raises(
        InvalidParameterError, match=r"a point of x must lie in 0\.\.107; it is 108"
    ):
        heat_kernel(SPECTRUM, 108, None, 0.1)
    with pytest.raises(InvalidParameterError, match=r"a point of y must lie in 0\.\.107; it is -1"):
        heat_kernel(SPECTRUM, 1, [-1], 0.1)
    with pytest.raises(InvalidParameterError, match=r"t must be positive and finite; entry 0 is 0"):
        heat_kernel(SPECTRUM, 1, 1, 0.0)
    monkeypatch.setattr(memory, "machine_memory", lambda: 1000.0)
    with pytest.raises(InvalidParameterError, match="A heat kernel must fit into 50 % of the"):
        heat_kernel(SPECTRUM, 1, None, 0.1)


def test_an_interval_of_the_spectrum_has_no_heat():
    middle = solve_spectrum(LAPLACIAN, below=30.0, above=10.0)
    for call in (lambda: heat_kernel(middle, 0, 0, 1.0), lambda: heat_trace(middle, [1.0])):
        with pytest.raises(InvalidParameterError, match="must begin with the lowest eigenvalue"):
            call()


def test_the_trace_of_all_points_is_within_the_bound():
    whole = heat_trace(solve_spectrum(LAPLACIAN, 108), TIMES)
    np.testing.assert_array_equal(whole.remainders, 0)
    for k in (5, 40, 107):
        part = heat_trace(solve_spectrum(LAPLACIAN, k), TIMES)
        assert (part.values <= whole.values + 1e-12).all()
        assert (whole.values <= part.values + part.remainders + 1e-12).all()


def test_the_trace_is_the_integral_of_the_signature():
    laplacian = cotangent_laplacian(torus(12, 9))
    spectrum = solve_spectrum(laplacian, 30)
    integral = laplacian.mass.diagonal() @ heat_kernel_signature(spectrum, TIMES)
    np.testing.assert_allclose(heat_trace(spectrum, TIMES).values, integral, rtol=1e-12)


@pytest.mark.long
def test_the_trace_of_the_sphere_is_right_to_six_digits():
    # Quadratic elements leave the error of flat triangles, a series in h²: three levels of
    # refinement take two terms away (Romberg).
    times = np.array([0.5, 1.0, 2.0])
    rows = [
        heat_trace(solve_spectrum(fem_laplacian(icosphere(level), 2), 64), times).values
        for level in (2, 3, 4)
    ]
    once = [(4 * fine - coarse) / 3 for coarse, fine in pairwise(rows)]
    twice = (16 * once[1] - once[0]) / 15
    exact = np.exp(-np.outer(times, sphere_eigenvalues(400))).sum(axis=1)
    assert np.abs(rows[-1] / exact - 1).max() > 1e-4
    np.testing.assert_allclose(twice, exact, rtol=1e-6)
