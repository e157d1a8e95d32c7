import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.shapes.exact import sphere_eigenvalues
from eigenshape.shapes.harmonics import sphere_harmonics
from eigenshape.shapes.spheres import fibonacci_sphere, random_sphere

NORTH, EAST = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])


def gauss_grid(n):
    """Return points of the sphere whose weights integrate polynomials up to degree 2n - 1 exactly."""
    heights, weights = np.polynomial.legendre.leggauss(n)
    turns = np.pi / n * np.arange(2 * n)
    z, phi = (each.ravel() for each in np.meshgrid(heights, turns, indexing="ij"))
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(phi), ring * np.sin(phi), z]), np.repeat(
        weights, 2 * n
    ) * np.pi / n


def test_the_first_four_by_hand():
    x = random_sphere(50, rng=np.random.default_rng(1)).vertices
    linear = (3 / (4 * np.pi)) ** 0.5 * x[:, [1, 2, 0]]  # m = -1, 0, 1
    constant = np.full((50, 1), (4 * np.pi) ** -0.5)
    np.testing.assert_allclose(sphere_harmonics(x, 4), np.hstack([constant, linear]), atol=1e-15)


def test_a_quadratic_by_hand():
    x, y, z = random_sphere(50, rng=np.random.default_rng(2)).vertices.T
    found = sphere_harmonics(np.column_stack([x, y, z]), 9)[:, 4:]
    root = (15 / (4 * np.pi)) ** 0.5
    expected = [
        root * x * y,
        root * y * z,
        (3 * z**2 - 1) * root / 12**0.5,
        root * x * z,
        root * (x**2 - y**2) / 2,
    ]
    np.testing.assert_allclose(found, np.column_stack(expected), atol=1e-14)


@pytest.mark.parametrize("degree", [6, 30])
def test_they_are_orthonormal(degree):
    points, weights = gauss_grid(degree + 1)
    harmonics = sphere_harmonics(points, (degree + 1) ** 2)
    np.testing.assert_allclose(
        harmonics.T @ (weights[:, None] * harmonics), np.eye((degree + 1) ** 2), atol=1e-12
    )


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_addition_theorem(seed):
    # Σ_m Y_lm(x) Y_lm(y) = (2l + 1)/4π P_l(x·y): each group is as many eigenfunctions as its eigenvalue has copies
    one, two = random_sphere(20, rng=np.random.default_rng(seed)).vertices[:2]
    values = sphere_harmonics(np.stack([one, two]), 441)
    for degree in (0, 1, 7, 20):
        group = slice(degree**2, (degree + 1) ** 2)
        legendre = np.polynomial.legendre.legval(one @ two, np.eye(21)[degree])
        assert values[0, group] @ values[1, group] == pytest.approx(
            (2 * degree + 1) / (4 * np.pi) * legendre, abs=1e-12
        )
        assert set(sphere_eigenvalues(441)[group]) == {degree * (degree + 1)}


def test_up_to_the_highest_degree_beside_a_pole_and_at_it():
    values = sphere_harmonics(
        [[0.0, 0.0, 1.0], [1e-3, 2e-3, 1.0], [0.3, 0.1, 1.0], [1.0, 0.5, 0.1]], 10**5
    )[:, : 316**2]
    degrees = np.arange(316)
    sums = np.add.reduceat(values**2, degrees**2, axis=1)
    np.testing.assert_allclose(sums, np.tile((2 * degrees + 1) / (4 * np.pi), (4, 1)), rtol=1e-9)
    assert np.count_nonzero(values[0]) == 316


@pytest.mark.parametrize("scale", [1e-300, 1e-100, 7.0, 1e100, 1e300])
def test_a_point_is_a_direction(scale):
    x = fibonacci_sphere(40).vertices
    np.testing.assert_allclose(sphere_harmonics(scale * x, 49), sphere_harmonics(x, 49), atol=1e-13)


def test_bad_input():
    with pytest.raises(
        InvalidShapeError, match="a direction from the origin; point 1 is the origin"
    ):
        sphere_harmonics(np.vstack([NORTH, 0 * NORTH]), 4)
    with pytest.raises(InvalidShapeError, match=r"points must have shape \(n, 3\)"):
        sphere_harmonics([[1.0, 0.0]], 4)
    with pytest.raises(InvalidParameterError, match=r"k must lie in 1\.\.100000; it is 0"):
        sphere_harmonics(EAST, 0)
