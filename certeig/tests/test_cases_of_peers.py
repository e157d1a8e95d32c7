"""The kinds of pencils on which SciPy tests `eigsh` and `lobpcg`, made from their properties; LAPACK is right."""

import known_spectra as known
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

import certeig

RNG = np.random.default_rng(1299843)


def random_dense(n, *, definite, density=0.5):
    """Return a symmetric matrix with few entries; if definite, a product with its transpose, moved up a little."""
    entries = np.where(RNG.random((n, n)) < density, RNG.uniform(-1, 1, (n, n)), 0.0)
    return entries @ entries.T + 0.1 * np.eye(n) if definite else entries + entries.T


def mikota(n):
    """Return springs and masses after Mikota, whose frequencies are 1, 2, ..., n: λ_j = j²."""
    springs = np.arange(n, 0, -1.0)
    stiffness = sp.diags_array(
        [springs + np.append(springs[1:], 0), -springs[1:], -springs[1:]], offsets=[0, 1, -1]
    )
    return sp.csr_array(stiffness), sp.csr_array(sp.diags_array(1 / np.arange(1.0, n + 1)))


def elastic_rod(n):
    """Return a rod of n linear elements that is fixed at one end, with a mass beside the diagonal."""
    ends = np.where(np.arange(n) == n - 1, 0.5, 1.0)
    side = np.ones(n - 1)
    stiffness = sp.diags_array([2 * ends, -side, -side], offsets=[0, 1, -1]) * n
    mass = sp.diags_array([4 * ends, side, side], offsets=[0, 1, -1]) / (6 * n)
    return sp.csr_array(stiffness), sp.csr_array(mass)


def barbell(n):
    """Return the Laplacian of two complete graphs that one edge joins, whose Fiedler value is small."""
    blocks = np.kron(np.eye(2), np.ones((n, n)) - np.eye(2 * n)[:n, :n])
    blocks[n - 1, n] = blocks[n, n - 1] = 1.0
    return known.laplacian(sp.csr_array(blocks))


PENCILS = {
    "definite": (random_dense(100, definite=True), None),
    "indefinite": (random_dense(100, definite=False), None),
    "definite, with a mass": (
        random_dense(100, definite=True),
        random_dense(100, definite=True),
    ),
    "indefinite, with a mass": (
        random_dense(100, definite=False),
        random_dense(100, definite=True),
    ),
    "large and few entries": (random_dense(420, definite=False, density=0.01), None),
    "singular": (np.diag([0.0] * 5 + list(range(1, 46))), None),
    "integers": (np.diag(range(1, 101)), None),
    "one": (np.eye(10), None),
    "a block of ones": (np.kron(np.diag([1.0, 2.0, 3.0]), np.ones((5, 5))), None),
    "springs and masses": mikota(60),
    "elastic rod": elastic_rod(100),
    "elastic rod, large": elastic_rod(500),
    "path": (known.laplacian(known.adjacency(60)), None),
    "barbell": (barbell(20), None),
    "nearly multiple": (np.diag([1, 1 + 1e-10, 1 + 2e-10, *range(2, 60)]), None),
    "rounded to single": (np.float32(random_dense(40, definite=True)).astype(float), None),
}


@pytest.mark.parametrize("name", PENCILS)
@pytest.mark.parametrize("k", [1, 2, 9])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_lowest_and_the_highest_are_those_of_lapack(name, k, sign):
    stiffness, mass = (
        None if each is None else each.toarray() if sp.issparse(each) else each
        for each in PENCILS[name]
    )
    stiffness = sign * (stiffness + stiffness.T) / 2
    exact = eigh(stiffness, mass, eigvals_only=True)
    sparse_mass = None if mass is None else sp.csr_array((mass + mass.T) / 2)
    spectrum = certeig.eigenpairs(sp.csr_array(stiffness), sparse_mass, k=k)
    size = np.abs(exact).max()
    np.testing.assert_allclose(spectrum.eigenvalues, exact[:k], rtol=1e-9, atol=1e-10 * size)
    assert spectrum.certificate.complete


def test_springs_and_masses_ring_in_whole_numbers():
    spectrum = certeig.eigenpairs(*mikota(200), k=200)
    np.testing.assert_allclose(spectrum.eigenvalues, np.arange(1.0, 201) ** 2, rtol=1e-9)


@pytest.mark.parametrize("sigma", [0.5, 3.7])
def test_the_nearest_to_a_value_are_those_of_an_interval(sigma):
    """What shift-invert modes ask for: here the width of the interval is chosen, and the count is proved."""
    stiffness = known.kronecker_sum(known.string(25), known.string(26))
    exact = known.sums(known.string_values(25), known.string_values(26))
    width = np.sort(np.abs(exact - sigma))[:9][-2:].mean()
    spectrum = certeig.eigenpairs(stiffness, above=sigma - width, below=sigma + width)
    inside = exact[np.abs(exact - sigma) < width]
    assert len(inside) == 8
    np.testing.assert_allclose(spectrum.eigenvalues, inside, atol=1e-11)
