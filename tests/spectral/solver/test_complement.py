from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl

from certeig.kit.errors import ConvergenceError
from certeig.solver import strategy
from certeig.solver.complement import prove_outside, sparser_below
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import Factor
from certeig.solver.pencil import rayleigh_residuals
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum

PENCIL = normalize(mesh_laplacian(torus(40, 18)))
MASS = np.diag(PENCIL.mass_diagonal)
VALUES, VECTORS = sl.eigh(PENCIL.stiffness.toarray(), MASS)
K = 21


def pairs_of(columns):
    vectors = np.ascontiguousarray(VECTORS[:, columns])
    values, residuals = rayleigh_residuals(PENCIL, vectors)
    return Pairs(values, vectors, residuals)


def factor_above(k):
    return Factor.at(sparser_below(PENCIL), 1.001 * float(VALUES[k - 1]))


def test_the_sparser_operator_is_below():
    sparser = sparser_below(PENCIL)
    assert sparser.stiffness.nnz < 0.6 * PENCIL.stiffness.nnz
    rest = (PENCIL.stiffness - sparser.stiffness).toarray()
    np.testing.assert_array_equal(rest, rest.T)
    assert np.linalg.eigvalsh(rest)[0] > -1e-14
    assert np.linalg.eigvalsh(sparser.stiffness.toarray())[0] > -1e-11


def test_all_pairs_are_proved_complete():
    found, certificate = prove_outside(PENCIL, pairs_of(range(60)), K, factor_above(K))
    assert certificate.complete
    assert certificate.n_deflated == 60
    assert VALUES[len(found.values) - 1] < certificate.shift < VALUES[len(found.values)]
    assert certificate.count == np.searchsorted(VALUES, certificate.shift)
    assert "Outside the space of 60 eigenvectors" in certificate.explain()


@pytest.mark.parametrize("lost", [0, 7, 20])
def test_a_pair_that_was_left_out_is_missed(lost):
    columns = [number for number in range(60) if number != lost]
    _, certificate = prove_outside(PENCIL, pairs_of(columns), K - 1, factor_above(K))
    assert certificate.n_missing == 1


def test_pairs_that_the_sparser_operator_needs_are_missed_until_they_are_given():
    below, few = factor_above(K + 10), K + 5
    _, certificate = prove_outside(PENCIL, pairs_of(range(few)), K, below)
    assert certificate.n_missing >= below.count - few > 0


def test_pairs_above_need_not_be_precise():
    pairs = pairs_of(range(60))
    rng = np.random.default_rng(2)
    blurred = pairs.vectors.copy()
    blurred[:, 40:] += 1e-4 * VECTORS[:, 60:] @ rng.standard_normal((PENCIL.n - 60, 20))
    values, residuals = rayleigh_residuals(PENCIL, blurred)
    below = factor_above(K)
    _, certificate = prove_outside(PENCIL, Pairs(values, blurred, residuals), K, below)
    assert certificate.complete


def test_imprecise_pairs_beside_the_gap_prove_nothing():
    pairs = pairs_of(range(60))
    ends = np.flatnonzero(np.diff(pairs.values[K - 1 :]) > 1e-5 * pairs.values[K])
    beside = K + int(ends[0])
    # Half of this vector is far up in the spectrum, though its given value is not.
    pairs.vectors[:, beside] = (VECTORS[:, beside] + VECTORS[:, -1]) / np.sqrt(2)
    with pytest.raises(
        ConvergenceError, match=r"needs pairs above a gap and precise ones; of 60 pairs"
    ):
        prove_outside(PENCIL, pairs, K, factor_above(K))


def test_a_factor_below_the_pairs_proves_nothing():
    with pytest.raises(ConvergenceError, match=r"needs pairs above a gap and precise ones"):
        prove_outside(PENCIL, pairs_of(range(60)), K, factor_above(K - 10))


@pytest.mark.parametrize("k", [1, 2, 5, 20, 30])
def test_filters_and_factors_find_the_same_spectrum(monkeypatch, k):
    laplacian = mesh_laplacian(icosphere(4))
    filtered = solve_spectrum(laplacian, k)
    monkeypatch.setattr(strategy, "FILTER_ENTRIES", np.inf)
    factored = solve_spectrum(laplacian, k)
    assert filtered.certificate.n_deflated > k
    assert factored.certificate.n_deflated == 0
    scale = max(float(factored.eigenvalues[-1]), 1.0)
    np.testing.assert_allclose(filtered.eigenvalues, factored.eigenvalues, atol=1e-11 * scale)
    assert filtered.certificate.n_split == factored.certificate.n_split
    assert filtered.certificate.clusters == factored.certificate.clusters


@pytest.mark.long
def test_what_filters_cannot_prove_factors_do(monkeypatch):
    laplacian = mesh_laplacian(icosphere(4))

    def lossy(pencil, pairs, k, below):
        found, certificate = prove_outside(pencil, pairs, k, below)
        return found, replace(certificate, count=certificate.count + 1)

    monkeypatch.setattr(strategy, "prove_outside", lossy)
    pencil = normalize(laplacian)
    with pytest.raises(strategy.ConvergenceError, match="up to 1 of 12 are missing"):
        strategy._solve_filtered(pencil, 12, lambda done, message: None)
    certificate = solve_spectrum(laplacian, 12).certificate
    assert certificate.complete
    assert certificate.n_deflated == 0
    assert certificate.fallbacks[0].startswith("a filter: Every eigenvalue that is counted must")
