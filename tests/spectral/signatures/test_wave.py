import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError


@pytest.fixture(scope="module")
def torus():
    mesh = es.shapes.torus(30, 15)
    return mesh, es.solve_spectrum(es.cotangent_laplacian(mesh), 80)


def test_each_energy_is_a_probability(torus):
    _, spectrum = torus
    found = es.wave_kernel_signature(spectrum)
    assert found.shape == (450, 100)
    assert (found > 0).all()
    np.testing.assert_allclose(spectrum.mass.diagonal() @ found, 1, rtol=1e-12)


def test_on_a_sphere_every_point_is_as_likely():
    # Pairs l = 0 to 6, all whole. On a mesh those of one l differ a little, and lie on the slope of a band.
    errors = []
    for level in (2, 3, 4):
        spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(level), "averaged"), 49)
        errors.append(np.abs(4 * np.pi * es.wave_kernel_signature(spectrum) - 1).max())
    assert (np.divide(errors[:-1], errors[1:]) > 3).all()
    assert errors[-1] < 0.02


def test_a_narrow_band_is_one_eigenfunction():
    mesh = es.TriangleMesh(
        es.shapes.grid(14, 11).vertices * [1.0, 0.77, 1.0], es.shapes.grid(14, 11).faces
    )  # no two are equal
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 12)
    levels = np.log(spectrum.eigenvalues[[3, 7]])
    found = es.wave_kernel_signature(spectrum, levels, sigma=1e-4)
    np.testing.assert_allclose(found, spectrum.eigenvectors[:, [3, 7]] ** 2, rtol=1e-9, atol=1e-9)
    beyond = es.wave_kernel_signature(
        spectrum, [50.0], sigma=1e-4
    )  # every weight underflows: the last counts
    np.testing.assert_allclose(
        beyond[:, 0], spectrum.eigenvectors[:, -1] ** 2, rtol=1e-9, atol=1e-9
    )


def test_default_energies_keep_two_deviations_from_both_ends(torus):
    _, spectrum = torus
    levels, sigma = es.spectral.default_energies(spectrum, 50)
    assert len(levels) == 50
    np.testing.assert_allclose(np.diff(levels), sigma / 7)
    ends = np.log(spectrum.eigenvalues[[1, -1]])
    np.testing.assert_allclose([levels[0] - ends[0], ends[1] - levels[-1]], 2 * sigma)


@pytest.mark.parametrize("scale", [2.0**150, 2.0**-150])
def test_the_product_with_the_area_has_no_scale(torus, scale):
    mesh, spectrum = torus
    other = es.solve_spectrum(
        es.cotangent_laplacian(es.TriangleMesh(mesh.vertices * scale, mesh.faces)), 80
    )
    one, two = (found.mass.sum() * es.wave_kernel_signature(found) for found in (spectrum, other))
    np.testing.assert_allclose(one, two, rtol=1e-8)


def test_bad_parameters_are_named(torus):
    _, spectrum = torus
    with pytest.raises(InvalidParameterError, match="energies must be finite; entry 1 is nan"):
        es.wave_kernel_signature(spectrum, [1.0, np.nan])
    with pytest.raises(
        InvalidParameterError, match=r"energies must be a list of numbers; the shape is \(0,\)"
    ):
        es.wave_kernel_signature(spectrum, [])
    with pytest.raises(
        InvalidParameterError, match="sigma must be positive and finite; entry 0 is -1"
    ):
        es.wave_kernel_signature(spectrum, sigma=-1.0)
    with pytest.raises(InvalidParameterError, match="n_energies must be at least 2; it is 1"):
        es.spectral.default_energies(spectrum, 1)
    one = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(1)), 1)
    with pytest.raises(
        InvalidParameterError, match="must have an eigenvalue above 0; its 1 are all 0"
    ):
        es.wave_kernel_signature(one)
    two = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(9, 7)), 2)
    with pytest.raises(
        InvalidParameterError, match="range of logarithms of eigenvalues must be positive"
    ):
        es.spectral.default_energies(two)
