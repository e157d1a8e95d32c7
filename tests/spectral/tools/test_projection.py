"""Projection, filters and smoothing: identities to rounding, and what is refused."""

from inspect import unwrap  # past the check of types, which only tests have

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es

TORUS = es.shapes.torus(24, 12)
# The full mass matrix, so that both inner products differ.
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(TORUS, "consistent"), 40)
EXACT = 1e-10  # of the size of what is compared


def values(seed, columns=3):
    return np.random.default_rng(seed).standard_normal((TORUS.n_vertices, columns))


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_coefficients_come_back_in_both_inner_products(seed):
    coefficients = np.random.default_rng(seed).standard_normal((40, 2))
    functions = es.spectral.reconstruct(coefficients, SPECTRUM)
    for inner_product in ("mass", "plain"):
        found = es.spectral.project(functions, SPECTRUM, inner_product)
        np.testing.assert_allclose(found, coefficients, atol=EXACT)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_parseval(seed):
    coefficients = es.spectral.project(values(seed), SPECTRUM)
    functions = es.spectral.reconstruct(coefficients, SPECTRUM)
    norm = np.einsum("nd,nd->", functions, SPECTRUM.mass @ functions)
    assert norm == pytest.approx(np.sum(coefficients**2), rel=EXACT)


@pytest.mark.parametrize(
    ("inner_product", "weigh"), [("mass", lambda x: SPECTRUM.mass @ x), ("plain", lambda x: x)]
)
def test_what_is_left_is_orthogonal_to_the_modes(inner_product, weigh):
    functions = values(0)
    coefficients = es.spectral.project(functions, SPECTRUM, inner_product)
    rest = functions - es.spectral.reconstruct(coefficients, SPECTRUM)
    assert np.abs(SPECTRUM.eigenvectors.T @ weigh(rest)).max() < EXACT


def test_all_modes_hold_every_function():
    ball = es.icosphere(1)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), ball.n_vertices)
    found = es.spectral.reconstruct(es.spectral.project(ball.vertices, spectrum), spectrum)
    np.testing.assert_allclose(found, ball.vertices, atol=EXACT)


def test_the_plain_projection_is_the_eigen_skeleton():
    mesh = es.make_creature("fish", n_vertices=500)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 30)
    skeleton = es.deformation.eigen_skeleton(es.rig_shape(mesh, spectrum), 30)
    coefficients = es.spectral.project(mesh.vertices, spectrum, "plain")
    np.testing.assert_allclose(es.spectral.reconstruct(coefficients, spectrum), skeleton, atol=1e-9)


def low_pass(cutoff):
    return lambda eigenvalues: eigenvalues <= cutoff


def heat_filter(t):
    return lambda eigenvalues: np.exp(-t * eigenvalues)


def test_filters_keep_what_they_name():
    cutoff = SPECTRUM.eigenvalues[20] * (1 + 1e-9)
    low = es.spectral.filter_values(values(1), SPECTRUM, low_pass(cutoff))
    coefficients = es.spectral.project(low, SPECTRUM)
    kept = SPECTRUM.eigenvalues <= cutoff
    assert np.abs(coefficients[~kept]).max() < EXACT
    np.testing.assert_allclose(
        coefficients[kept], es.spectral.project(values(1), SPECTRUM)[kept], atol=EXACT
    )
    high = es.spectral.filter_values(values(1), SPECTRUM, lambda each: each > cutoff)
    everything = es.spectral.filter_values(values(1), SPECTRUM, np.ones_like)
    np.testing.assert_allclose(low + high, everything, atol=EXACT)


def test_heat_flows_on_where_it_stopped():
    one, two, both = (heat_filter(t) for t in (0.1, 0.3, 0.4))
    step = es.spectral.filter_values(values(2)[:, 0], SPECTRUM, one)
    again = es.spectral.filter_values(step, SPECTRUM, two)
    np.testing.assert_allclose(
        again, es.spectral.filter_values(values(2)[:, 0], SPECTRUM, both), atol=EXACT
    )


def test_the_rest_is_kept_on_demand():
    same = es.spectral.filter_values(values(3), SPECTRUM, np.ones_like, keep_rest=True)
    np.testing.assert_allclose(same, values(3), atol=EXACT)
    none = es.spectral.filter_values(values(3), SPECTRUM, np.zeros_like, keep_rest=True)
    assert np.abs(es.spectral.project(none, SPECTRUM)).max() < EXACT


@pytest.mark.parametrize("scale", [1e-90, 1.0, 1e90])
def test_smoothing_keeps_the_volume_by_choice_whatever_the_unit(scale):
    mesh = es.TriangleMesh(TORUS.vertices * scale, TORUS.faces)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 40)
    heat = heat_filter(0.05 * scale**2)
    shrunk = es.spectral.smooth_mesh(mesh, spectrum, heat)
    kept = es.spectral.smooth_mesh(mesh, spectrum, heat, keep_volume=True)
    volumes = [es.geometry.enclosed_volume(each) for each in (mesh, shrunk, kept)]
    assert volumes[1] < 0.95 * volumes[0]
    assert volumes[2] == pytest.approx(volumes[0], rel=1e-12)


def test_a_thin_shape_keeps_its_volume():
    """It is the share of the volume that is lost which decides, not how small the volume is."""
    thin = es.TriangleMesh(TORUS.vertices * [1, 1, 1e-4], TORUS.faces)
    kept = es.spectral.smooth_mesh(thin, SPECTRUM, heat_filter(0.05), keep_volume=True)
    volumes = [es.geometry.enclosed_volume(each) for each in (thin, kept)]
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-12)


def test_smoothing_removes_noise():
    ball = es.icosphere(3)
    noise = 0.02 * np.random.default_rng(0).standard_normal(ball.vertices.shape)
    noisy = es.TriangleMesh(ball.vertices + noise, ball.faces)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 16)
    smooth = es.spectral.smooth_mesh(noisy, spectrum, low_pass(20.0))
    away = np.abs(np.linalg.norm(smooth.vertices, axis=1) - 1).mean()
    assert away < np.abs(np.linalg.norm(noisy.vertices, axis=1) - 1).mean() / 3


@pytest.mark.parametrize(
    ("bad", "match"),
    [
        (np.zeros(7), r"values must hold one number per point, shape \(288,\)"),
        (np.zeros((3, 288)), "Transpose it"),
        (np.full(288, np.nan), "values must be finite; entry 0 is nan"),
        (np.full((288, 2), np.inf), r"values must be finite; entry \(0, 0\) is inf"),
    ],
)
def test_bad_values_are_named(bad, match):
    with pytest.raises(es.InvalidParameterError, match=match):
        es.spectral.project(bad, SPECTRUM)
    with pytest.raises(es.InvalidParameterError, match=match):
        es.spectral.filter_values(bad, SPECTRUM, heat_filter(1.0))


def test_other_bad_input_is_named():
    with pytest.raises(es.InvalidParameterError, match="inner_product must be 'mass' or 'plain'"):
        unwrap(es.spectral.project)(np.zeros(288), SPECTRUM, "dot")
    with pytest.raises(es.InvalidParameterError, match="one row per eigenvector, from 1 to 40"):
        es.spectral.reconstruct(np.zeros(41), SPECTRUM)
    with pytest.raises(es.InvalidParameterError, match="that of eigenvector 2 is nan"):
        es.spectral.reconstruct([0.0, 1.0, np.nan], SPECTRUM)


@pytest.mark.parametrize(
    ("response", "match"),
    [
        (0.5, "response must be a function of the eigenvalues"),
        (lambda values: values[:3], "one factor per eigenvalue"),
        (lambda values: np.full_like(values, np.nan), "that of eigenvalue 0 is nan"),
    ],
)
def test_a_response_of_another_form_is_named(response, match):
    with pytest.raises(es.InvalidParameterError, match=match):
        unwrap(es.spectral.filter_values)(values(0), SPECTRUM, response)


def test_a_volume_that_cannot_be_kept_is_named():
    open_mesh = es.shapes.grid(5, 5)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(open_mesh), 10)
    heat = heat_filter(0.01)
    with pytest.raises(es.InvalidShapeError, match="must be closed for its volume to be kept"):
        es.spectral.smooth_mesh(open_mesh, spectrum, heat, keep_volume=True)
    with pytest.raises(es.InvalidShapeError, match="leave some of the volume"):
        es.spectral.smooth_mesh(TORUS, SPECTRUM, low_pass(1e-9), keep_volume=True)
