import numpy as np
from known_spectra import kronecker_sum, ring, scaled

from certeig.solver.eigenpairs import Pairs, lowest_pairs, polish
from certeig.solver.factor import Factor
from certeig.solver.lanczos import Wanted, block_lanczos
from certeig.solver.pencil import rayleigh_residuals

PENCIL = scaled(kronecker_sum(ring(25), ring(26)))
FACTOR = Factor.at(PENCIL, 0.02 * PENCIL.level)


def found_pairs():
    none = np.empty((PENCIL.n, 0))
    wanted = Wanted(below=FACTOR.count, above=4)
    _, vectors = block_lanczos(PENCIL, FACTOR, wanted, locked=none, report=lambda done: None)
    return lowest_pairs(PENCIL, vectors, vectors.shape[1])


def test_skew_columns_are_made_orthonormal():
    pairs = found_pairs()
    k = len(pairs.values)
    mixing = np.eye(k)
    # Two copies of an eigenvalue, so that they stay eigenvectors.
    assert pairs.values[2] - pairs.values[1] < 1e-6 * pairs.values[2]
    mixing[1, 2] = 1e-2
    straight = lowest_pairs(PENCIL, pairs.vectors @ mixing, k)
    np.testing.assert_allclose(
        straight.vectors.T @ PENCIL.weigh(straight.vectors), np.eye(k), atol=1e-12
    )
    np.testing.assert_allclose(straight.values, pairs.values, atol=1e-9 * pairs.values[-1])


def test_neighbors_that_are_mixed_are_separated():
    pairs = found_pairs()
    last = int(np.argmax(np.diff(pairs.values)))  # a clear gap after it
    turn = np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    vectors = pairs.vectors.copy()
    vectors[:, last : last + 2] = vectors[:, last : last + 2] @ turn
    values, residuals = rayleigh_residuals(PENCIL, vectors)
    mixed = Pairs(values, vectors, residuals)
    assert mixed.residuals.max() > 1e-3 * pairs.values[-1]
    apart = polish(PENCIL, FACTOR, mixed)
    np.testing.assert_allclose(apart.values, pairs.values, atol=1e-12 * pairs.values[-1])
    assert apart.residuals.max() < 1e-10 * pairs.values[-1]


def test_numbers_near_the_quotients_leave_values_and_residuals_as_they_are():
    pairs = found_pairs()
    blurred = pairs.vectors + 1e-6 * np.random.default_rng(0).standard_normal(pairs.vectors.shape)
    values, residuals = rayleigh_residuals(PENCIL, blurred)
    near = values + 1e-7 * values[-1] * np.linspace(-1, 1, len(values))
    again, bounds = rayleigh_residuals(PENCIL, blurred, near)
    np.testing.assert_array_equal(again, values)
    np.testing.assert_allclose(bounds, residuals, rtol=1e-6)


def test_lengths_of_vectors_change_neither_quotients_nor_residuals():
    vectors = np.random.default_rng(0).standard_normal((PENCIL.n, 5))
    values, residuals = rayleigh_residuals(PENCIL, vectors)
    long, bounds = rayleigh_residuals(PENCIL, vectors * 10.0 ** np.arange(-2, 3))
    np.testing.assert_allclose(long, values, rtol=1e-12)
    np.testing.assert_allclose(bounds, residuals, rtol=1e-12)
