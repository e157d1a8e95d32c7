import numpy as np
import pytest

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.certify import certify
from eigenshape.spectral.solve import solve_spectrum


def sphere_eigenvalues(k):
    degrees = np.arange(k)
    return np.repeat(degrees * (degrees + 1), 2 * degrees + 1)[:k].astype(float)


@pytest.fixture(scope="module")
def kernels():
    mesh = icosphere(3)
    return mesh_laplacian(mesh), mesh_laplacian(mesh, correct="log")


def test_a_corrected_spectrum_is_the_logarithm_of_the_pencils(kernels):
    plain, corrected = (solve_spectrum(laplacian, 25) for laplacian in kernels)
    t = kernels[0].kernel.t
    np.testing.assert_allclose(
        corrected.eigenvalues, -np.log1p(-t * plain.eigenvalues) / t, rtol=1e-12, atol=1e-12
    )
    np.testing.assert_array_equal(corrected.eigenvectors, plain.eigenvectors)
    assert (
        np.median(np.abs(corrected.eigenvalues / np.maximum(sphere_eigenvalues(25), 1) - 1)[1:])
        < 0.02
    )
    assert (
        np.median(np.abs(plain.eigenvalues / np.maximum(sphere_eigenvalues(25), 1) - 1)[1:]) > 0.1
    )
    assert (corrected.residuals >= plain.residuals).all()


@pytest.mark.parametrize("k", [20, 25, 80])
def test_the_certificate_speaks_of_reported_values(kernels, k):
    found = solve_spectrum(kernels[1], k)
    proof = found.certificate
    assert proof.complete
    low, high = proof.gap
    assert low <= proof.shift <= high
    assert np.isfinite([low, proof.shift, high]).all()
    assert np.count_nonzero(found.eigenvalues < proof.shift) == proof.n_found
    assert found.eigenvalues[-1] - proof.resolution <= proof.shift
    assert certify(kernels[1], found.eigenvalues, found.eigenvectors).n_pairs == k


def test_a_doctored_corrected_spectrum_is_refused(kernels):
    found = solve_spectrum(kernels[1], 20)
    keep = np.delete(np.arange(20), 7)
    with pytest.raises(ConvergenceError):
        certify(kernels[1], found.eigenvalues[keep], found.eigenvectors[:, keep])


def test_eigenvalues_at_the_end_of_the_kernel_are_refused_or_warned_of(kernels):
    with pytest.warns(
        UserWarning,
        match=r"too close to 1/t = \S+ to represent .* k eigenvalues of a surface need n > 5 k t",
    ):
        solve_spectrum(kernels[1], 150)
    with pytest.warns(
        UserWarning,
        match=r"n > 21 k t/e² points.* 72 k t/e² for errors below 10 %, as the first \d+ have",
    ):
        solve_spectrum(kernels[0], 150)


@pytest.mark.filterwarnings("ignore:With the heat time:UserWarning")
def test_eigenvalues_beyond_the_end_of_the_kernel_are_refused():
    coarse = mesh_laplacian(torus(24, 12), correct="log")
    with pytest.raises(
        InvalidParameterError, match=r"to be corrected must lie below 1/t; eigenvalue \d+ of"
    ):
        solve_spectrum(coarse, 288)
