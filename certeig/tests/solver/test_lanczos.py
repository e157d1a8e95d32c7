import numpy as np
import pytest
from known_spectra import dense_values, full_parts, kronecker_sum, random_grid, ring, scaled, string

from certeig.kit.errors import ConvergenceError
from certeig.solver import lanczos
from certeig.solver.eigenpairs import lowest_pairs
from certeig.solver.factor import Factor
from certeig.solver.lanczos import MOST_LOST, Wanted, block_lanczos
from certeig.solver.pencil import rayleigh_residuals


def run(pencil, factor, wanted, locked=None):
    locked = np.empty((pencil.n, 0)) if locked is None else locked
    return block_lanczos(pencil, factor, wanted, locked=locked, report=lambda done: None)[1]


def test_finds_both_sides_of_the_shift_orthonormal():
    matrices = random_grid(25, full=True)
    pencil = scaled(*matrices)
    reference = pencil.places_in(dense_values(*matrices))
    factor = Factor.at(pencil, float(reference[15] + reference[16]) / 2)
    assert factor.count == 16
    vectors = run(pencil, factor, Wanted(below=16, above=9))
    np.testing.assert_allclose(vectors.T @ pencil.weigh(vectors), np.eye(25), atol=1e-8)
    pairs = lowest_pairs(pencil, vectors, 25)
    np.testing.assert_allclose(pairs.values, reference[:25], atol=1e-11 * reference[24])
    assert pairs.residuals.max() < 1e-9 * reference[24]
    products = pairs.vectors.T @ pencil.weigh(pairs.vectors)
    np.testing.assert_allclose(products, np.eye(25), atol=1e-12)


def test_skipped_projections_cost_no_digit(monkeypatch):
    pencil = scaled(*random_grid(57))
    factor = Factor.at(pencil, 0.05 * pencil.level)
    residuals = {}
    for most in (MOST_LOST, 0.0):
        monkeypatch.setattr(lanczos, "MOST_LOST", most)
        vectors = run(pencil, factor, Wanted(below=factor.count, above=20))
        residuals[most] = lowest_pairs(pencil, vectors, vectors.shape[1]).residuals.max()
    assert residuals[MOST_LOST] < 3 * residuals[0.0]


def test_a_second_run_is_orthogonal_to_the_first_to_rounding():
    pencil = scaled(kronecker_sum(ring(25), ring(26)))
    factor = Factor.at(pencil, 0.05 * pencil.level)
    found = run(pencil, factor, Wanted(below=factor.count, above=12))
    first = lowest_pairs(pencil, found, found.shape[1]).vectors
    second = run(pencil, factor, Wanted(below=0, above=20), locked=first)
    np.testing.assert_allclose(first.T @ pencil.weigh(second), 0, atol=1e-14)


def test_a_second_run_finds_the_copies_that_the_block_was_too_narrow_for():
    pencil = scaled(full_parts(100))  # the eigenvalue 0 a hundred times
    factor = Factor.at(pencil, 0.01 * pencil.level)
    assert factor.count == 100
    first = run(pencil, factor, Wanted(below=5, above=0))
    second = run(pencil, factor, Wanted(below=5, above=0), locked=first)
    both = np.hstack([first, second])
    assert both.shape[1] == 10
    np.testing.assert_allclose(both.T @ pencil.weigh(both), np.eye(10), atol=1e-12)
    np.testing.assert_allclose(rayleigh_residuals(pencil, both)[0], 0, atol=1e-13)


def test_nothing_above_the_ceiling_is_returned():
    pencil = scaled(string(300))
    factor = Factor.at(pencil, 0.002)
    below = factor.count
    everything = run(pencil, factor, Wanted(below=below, above=5))
    values = np.sort(rayleigh_residuals(pencil, everything)[0])
    ceiling = float(values[below + 1] + values[below + 2]) / 2
    assert run(pencil, factor, Wanted(below=below, above=5, ceiling=ceiling)).shape[1] == below + 2


def test_too_little_room_is_an_error():
    pencil = scaled(string(40))
    factor = Factor.at(pencil, 0.1)
    with pytest.raises(ConvergenceError, match=r"Block Lanczos must converge within 32 vectors"):
        run(pencil, factor, Wanted(below=factor.count, above=40))
