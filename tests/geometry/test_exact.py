import numpy as np
import pytest
from scipy.special import jn_zeros

from eigenshape.geometry import exact


def test_small_lists_by_hand():
    assert exact.sphere_eigenvalues(10).tolist() == [0, 2, 2, 2, 6, 6, 6, 6, 6, 12]
    assert exact.sphere_eigenvalues(6, 1).tolist() == [0, 1, 1, 4, 4, 9]
    assert exact.sphere_eigenvalues(15, 3).tolist() == [0, *[3] * 4, *[8] * 9, 15]
    np.testing.assert_allclose(exact.box_eigenvalues(6) / np.pi**2, [0, 1, 1, 2, 4, 4])
    np.testing.assert_allclose(exact.box_eigenvalues(4, (1, 1, 1), "dirichlet") / np.pi**2, [3, 6, 6, 6])
    np.testing.assert_allclose(exact.box_eigenvalues(3, [2.0]), [0, np.pi**2 / 4, np.pi**2])
    np.testing.assert_allclose(exact.flat_torus_eigenvalues(6, [[1, 0], [0, 1]]) / (4 * np.pi**2), [0, 1, 1, 1, 1, 2])
    np.testing.assert_allclose(
        exact.flat_torus_eigenvalues(7, [[1, 0], [-0.5, 0.75**0.5]])[1:], [16 / 3 * np.pi**2] * 6
    )


def test_zeros_from_tables():
    # Abramowitz and Stegun, tables 9.5 and 10.6.
    np.testing.assert_allclose(np.sqrt(exact.disc_eigenvalues(5)), [0, 1.84118, 1.84118, 3.05424, 3.05424], atol=5e-6)
    np.testing.assert_allclose(np.sqrt(exact.disc_eigenvalues(3, "dirichlet")), [2.40483, 3.83171, 3.83171], atol=5e-6)
    np.testing.assert_allclose(np.sqrt(exact.ball_eigenvalues(4, "dirichlet")), [np.pi, *[4.493409] * 3], atol=5e-7)
    np.testing.assert_allclose(np.sqrt(exact.ball_eigenvalues(5)), [0, *[2.08158] * 3, 3.34209], atol=5e-6)


@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
def test_weyl_counts_them(condition):
    k = 400
    sign = -1 if condition == "dirichlet" else 1
    disc = exact.disc_eigenvalues(k, condition)[-1]
    assert disc / 4 + sign * np.sqrt(disc) / 2 == pytest.approx(k, rel=0.03)
    ball = exact.ball_eigenvalues(k, condition)[-1]
    assert 2 / (9 * np.pi) * ball**1.5 + sign * ball / 4 == pytest.approx(k, rel=0.06)


def test_none_is_left_out():
    orders = [np.repeat(jn_zeros(p, 40) ** 2, 2 if p else 1) for p in range(80)]
    np.testing.assert_allclose(
        exact.disc_eigenvalues(300, "dirichlet"), np.sort(np.concatenate(orders))[:300], rtol=1e-9
    )
