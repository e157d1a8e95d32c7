import numpy as np
import pytest
from pencils import graph, path, tetrahedra, wild

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver import certify as certify_module
from certeig.solver import inertia as count
from certeig.solver.certify import prove
from certeig.solver.eigenpairs import Pairs
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.certify import certify
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum

pytestmark = pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")  # of pieces


@pytest.fixture(scope="module")
def bumpy():
    """An operator without symmetry, and its 30 lowest pairs."""
    mesh = torus(20, 14)
    rng = np.random.default_rng(3)
    moved = type(mesh)(mesh.vertices + 0.02 * rng.standard_normal(mesh.vertices.shape), mesh.faces)
    laplacian = cotangent_laplacian(moved, "averaged")
    return laplacian, solve_spectrum(laplacian, 30)


def test_path_of_three_by_hand():
    laplacian = graph(path(3))  # eigenvalues 0, 1, 3
    vectors = np.array([[1, 1, 1], [1, 0, -1]]).T / np.sqrt([3, 2])
    certificate = certify(laplacian, np.array([0.0, 1.0]), vectors)
    assert (certificate.count, certificate.n_found, certificate.n_pairs, certificate.n_split) == (
        2,
        2,
        2,
        0,
    )
    assert 1 < certificate.shift < 3
    assert certificate.gap[0] <= certificate.shift <= certificate.gap[1] < 3
    assert "3" not in certificate.explain().split(".")[0]


def test_the_solver_and_the_doctor_agree(bumpy):
    laplacian, spectrum = bumpy
    certificate = certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)
    assert certificate.complete
    assert certificate.count == spectrum.certificate.count == 30
    np.testing.assert_allclose(certificate.shift, spectrum.certificate.shift, rtol=1e-12)


@pytest.mark.parametrize("dropped", range(0, 29, 4))
def test_a_dropped_pair_is_noticed(bumpy, dropped):
    laplacian, spectrum = bumpy
    kept = np.delete(np.arange(30), dropped)
    with pytest.raises(
        ConvergenceError, match=r"not proved: \d+ lie below .* \d+ were found there"
    ):
        certify(laplacian, spectrum.eigenvalues[kept], spectrum.eigenvectors[:, kept])


def test_a_duplicated_pair_is_noticed(bumpy):
    laplacian, spectrum = bumpy
    twice = np.sort(np.append(np.arange(30), 7))
    with pytest.raises(
        ConvergenceError, match=r"B-orthonormal to 1e-08; columns 7 and 8 are off by 1.00e"
    ):
        certify(laplacian, spectrum.eigenvalues[twice], spectrum.eigenvectors[:, twice])


def test_a_wrong_eigenvalue_is_noticed(bumpy):
    laplacian, spectrum = bumpy
    values = spectrum.eigenvalues.copy()
    values[5] += 0.3 * (values[6] - values[5])
    with pytest.raises(ConvergenceError, match=r"Every pair must satisfy .* pair 5 is off by"):
        certify(laplacian, values, spectrum.eigenvectors)


def test_a_lost_copy_below_the_last_cluster_is_noticed():
    laplacian = cotangent_laplacian(icosphere(2))  # multiplicities 1, 3, 5, 7 or 3 + 4, ...
    spectrum = solve_spectrum(laplacian, 8)
    kept = [0, 1, 2, 4, 5, 6, 7]
    with pytest.raises(ConvergenceError, match=r"not proved: 4 lie below .* 3 were found there"):
        certify(laplacian, spectrum.eigenvalues[kept], spectrum.eigenvectors[:, kept])


def test_any_copies_of_the_last_cluster_do_and_the_rest_is_reported():
    laplacian = cotangent_laplacian(tetrahedra(30))
    spectrum = solve_spectrum(laplacian, 30)
    kept = [0, 3, 11, 29]
    certificate = certify(laplacian, spectrum.eigenvalues[kept], spectrum.eigenvectors[:, kept])
    assert (certificate.n_split, certificate.n_found, certificate.count) == (26, 0, 0)
    assert "k = 30 keeps it whole" in certificate.explain()


def test_rounding_is_allowed_for():
    laplacian = wild()  # here rounding takes much of a low eigenvalue where the mass is small
    spectrum = solve_spectrum(laplacian, 20)
    certificate = certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)
    assert certificate.complete


def test_no_usable_factor_is_an_error(bumpy, monkeypatch):
    laplacian, spectrum = bumpy
    monkeypatch.setattr(count.Factor, "at", lambda *args: None)
    with pytest.raises(ConvergenceError, match=r"rounding must be smaller than their distance"):
        certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)


def test_a_spectrum_that_is_all_one_chain_is_an_error(bumpy, monkeypatch):
    laplacian, spectrum = bumpy
    monkeypatch.setattr(certify_module, "RESOLUTION", 0.2)
    with pytest.raises(
        ConvergenceError,
        match=r"differ by more than the rounding of the factor; the last 30 of 30 do not",
    ):
        certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)


def test_arrays_that_do_not_fit_are_refused(bumpy):
    laplacian, spectrum = bumpy
    values, vectors = spectrum.eigenvalues, spectrum.eigenvectors
    with pytest.raises(
        InvalidParameterError,
        match=r"shapes \(k,\) and \(280, k\); the shapes are \(30,\) and \(279,",
    ):
        certify(laplacian, values, vectors[1:])
    with pytest.raises(InvalidParameterError, match=r"must be finite"):
        certify(laplacian, values, np.where(vectors == vectors[3, 3], np.nan, vectors))
    with pytest.raises(InvalidParameterError, match=r"must ascend; 1 is"):
        certify(laplacian, values[::-1].copy(), vectors)


def test_a_value_that_follows_lets_the_count_stand_in_the_gap_before_it(bumpy):
    laplacian, spectrum = bumpy
    pencil = normalize(laplacian)
    values = np.ldexp(spectrum.eigenvalues, -pencil.value_exponent)
    vectors = np.ldexp(spectrum.eigenvectors, -pencil.vector_exponent)
    pairs = Pairs(values, vectors, pencil.residual_norms(values, vectors)).select(slice(10))
    near = prove(pencil, pairs)
    halfway = prove(pencil, pairs, following=values[10:])
    assert halfway.complete
    assert halfway.shift == pytest.approx((values[9] + values[10]) / 2, rel=1e-9)
    assert (halfway.n_split, halfway.clusters) == (near.n_split, near.clusters)
    # If others lie between, the count is made again just above the last.
    again = prove(pencil, pairs, following=values[20:])
    assert again.count == 10
    assert again.shift == pytest.approx(near.shift, rel=1e-9)
