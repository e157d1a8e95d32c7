import numpy as np
import pytest

import eigenshape as es

MESH = es.make_creature("quadruped", n_vertices=500)
N = MESH.n_vertices
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(MESH, "consistent"), 40)
MAPS = np.column_stack([np.sin(3 * MESH.vertices[:, 0]) + 2.0, MESH.vertices[:, 1] ** 2])


def correlation(one, two, inner):
    ones = np.ones(len(one))
    one, two = (each - ones @ (inner @ each) / inner.sum() for each in (one, two))
    return one @ (inner @ two) / np.sqrt((one @ (inner @ one)) * (two @ (inner @ two)))


def test_a_curve_holds_the_correlations_of_all_reconstructions():
    coefficients = es.spectral.project(MAPS, SPECTRUM)
    curve = es.modes.accuracy_curve(MAPS, SPECTRUM)
    for j in (2, 7, 40):
        fits = es.spectral.reconstruct(coefficients[:j], SPECTRUM)
        expected = [correlation(fits[:, c], MAPS[:, c], SPECTRUM.mass) for c in range(2)]
        np.testing.assert_allclose(curve[j - 1], expected, atol=1e-9)
    assert (curve[0] == 0).all()
    assert (np.diff(curve, axis=0) > -1e-12).all()
    alone = es.modes.accuracy_curve(MAPS[:, 1], SPECTRUM)
    np.testing.assert_allclose(alone, curve[:, 1], atol=1e-12)


def test_a_weighted_curve_is_that_of_weighted_fits():
    weights = np.where(
        MESH.vertices[:, 0] > np.quantile(MESH.vertices[:, 0], 0.2),
        1.0 + MESH.vertices[:, 1] ** 2,
        0.0,
    )
    areas = np.diag(weights * SPECTRUM.mass.sum(axis=1))
    curve = es.modes.accuracy_curve(MAPS, SPECTRUM, weights=weights)
    phi = SPECTRUM.eigenvectors
    for j in (3, 40):
        fit = phi[:, :j] @ np.linalg.solve(
            phi[:, :j].T @ areas @ phi[:, :j], phi[:, :j].T @ areas @ MAPS
        )
        expected = [correlation(fit[:, c], MAPS[:, c], areas) for c in range(2)]
        np.testing.assert_allclose(curve[j - 1], expected, atol=1e-9)
    found = phi @ es.modes.fit_modes(MAPS, SPECTRUM, weights)
    np.testing.assert_allclose(found, fit, atol=1e-9)


def test_what_has_no_weight_may_be_anything():
    known = MESH.vertices[:, 0] > np.quantile(MESH.vertices[:, 0], 0.2)
    hidden = np.where(known, MAPS[:, 0], np.nan)
    filled = np.where(known, MAPS[:, 0], 7.0)
    for call in (es.modes.fit_modes, lambda *a: es.modes.accuracy_curve(*a[:2], weights=a[2])):
        np.testing.assert_array_equal(call(hidden, SPECTRUM, known), call(filled, SPECTRUM, known))
    with pytest.raises(es.InvalidParameterError, match=r"values must be finite; entry \d+ is nan"):
        es.modes.fit_modes(hidden, SPECTRUM, np.ones(N))


def test_even_weights_give_the_projection_of_the_lumped_operator():
    spectrum = es.solve_spectrum(es.cotangent_laplacian(MESH), 20)
    np.testing.assert_allclose(
        es.modes.fit_modes(MAPS, spectrum, np.full(N, 3.0)),
        es.spectral.project(MAPS, spectrum),
        atol=1e-11,
    )


def test_a_constant_map_has_no_accuracy():
    assert np.isnan(es.modes.accuracy_curve(np.full(N, 0.1), SPECTRUM)).all()


def test_bad_weights_are_named():
    weights = np.ones(N)
    weights[7] = -2.0
    with pytest.raises(
        es.InvalidParameterError, match=r"weights must not be negative; entry 7 is -2\.0"
    ):
        es.modes.fit_modes(MAPS, SPECTRUM, weights)
    with pytest.raises(es.InvalidParameterError, match="weights must hold one number per vertex"):
        es.modes.fit_modes(MAPS, SPECTRUM, weights[1:])
    with pytest.raises(es.InvalidParameterError, match="must tell 40 modes apart"):
        es.modes.fit_modes(MAPS, SPECTRUM, np.arange(N) < 30)
