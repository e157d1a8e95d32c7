import tracemalloc

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import eval_legendre, jn_zeros

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.shapes import exact


def test_small_lists_by_hand():
    assert exact.sphere_eigenvalues(10).tolist() == [0, 2, 2, 2, 6, 6, 6, 6, 6, 12]
    assert exact.sphere_eigenvalues(6, 1).tolist() == [0, 1, 1, 4, 4, 9]
    assert exact.sphere_eigenvalues(15, 3).tolist() == [0, *[3] * 4, *[8] * 9, 15]
    np.testing.assert_allclose(exact.box_eigenvalues(6) / np.pi**2, [0, 1, 1, 2, 4, 4])
    np.testing.assert_allclose(
        exact.box_eigenvalues(4, (1, 1, 1), "dirichlet") / np.pi**2, [3, 6, 6, 6]
    )
    np.testing.assert_allclose(exact.box_eigenvalues(3, [2.0]), [0, np.pi**2 / 4, np.pi**2])
    np.testing.assert_allclose(
        exact.flat_torus_eigenvalues(6, [[1, 0], [0, 1]]) / (4 * np.pi**2), [0, 1, 1, 1, 1, 2]
    )
    np.testing.assert_allclose(
        exact.flat_torus_eigenvalues(7, [[1, 0], [-0.5, 0.75**0.5]])[1:], [16 / 3 * np.pi**2] * 6
    )


def test_zeros_from_tables():
    # Abramowitz and Stegun, tables 9.5 and 10.6.
    np.testing.assert_allclose(
        np.sqrt(exact.disc_eigenvalues(5)), [0, 1.84118, 1.84118, 3.05424, 3.05424], atol=5e-6
    )
    np.testing.assert_allclose(
        np.sqrt(exact.disc_eigenvalues(3, "dirichlet")), [2.40483, 3.83171, 3.83171], atol=5e-6
    )
    np.testing.assert_allclose(
        np.sqrt(exact.ball_eigenvalues(4, "dirichlet")), [np.pi, *[4.493409] * 3], atol=5e-7
    )
    np.testing.assert_allclose(
        np.sqrt(exact.ball_eigenvalues(5)), [0, *[2.08158] * 3, 3.34209], atol=5e-6
    )


@pytest.mark.long
@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
def test_weyl_counts_them(condition):
    k = 400
    sign = -1 if condition == "dirichlet" else 1
    disc = exact.disc_eigenvalues(k, condition)[-1]
    assert disc / 4 + sign * np.sqrt(disc) / 2 == pytest.approx(k, rel=0.03)
    ball = exact.ball_eigenvalues(k, condition)[-1]
    assert 2 / (9 * np.pi) * ball**1.5 + sign * ball / 4 == pytest.approx(k, rel=0.06)


def test_long_lists_need_little_memory():
    k = 5000
    tracemalloc.start()
    try:
        square, plane = exact.box_eigenvalues(k), exact.projective_plane_eigenvalues(k)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 10e6  # a table of k by k takes 200 MB
    # Weyl's two terms, λ A / 4π + √λ L / 4π, on the unit square.
    assert square[-1] / (4 * np.pi) + 4 * np.sqrt(square[-1]) / (4 * np.pi) == pytest.approx(
        k, rel=5e-3
    )
    assert len(plane) == k


def test_on_the_projective_plane_whole_clusters_end_where_the_next_begins():
    n = int((2 * np.arange(0, 400, 2) + 1).sum())
    assert exact.projective_plane_eigenvalues(n)[-1] == 398 * 399
    assert exact.projective_plane_eigenvalues(n + 1)[-1] == 400 * 401


@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
@pytest.mark.parametrize("sides", [(1.0, 1.0), (1.0, 0.1), (1.0, 2.0, 0.3)])
def test_of_a_box_the_lowest_sums_are_taken(sides, condition):
    modes = np.arange(40) + (condition == "dirichlet")
    sums = sum(np.ix_(*[(modes / side) ** 2 for side in sides]))
    np.testing.assert_allclose(
        exact.box_eigenvalues(40, sides, condition),
        np.pi**2 * np.sort(sums, axis=None)[:40],
        rtol=1e-14,
    )


@pytest.mark.parametrize("periods", [[[1.0, 0.0]], [[1.0, np.nan], [0.0, 1.0]], np.eye(3)])
def test_periods_are_two_in_a_plane(periods):
    with pytest.raises(
        InvalidParameterError, match=r"periods must be a finite 2 x 2 matrix; they are \[\[1\.0, "
    ):
        exact.flat_torus_eigenvalues(3, periods)


@pytest.mark.parametrize("periods", [[[1.0, 0.0], [2.0, 0.0]], [[1e-3, 0.0], [0.0, 1e3]]])
def test_periods_that_span_next_to_nothing_are_refused(periods):
    with pytest.raises(
        InvalidParameterError,
        match=r"must span a plane and must not be too slender for k; 3 eigenvalues of \[",
    ):
        exact.flat_torus_eigenvalues(3, periods)


def test_none_is_left_out():
    orders = [np.repeat(jn_zeros(p, 40) ** 2, 2 if p else 1) for p in range(80)]
    np.testing.assert_allclose(
        exact.disc_eigenvalues(300, "dirichlet"), np.sort(np.concatenate(orders))[:300], rtol=1e-9
    )


@pytest.mark.parametrize(("degree", "t"), [(1, 0.02), (5, 0.1), (17, 0.004), (60, 2.0)])
def test_the_functional_of_the_sphere_by_another_quadrature(degree, t):
    weight = lambda s: np.exp(-(2 - 2 * s) / (4 * t)) * (1 - eval_legendre(degree, s))  # noqa: E731
    expected = quad(weight, -1, 1, epsabs=1e-13, epsrel=1e-12, limit=400)[0] / (2 * t**2)
    found = es.shapes.sphere_functional_eigenvalues((degree + 1) ** 2, t)
    assert found[-1] == found[degree**2] == pytest.approx(expected, rel=1e-9)
    assert len(found) == (degree + 1) ** 2


def test_the_functional_of_the_sphere_tends_to_its_operator():
    exact = es.shapes.sphere_eigenvalues(100)
    errors = [
        np.abs(es.shapes.sphere_functional_eigenvalues(100, t) - exact).max() for t in (1e-5, 5e-6)
    ]
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.01)
    with pytest.raises(es.InvalidParameterError, match="t must be positive"):
        es.shapes.sphere_functional_eigenvalues(5, 0.0)
