import numpy as np
import pytest

from certeig.kit.errors import ConvergenceError
from certeig.solver import chebyshev
from certeig.solver.chebyshev import chebyshev_filter
from certeig.solver.eigenpairs import lowest_pairs
from certeig.solver.lanczos import Wanted, grow_space
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.shapes.surfaces import torus
from eigenshape.spectral.pencils import normalize

PENCIL = normalize(mesh_laplacian(torus(48, 20)))
ROOTS = np.sqrt(PENCIL.mass_diagonal)
SYMMETRIC = PENCIL.stiffness.toarray() / np.outer(ROOTS, ROOTS)
VALUES, VECTORS = np.linalg.eigh(SYMMETRIC)
ORDER = np.random.default_rng(3).permutation(PENCIL.n)


@pytest.mark.parametrize("degree", [2, 3, 6, 7])
def test_the_image_is_the_chebyshev_polynomial(monkeypatch, degree):
    monkeypatch.setattr(chebyshev, "LOWEST_DEGREE", degree)
    monkeypatch.setattr(chebyshev, "HIGHEST_DEGREE", degree)
    inner = chebyshev_filter(PENCIL, ORDER, float(VALUES[30]))
    low, high = inner.damped
    assert inner.degree == degree
    columns = np.random.default_rng(0).standard_normal((2, PENCIL.n, 8))
    polynomial = np.polynomial.Chebyshev.basis(degree)((low + high - 2 * VALUES) / (high - low))
    vectors = VECTORS[ORDER]  # in the order of the rows
    expected = vectors @ (polynomial[:, None] * (vectors.T @ columns))
    np.testing.assert_allclose(inner.image(columns), expected, atol=1e-11 * polynomial.max())


def test_thetas_tell_the_eigenvalues_below_the_damped_ones():
    inner = chebyshev_filter(PENCIL, ORDER, float(VALUES[30]))
    low, high = inner.damped

    def thetas(values):
        places = (low + high - 2 * values) / (high - low)
        return np.cosh(inner.degree * np.arccosh(places))

    below = VALUES[1:30]
    values, slopes = inner.values(thetas(below))
    np.testing.assert_allclose(values, below, rtol=1e-9)
    step = 1e-6 * low
    differences = (thetas(below - step) - thetas(below + step)) / (2 * step)
    np.testing.assert_allclose(slopes, 1 / differences, rtol=1e-4)
    damped, _ = inner.values(np.array([1.0, 0.3, -0.7]))
    assert np.isinf(damped).all()


def test_all_eigenvalues_from_low_on_are_damped():
    inner = chebyshev_filter(PENCIL, ORDER, float(VALUES[30]))
    assert 0.98 * VALUES[-1] <= inner.damped[1] <= 1.1 * VALUES[-1]


def test_vectors_enter_and_leave_in_the_order_of_the_points():
    inner = chebyshev_filter(PENCIL, ORDER, float(VALUES[30]))
    given = np.random.default_rng(1).standard_normal((PENCIL.n, 3))
    np.testing.assert_allclose(inner.leave(inner.enter(given)), given, rtol=1e-14)


def test_a_space_of_filtered_vectors_holds_the_lowest_eigenvectors():
    inner = chebyshev_filter(PENCIL, ORDER, float(VALUES[30]))
    none = np.empty((PENCIL.n, 0))
    space = grow_space(inner, Wanted(below=0, above=10), locked=none, report=lambda done: None)
    pairs = lowest_pairs(PENCIL, space.vectors(space.lowest(10)), 10)
    np.testing.assert_allclose(pairs.values, VALUES[:10], atol=1e-12 * VALUES[10])
    assert pairs.residuals.max() < 1e-10 * VALUES[10]


def test_a_filter_that_damps_little_is_refused():
    with pytest.raises(
        ConvergenceError, match=r"must damp most of the spectrum; it is to begin at 0\.\d+ of it"
    ):
        chebyshev_filter(PENCIL, ORDER, 0.8 * float(VALUES[-1]))
