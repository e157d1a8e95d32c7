import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import SphericalVoronoi

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.samples.quadrature import _cell_volume, _cell_volumes, shape_quadrature
from eigenshape.shapes.domains import disc
from eigenshape.shapes.spheres import fibonacci_sphere, random_sphere, three_sphere, uneven_sphere


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.integers(4, 30), st.booleans())
def test_the_cell_in_the_plane_is_that_of_qhull(seed, k, inside):
    around = np.random.default_rng(seed).uniform(-1 if inside else 0, 1, (k, 2))
    expected = _cell_volume(around)
    assert expected > 0
    assert _cell_volumes(around[None])[0] == pytest.approx(expected, rel=1e-8)


def test_a_disc_has_its_area_up_to_the_rim():
    mesh = disc(12)
    weights = shape_quadrature(PointCloud(mesh.vertices)).weights
    assert weights.sum() == pytest.approx(surface_area(mesh), rel=1e-3)
    assert weights.min() > 0.3 * weights.max()


@pytest.mark.parametrize(
    ("mesh", "lost", "spread"),
    [
        (fibonacci_sphere(2000), 1e-3, 2e-3),
        (uneven_sphere(2000), 1e-3, 3e-3),
        (random_sphere(2000, rng=np.random.default_rng(0)), 1e-3, 0.01),
    ],
)
def test_the_sphere_has_its_area_and_each_point_its_cell(mesh, lost, spread):
    found = shape_quadrature(PointCloud(mesh.vertices)).weights
    assert found.sum() == pytest.approx(4 * np.pi, rel=lost)
    assert np.std(found / SphericalVoronoi(mesh.vertices).calculate_areas()) < spread


def test_flat_torus_three_sphere_and_a_curve():
    angles = 2 * np.pi * np.random.default_rng(0).random((3000, 2))
    torus = np.column_stack([np.cos(angles), np.sin(angles)])
    assert shape_quadrature(PointCloud(torus)).weights.sum() == pytest.approx(
        4 * np.pi**2, rel=0.01
    )
    volume = shape_quadrature(PointCloud(three_sphere(600).points, 3)).weights.sum()
    assert volume == pytest.approx(2 * np.pi**2, rel=0.06)
    turn = np.sort(2 * np.pi * np.random.default_rng(0).random(500))
    curve = np.column_stack([np.cos(turn), np.sin(turn), np.cos(2 * turn)])
    length = np.linalg.norm(curve - np.roll(curve, 1, axis=0), axis=1).sum()
    assert shape_quadrature(PointCloud(curve, 1)).weights.sum() == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_scale_exactly(size):
    points = fibonacci_sphere(200).vertices
    one, other = shape_quadrature(PointCloud(points)), shape_quadrature(PointCloud(size * points))
    np.testing.assert_allclose(other.weights / size / size, one.weights, rtol=1e-9)


def test_neighbors_that_do_not_span_are_named():
    line = np.column_stack([np.arange(40.0), np.zeros(40), np.zeros(40)])
    with pytest.raises(
        InvalidShapeError, match=r"must span 2 dimensions; those of point 0 at \[0\.0, 0"
    ):
        shape_quadrature(PointCloud(line))


def test_equal_points_are_named():
    points = np.random.default_rng(0).random((50, 3))
    points[40] = points[7]
    with pytest.raises(
        InvalidShapeError,
        match=r"Points must differ; points 7 and 40 are both .* \(2 such\)\. Try repair\(cloud,",
    ):
        shape_quadrature(PointCloud(points))


def test_too_few_points_and_neighbors_are_refused():
    with pytest.raises(
        InvalidShapeError,
        match="A cloud of dimension 2 must have at least 4 points; this one has 3",
    ):
        shape_quadrature(PointCloud(np.eye(3)))
    with pytest.raises(InvalidParameterError, match=r"n_neighbors must lie in 3\.\.49; it is 2"):
        shape_quadrature(PointCloud(np.random.default_rng(0).random((50, 3))), n_neighbors=2)


@pytest.mark.parametrize(
    ("dim", "n"),
    [(1, 12), (1, 24), (2, 12), (2, 24), (3, 12), pytest.param(3, 24, marks=pytest.mark.long)],
)
def test_regular_lattices_have_the_measure_of_their_torus(n, dim):
    turns = np.stack(np.meshgrid(*[2 * np.pi * np.arange(n) / n] * dim), axis=-1).reshape(-1, dim)
    cloud = PointCloud(np.column_stack([np.cos(turns), np.sin(turns)]), dim)
    weights = shape_quadrature(cloud).weights
    assert weights.sum() == pytest.approx((2 * np.pi) ** dim, rel=4 * dim / n**2)
    np.testing.assert_allclose(weights, weights[0], rtol=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_lattice_with_a_boundary_is_weighed_to_its_corners(dim):
    ticks = np.arange(7.0)
    cloud = PointCloud(np.stack(np.meshgrid(*[ticks] * dim), axis=-1).reshape(-1, dim), dim)
    rim = ((cloud.points == 0) | (cloud.points == 6)).sum(axis=1)
    np.testing.assert_allclose(shape_quadrature(cloud).weights, 0.5**rim, rtol=1e-9)


def test_a_point_right_above_another_shares_its_cell():
    ticks = np.arange(9.0)
    flat = np.stack(np.meshgrid(ticks, ticks, [0.0]), axis=-1).reshape(-1, 3)
    weights = shape_quadrature(PointCloud(np.vstack([flat, flat[40] + [0, 0, 0.1]]))).weights
    assert weights[[40, 81]].sum() == pytest.approx(1, rel=0.2)
    assert weights.sum() == pytest.approx(64, rel=0.01)


def test_at_the_end_of_a_curve_one_side_is_enough():
    steps = np.arange(20.0)
    found = shape_quadrature(PointCloud(np.column_stack([steps, 0 * steps]), 1))
    np.testing.assert_allclose(found.weights, [0.5, *[1] * 18, 0.5], rtol=1e-12)
