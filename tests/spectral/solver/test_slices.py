import numpy as np
import pytest
from pencils import cycle, dense_eigenvalues, graph, hypercube, tetrahedra

from certeig.kit.errors import ConvergenceError
from certeig.solver import slices
from certeig.solver import strategy as roads
from certeig.solver.pencil import rayleigh_residuals
from certeig.solver.slices import walk
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.domains import irregular_grid
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum


@pytest.fixture
def thin(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    monkeypatch.setattr(roads, "ONE_SHIFT_PAIRS", 20)
    monkeypatch.setattr(roads, "DENSE_POINTS", 0)


def irregular(n):
    return irregular_grid(n, n, rng=np.random.default_rng(0))


@pytest.mark.long
@pytest.mark.parametrize(
    "laplacian",
    [
        cotangent_laplacian(irregular(24)),
        cotangent_laplacian(irregular(24), "consistent"),
        cotangent_laplacian(icosphere(3)),
        cotangent_laplacian(torus(20, 30)),
        cotangent_laplacian(tetrahedra(100)),
        graph(cycle(700)),
        graph(hypercube(9)),
    ],
)
def test_slices_miss_nothing(thin, laplacian):
    reference = dense_eigenvalues(laplacian)[:60]
    found = solve_spectrum(laplacian, 60)
    np.testing.assert_allclose(found.eigenvalues, reference, atol=1e-9 * reference[-1] + 1e-13)
    assert found.certificate.complete
    assert found.certificate.orthonormality < 1e-10


def test_a_walk_takes_several_slices_and_finds_all_of_a_simple_spectrum(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    pencil, told = normalize(cotangent_laplacian(irregular(24))), []
    vectors, factor = walk(pencil, 60, told.append)
    reference = np.ldexp(
        dense_eigenvalues(cotangent_laplacian(irregular(24)))[:60], -pencil.value_exponent
    )
    assert factor.count > 40  # the last shift stands in the last slice
    assert told == sorted(told)
    np.testing.assert_allclose(
        np.sort(rayleigh_residuals(pencil, vectors)[0]), reference, atol=1e-9 * reference[-1]
    )


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
    laplacian = cotangent_laplacian(irregular(24))
    found = solve_spectrum(laplacian, 60)
    np.testing.assert_allclose(found.eigenvalues, dense_eigenvalues(laplacian)[:60], atol=1e-9)
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
        solve_spectrum(laplacian, 60)


def test_a_shift_that_does_not_move_on_is_an_error(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", 14)
    first = slices.shift_inside(normalize(cotangent_laplacian(irregular(24))), 5)
    monkeypatch.setattr(slices, "factorize_near", lambda pencil, shift: first)
    with pytest.raises(
        ConvergenceError,
        match=r"The shift of a slice must lie beyond the one before; -\d+ eigenvalues",
    ):
        walk(normalize(cotangent_laplacian(irregular(24))), 60, lambda done: None)
