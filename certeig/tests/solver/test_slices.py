import numpy as np
import pytest
from known_spectra import (
    dense_values,
    full_parts,
    hypercube,
    kronecker_sum,
    random_grid,
    ring,
    scaled,
    surface,
)

import certeig
from certeig import ConvergenceError
from certeig.solver import slices
from certeig.solver import strategy as roads
from certeig.solver.pencil import rayleigh_residuals
from certeig.solver.slices import walk


@pytest.fixture
def thin(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    monkeypatch.setattr(roads, "ONE_SHIFT_PAIRS", 20)
    monkeypatch.setattr(roads, "DENSE_POINTS", 0)


IRREGULAR = random_grid(24)


@pytest.mark.parametrize(
    "matrices",
    [
        IRREGULAR,
        random_grid(24, full=True),
        (surface(600),),
        (kronecker_sum(ring(20), ring(30)),),
        (full_parts(100),),
        (ring(700),),
        (hypercube(9),),
    ],
)
def test_slices_miss_nothing(thin, matrices):
    reference = dense_values(*matrices)[:60]
    found = certeig.eigenpairs(*matrices, k=60)
    np.testing.assert_allclose(found.eigenvalues, reference, atol=1e-9 * reference[-1] + 1e-13)
    assert found.certificate.complete
    assert found.certificate.orthonormality < 1e-10


def test_a_walk_takes_several_slices_and_finds_all_of_a_simple_spectrum(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    pencil, done = scaled(*IRREGULAR), []
    vectors, factor = walk(pencil, 60, done.append)
    reference = pencil.places_in(dense_values(*IRREGULAR)[:60])
    assert factor.count > 40  # the last shift stands in the last slice
    assert done == sorted(done)
    np.testing.assert_allclose(
        np.sort(rayleigh_residuals(pencil, vectors)[0]), reference, atol=1e-9 * reference[-1]
    )


def test_a_slice_whose_overlap_reaches_the_last_pair_is_the_last(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    pencil = scaled(*IRREGULAR)
    for k in range(40, 64, 3):  # the slice before ends anywhere from k - 12 to k
        vectors, _ = walk(pencil, k, lambda done: None)
        values = np.sort(rayleigh_residuals(pencil, vectors)[0])[:k]
        reference = pencil.places_in(dense_values(*IRREGULAR)[:k])
        np.testing.assert_allclose(values, reference, atol=1e-9 * reference[-1])


def test_a_slice_needs_a_gap_to_end_in():
    assert slices._find_cut(np.array([0.5, 4.0, 2.0, 2.1, 2.2]), 1.0) == (3, 3.1)
    for values in (np.full(20, 2.0), np.array([0.5, 2.0]), np.array([0.5])):
        with pytest.raises(ConvergenceError, match="A slice must end in a clear gap"):
            slices._find_cut(values, 1.0)


def test_slices_that_lean_on_each_other_are_not_taken(thin, monkeypatch):
    honest = roads.walk

    def leaning(*arguments):
        vectors, factor = honest(*arguments)
        vectors[:, 1] = vectors[:, 0]
        return vectors, factor

    monkeypatch.setattr(roads, "walk", leaning)
    found = certeig.eigenpairs(*IRREGULAR, k=60)
    np.testing.assert_allclose(found.eigenvalues, dense_values(*IRREGULAR)[:60], atol=1e-9)
    (failed,) = found.certificate.fallbacks
    assert failed.startswith("slices: Vectors of different runs must be B-orthogonal;")
    at_once = roads.block_lanczos

    def leaning_too(*arguments, **options):
        values, vectors = at_once(*arguments, **options)
        vectors[:, 1] = vectors[:, 0]
        return values, vectors

    monkeypatch.setattr(roads, "block_lanczos", leaning_too)
    monkeypatch.setattr(roads, "DENSE_LIMIT", 0)
    with pytest.raises(
        ConvergenceError,
        match=r"Vectors of different runs must be B-orthogonal; two are off by 1\.0",
    ):
        certeig.eigenpairs(*IRREGULAR, k=60)


def test_a_shift_that_does_not_move_on_is_an_error(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    first = slices.shift_inside(scaled(*IRREGULAR), 5)
    monkeypatch.setattr(slices, "factorize_near", lambda pencil, shift: first)
    with pytest.raises(
        ConvergenceError,
        match=r"The shift of a slice must lie beyond the one before; -\d+ eigenvalues",
    ):
        walk(scaled(*IRREGULAR), 60, lambda done: None)
