import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.cloud_measure import cloud_quadrature
from eigenshape.geometry.domains import disc
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.spheres import fibonacci_sphere, graded_sphere, random_sphere, three_sphere
from eigenshape.geometry.star_loops import star_areas


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.integers(5, 30))
def test_the_star_of_a_point_is_that_of_delaunay(seed, k):
    around = np.random.default_rng(seed).uniform(-1, 1, (k, 2))
    around = around[np.argsort(np.linalg.norm(around, axis=1))]
    corners = np.vstack([[0.0, 0.0], around])
    star = [row for row in Delaunay(corners).simplices if 0 in row]
    sides = corners[star][:, 1:] - corners[star][:, :1]
    centres = np.linalg.solve(sides, (sides**2).sum(axis=2)[..., None] / 2)[..., 0] + corners[star][:, 0]
    narrow = np.abs(centres).max(axis=1) < 2 * np.linalg.norm(around[-1])
    expected = np.abs(np.linalg.det(sides))[narrow].sum() / 2
    assert star_areas(around[None])[0] == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_a_disc_has_the_measure_of_its_mesh_up_to_the_rim():
    mesh = disc(12)
    found = cloud_quadrature(PointCloud(mesh.vertices))
    np.testing.assert_allclose(found.weights, dual_volumes(mesh), rtol=1e-6)


@pytest.mark.parametrize(
    ("mesh", "lost", "spread"),
    [
        (fibonacci_sphere(2000), 0.003, 0.02),
        (graded_sphere(2000), 0.003, 0.02),
        (random_sphere(2000, rng=np.random.default_rng(0)), 0.01, 0.06),
    ],
)
def test_the_sphere_has_its_area(mesh, lost, spread):
    found = cloud_quadrature(PointCloud(mesh.vertices))
    assert found.weights.sum() == pytest.approx(4 * np.pi, rel=lost)
    assert np.std(found.weights / dual_volumes(mesh)) < spread


def test_flat_torus_three_sphere_and_a_curve():
    angles = 2 * np.pi * np.random.default_rng(0).random((3000, 2))
    torus = np.column_stack([np.cos(angles), np.sin(angles)])
    assert cloud_quadrature(PointCloud(torus)).weights.sum() == pytest.approx(4 * np.pi**2, rel=0.01)
    volume = cloud_quadrature(PointCloud(three_sphere(600).points, 3)).weights.sum()
    assert volume == pytest.approx(2 * np.pi**2, rel=0.06)
    turn = np.sort(2 * np.pi * np.random.default_rng(0).random(500))
    curve = np.column_stack([np.cos(turn), np.sin(turn), np.cos(2 * turn)])
    length = np.linalg.norm(curve - np.roll(curve, 1, axis=0), axis=1).sum()
    assert cloud_quadrature(PointCloud(curve, 1)).weights.sum() == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_scale_exactly(size):
    points = fibonacci_sphere(200).vertices
    one, other = cloud_quadrature(PointCloud(points)), cloud_quadrature(PointCloud(size * points))
    np.testing.assert_allclose(other.weights / size / size, one.weights, rtol=1e-9)


def test_neighbours_that_do_not_span_are_named():
    line = np.column_stack([np.arange(40.0), np.zeros(40), np.zeros(40)])
    with pytest.raises(InvalidShapeError, match=r"must span 2 dimensions; those of point 0 at \[0\.0, 0"):
        cloud_quadrature(PointCloud(line))


def test_equal_points_are_named():
    points = np.random.default_rng(0).random((50, 3))
    points[40] = points[7]
    with pytest.raises(InvalidShapeError, match=r"Points must differ; points 7 and 40 are both .* \(2 such\)\. Drop"):
        cloud_quadrature(PointCloud(points))


def test_too_few_points_and_neighbours_are_refused():
    with pytest.raises(InvalidShapeError, match="A cloud of dimension 2 needs over 3 points; it has 3"):
        cloud_quadrature(PointCloud(np.eye(3)))
    with pytest.raises(InvalidParameterError, match=r"n_neighbors must lie in 3\.\.49; it is 2"):
        cloud_quadrature(PointCloud(np.random.default_rng(0).random((50, 3))), n_neighbors=2)


def test_a_point_without_simplices_is_named():
    nearly_straight = np.column_stack([np.arange(40.0), 1e-5 * np.arange(40.0) ** 2])
    with pytest.raises(InvalidShapeError, match=r"Every point must have simplices; point 0 at \[0\.0, 0\.0\] has none"):
        cloud_quadrature(PointCloud(nearly_straight))


def test_at_the_end_of_a_curve_one_side_is_enough():
    steps = np.arange(20.0)
    found = cloud_quadrature(PointCloud(np.column_stack([steps, 0 * steps]), 1))
    np.testing.assert_allclose(found.weights, [0.5, *[1] * 18, 0.5], rtol=1e-12)
