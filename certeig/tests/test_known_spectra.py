"""Eigenvalues of matrices for which a formula gives them, and of pencils made with them."""

import known_spectra as known
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

import certeig


def grid(*sides):
    return known.kronecker_sum(*map(known.string, sides)), known.sums(
        *map(known.string_values, sides)
    )


WEIGHTS = {0: 1.0, 1: -0.7, 7: 0.4, 50: 0.3}
# Name: the matrix, its eigenvalues, and some k, in front of a cluster, in it and behind it
KNOWN = {
    "string": (known.string(500), known.string_values(500), (1, 2, 30)),
    "ring": (known.ring(601), known.ring_values(601), (1, 2, 3, 40)),
    "plane grid": (*grid(30, 30), (1, 2, 40)),
    "solid grid": (*grid(9, 9, 9), (4, 20, 130)),
    "torus": (
        known.kronecker_sum(known.ring(24), known.ring(24)),
        known.sums(known.ring_values(24), known.ring_values(24)),
        (1, 3, 5, 25),
    ),
    "hypercube": (known.hypercube(10), known.hypercube_values(10), (1, 11, 30, 56)),
    "circulant": (
        known.circulant(640, WEIGHTS),
        known.circulant_values(640, WEIGHTS),
        (1, 10, 200),
    ),
    "direct sum": (
        sp.csr_array(sp.block_diag([known.string(20)] * 30)),
        np.repeat(known.string_values(20), 30),
        (1, 29, 31, 100),
    ),
    "star": (
        known.arrow(401),
        np.array([-20.0, *np.zeros(399), 20.0]),
        (1, 3, 40),
    ),
    "adjacency of a ring": (
        known.adjacency(600, closed=True),
        known.ring_values(600) - 2,
        (1, 2, 20),
    ),
    "diagonal": (
        sp.csr_array(sp.diags_array(np.arange(700.0)[::-1] - 350)),
        np.arange(700.0) - 350,
        (1, 50),
    ),
    "zero": (sp.csr_array((400, 400)), np.zeros(400), (1, 7)),
    "identity": (sp.csr_array(sp.eye_array(400)), np.ones(400), (1, 9)),
    "a point": (sp.csr_array([[-3.0]]), np.array([-3.0]), (1,)),
    "two points": (sp.csr_array([[0.0, 1.0], [1.0, 0.0]]), np.array([-1.0, 1.0]), (1, 2)),
    "three points": (known.string(3), 2 - np.sqrt([2, 0, 2]) * [1, 0, -1], (1, 2, 3)),
}
CASES = [(name, k) for name, (_, _, counts) in KNOWN.items() for k in counts]


def check(spectrum, exact, stiffness, mass=None):
    """Compare a spectrum with exact eigenvalues, and its vectors with what they are to satisfy."""
    first, k = spectrum.certificate.first, len(spectrum.eigenvalues)
    size = np.abs(exact).max() or 1.0
    np.testing.assert_allclose(
        spectrum.eigenvalues, exact[first : first + k], rtol=1e-9, atol=1e-12 * size
    )
    assert spectrum.certificate.complete
    vectors = spectrum.eigenvectors
    weighed = vectors if mass is None else mass @ vectors
    np.testing.assert_allclose(vectors.T @ weighed, np.eye(k), atol=1e-9)
    rests = stiffness @ vectors - weighed * spectrum.eigenvalues
    assert np.abs(rests).max() < 1e-9 * max(abs(stiffness).max(), size)


@pytest.mark.parametrize(("name", "k"), CASES)
def test_the_lowest_are_those_of_the_formula(name, k):
    matrix, exact, _ = KNOWN[name]
    spectrum = certeig.eigenpairs(matrix, k=k)
    check(spectrum, exact, matrix)
    near = np.abs(exact - exact[k - 1]) < 1e-7 * (np.abs(exact).max() or 1.0)
    assert spectrum.certificate.n_split == np.flatnonzero(near).max() + 1 - k


@pytest.mark.parametrize("name", KNOWN)
def test_of_minus_the_matrix_the_lowest_are_the_highest(name):
    matrix, exact, counts = KNOWN[name]
    check(certeig.eigenpairs(-matrix, k=counts[-1]), -exact[::-1], -matrix)


@pytest.mark.parametrize("name", ["string", "hypercube", "plane grid", "star"])
@pytest.mark.parametrize("far", [100.0, -1e6])
def test_far_from_zero_eigenvalues_are_told_apart_as_near_it(name, far):
    matrix, exact, counts = KNOWN[name]
    moved = sp.csr_array(matrix + far * sp.eye_array(matrix.shape[0]))
    spectrum = certeig.eigenpairs(moved, k=counts[-1])
    check(spectrum, exact + far, moved)
    assert not spectrum.certificate.fallbacks


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e30, 1e200])
@pytest.mark.parametrize("sign", [1, -1])
def test_scales_of_both_matrices_are_those_of_the_eigenvalues(scale, sign):
    matrix, mass = sign * known.string(400), sp.eye_array(400)
    plain = certeig.eigenpairs(matrix, k=9)
    large = certeig.eigenpairs(scale * matrix, k=9)
    np.testing.assert_allclose(large.eigenvalues / scale, plain.eigenvalues, rtol=1e-11)
    heavy = certeig.eigenpairs(matrix, scale * mass, k=9)
    np.testing.assert_allclose(heavy.eigenvalues * scale, plain.eigenvalues, rtol=1e-11)
    np.testing.assert_allclose(
        np.abs(heavy.eigenvectors).max() * np.sqrt(scale),
        np.abs(plain.eigenvectors).max(),
        rtol=1e-6,
    )
    assert certeig.count_below(scale * matrix, value=2.0 * scale * sign) == 200


@pytest.mark.parametrize("n", [1, 2, 5, 60, 310])
@pytest.mark.parametrize("identity", [True, False])
def test_all_pairs_of_a_pencil_made_from_them(n, identity):
    rng = np.random.default_rng(n)
    exact = known.random_values(n, rng)
    stiffness, mass = known.pencil_with(exact, rng, identity=identity)
    spectrum = certeig.eigenpairs(stiffness, mass, k=n)
    np.testing.assert_allclose(spectrum.eigenvalues, exact, atol=1e-9 * np.abs(exact).max())
    check(spectrum, eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True), stiffness, mass)


@pytest.mark.parametrize("condition", [1e4, 1e6, 1e8])
def test_a_mass_far_from_its_diagonal(condition):
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(60, 60)))
    mass = turn * np.geomspace(1, 1 / condition, 60) @ turn.T
    stiffness = rng.normal(size=(60, 60))
    stiffness, mass = stiffness + stiffness.T, (mass + mass.T) / 2
    exact = eigh(stiffness, mass, eigvals_only=True)
    spectrum = certeig.eigenpairs(sp.csr_array(stiffness), sp.csr_array(mass), k=12)
    np.testing.assert_allclose(
        spectrum.eigenvalues, exact[:12], atol=1e-15 * condition * np.abs(exact).max()
    )


def test_fixed_rows_are_left_out():
    matrix, _ = known.random_grid(20)
    fixed = np.array([3, 17, 3, 200])
    free = np.setdiff1d(np.arange(400), fixed)
    spectrum = certeig.eigenpairs(matrix, k=6, fixed=fixed)
    exact = np.linalg.eigvalsh(matrix.toarray()[np.ix_(free, free)])
    np.testing.assert_allclose(spectrum.eigenvalues, exact[:6], atol=1e-12)
    assert spectrum.eigenvectors.shape == (400, 6)
    assert not spectrum.eigenvectors[fixed].any()


def test_filled_matrices_are_solved_by_products():
    """Entries of a Gaussian kernel on a ring, a hundred in a row and more."""
    weights = {step: -float(np.exp(-((step / 40) ** 2))) for step in range(1, 90)}
    weights[0] = -sum(weights.values())
    matrix = known.circulant(4000, weights)
    spectrum = certeig.eigenpairs(matrix, k=7)
    check(spectrum, known.circulant_values(4000, weights), matrix)
    assert spectrum.certificate.n_deflated


def test_the_same_input_gives_the_same_bits_in_any_form():
    matrix = known.random_grid(20)[0]
    one = certeig.eigenpairs(matrix, k=5)
    shuffled = matrix.tocoo()
    order = np.random.default_rng(0).permutation(shuffled.nnz)
    places = shuffled.row[order], shuffled.col[order]
    halves = np.tile(shuffled.data[order] / 2, 2), tuple(np.tile(place, 2) for place in places)
    forms = [
        sp.coo_array(halves, shape=matrix.shape),  # not sorted, each entry in two halves
        sp.csc_matrix(matrix),
        sp.lil_array(matrix),
        sp.dok_array(matrix),
        sp.bsr_array(matrix),
    ]
    for form in forms:
        two = certeig.eigenpairs(form, k=5)
        assert two.eigenvalues.tobytes() == one.eigenvalues.tobytes()
        assert two.eigenvectors.tobytes() == one.eigenvectors.tobytes()


@pytest.mark.parametrize("kind", [np.int8, np.int64, np.float32, np.longdouble])
def test_entries_of_other_types(kind):
    matrix = known.string(300)
    spectrum = certeig.eigenpairs(sp.csr_array(matrix, dtype=kind), k=4)
    np.testing.assert_allclose(spectrum.eigenvalues, known.string_values(300)[:4], rtol=1e-12)
