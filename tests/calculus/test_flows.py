"""Flows: spheres shrink as they must, boundaries stay, filters keep the volume."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.calculus import mean_curvature_flow, taubin_smooth

BALL = es.icosphere(2)


@pytest.mark.parametrize("conformal", [False, True])
def test_a_sphere_shrinks_by_four_t(conformal):
    found = mean_curvature_flow(BALL, 0.1, n_steps=20, conformal=conformal)
    radii = np.linalg.norm(found.vertices, axis=1)
    # ∂r/∂t = -2/r; the conformal flow follows the same path on a sphere.
    np.testing.assert_allclose(radii, np.sqrt(0.6), rtol=0.02)


def test_a_surface_with_boundary_goes_to_a_minimal_one():
    square = es.shapes.grid(8, 8)
    bump = np.prod(np.sin(np.pi * square.vertices[:, :2]), axis=1)
    hill = es.TriangleMesh(square.vertices + 0.3 * bump[:, None] * [0, 0, 1], square.faces)
    found = mean_curvature_flow(hill, 5.0, n_steps=20)
    rim = es.geometry.boundary_vertices(square)
    np.testing.assert_array_equal(found.vertices[rim], hill.vertices[rim])
    assert abs(found.vertices[:, 2]).max() < 1e-6
    free = mean_curvature_flow(hill, 0.005, fixed=[])
    assert np.abs(free.vertices[rim] - hill.vertices[rim]).max() > 0.01


def test_flow_scales_exactly_with_the_unit():
    unit = 2.0**200
    large = es.TriangleMesh(BALL.vertices * unit, BALL.faces)
    found = mean_curvature_flow(large, 0.1 * unit * unit, n_steps=3)
    same = mean_curvature_flow(BALL, 0.1, n_steps=3)
    np.testing.assert_array_equal(found.vertices, same.vertices * unit)


def test_taubin_multiplies_modes_as_it_says():
    # On a regular polygon, the coordinates are eigenfunctions of I - D⁻¹A at 1 - cos(2π / n).
    polygon = es.shapes.circle(9)
    k = 1 - np.cos(2 * np.pi / 9)
    found = taubin_smooth(polygon, 3, shrink=0.4, inflate=-0.6)
    factor = ((1 - 0.4 * k) * (1 + 0.6 * k)) ** 3
    np.testing.assert_allclose(found.points, factor * polygon.points, atol=1e-14)


def test_taubin_smooths_noise_and_keeps_the_volume():
    ball = es.icosphere(3)
    noise = 0.02 * np.random.default_rng(0).standard_normal(ball.vertices.shape)
    noisy = es.TriangleMesh(ball.vertices + noise, ball.faces)
    smooth = taubin_smooth(noisy)
    kept = es.geometry.enclosed_volume(smooth) / es.geometry.enclosed_volume(ball)
    assert kept == pytest.approx(1.0, abs=0.01)
    assert es.operators.noise_level(smooth) < 0.8 * es.operators.noise_level(noisy)


def test_the_inside_of_a_solid_is_smoothed_and_its_boundary_stays():
    solid = es.shapes.box(4, 4, 4)
    rim = es.geometry.boundary_vertices(solid)
    shaken = solid.points + 0.03 * np.random.default_rng(1).standard_normal(solid.points.shape)
    shaken[rim] = solid.points[rim]
    found = taubin_smooth(es.SimplicialMesh(shaken, solid.simplices), fixed=rim)
    assert isinstance(found, es.SimplicialMesh)
    np.testing.assert_array_equal(found.points[rim], solid.points[rim])
    assert np.abs(found.points - solid.points).sum() < np.abs(shaken - solid.points).sum()


def test_wrong_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="t must be positive"):
        mean_curvature_flow(BALL, 0.0)
    with pytest.raises(es.InvalidShapeError, match="must stop before the surface collapses; after"):
        mean_curvature_flow(BALL, 1e4, n_steps=5)
    with pytest.raises(
        es.InvalidShapeError, match="The flow must stop before faces collapse; after"
    ):
        mean_curvature_flow(es.shapes.torus(24, 8, inner=0.1), 0.01, n_steps=20)
    for steps in ({"shrink": 0.0}, {"shrink": 0.5, "inflate": -0.4}, {"inflate": 0.3}):
        with pytest.raises(es.InvalidParameterError, match="inflate below -shrink"):
            taubin_smooth(BALL, **steps)


def test_modes_do_not_grow_beyond_twice():
    ball = es.icosphere(2)
    with pytest.raises(es.InvalidParameterError, match="n_steps can be at most 1053; it is 100000"):
        taubin_smooth(ball, 100_000)
    with pytest.raises(
        es.InvalidParameterError, match="one grows 4 times, so n_steps can be at most 0"
    ):
        taubin_smooth(ball, 10, shrink=1.0, inflate=-1.5)
    most = taubin_smooth(ball, 1053)
    assert np.abs(most.vertices).max() < 2.5
