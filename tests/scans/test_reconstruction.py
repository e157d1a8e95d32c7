"""Surfaces of point clouds."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import eigenshape as es
from eigenshape.scans.reconstruction import reconstruct_surface


def sampled(mesh, n):
    points = es.geometry.sample_surface(mesh, n, rng=np.random.default_rng(0)).points
    return es.PointCloud(points)


def test_a_ball_is_closed_and_faces_outward():
    made = reconstruct_surface(es.PointCloud(es.icosphere(4).vertices))
    assert es.geometry.is_closed(made.mesh)
    assert es.geometry.is_manifold(made.mesh)
    assert es.geometry.euler_characteristic(made.mesh) == 2
    assert es.geometry.enclosed_volume(made.mesh) == pytest.approx(4 / 3 * np.pi, rel=0.03)
    assert np.linalg.norm(made.mesh.vertices, axis=1) == pytest.approx(1, abs=0.05)
    assert made.report[0].startswith("reconstruct_surface made ")
    nearest = cKDTree(es.icosphere(4).vertices).query(made.mesh.vertices)[1]
    assert np.array_equal(made.source_vertices, nearest)


def test_a_torus_keeps_its_hole():
    made = reconstruct_surface(sampled(es.shapes.torus(60, 40), 4000))
    assert es.geometry.euler_characteristic(made.mesh) == 0


def test_no_triangle_is_a_needle():
    made = reconstruct_surface(sampled(es.make_creature("fish", n_vertices=1000), 3000))
    corners = made.mesh.vertices[made.mesh.faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (sides.min(axis=1) > 0.05 * sides.max(axis=1)).all()
    assert es.suggest_repairs(made.mesh) == ()


def test_half_a_ball_stays_open():
    points = es.icosphere(4).vertices
    made = reconstruct_surface(es.PointCloud(points[points[:, 2] > 0]))
    assert len(es.geometry.boundary_loops(made.mesh)) == 1
    assert es.geometry.surface_area(made.mesh) == pytest.approx(2 * np.pi, rel=0.25)
    outward = np.einsum(
        "fi,fi->f", es.geometry.face_normals(made.mesh), made.mesh.vertices[made.mesh.faces[:, 0]]
    )
    assert (outward > 0).mean() > 0.95


def test_a_hole_as_small_as_some_points_is_closed():
    points = es.icosphere(4).vertices
    made = reconstruct_surface(es.PointCloud(points[points[:, 2] < 0.99]))
    assert es.geometry.is_closed(made.mesh)


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_clouds_scale(scale):
    points = sampled(es.make_creature("fish", n_vertices=1000), 2000).points
    plain = reconstruct_surface(es.PointCloud(points)).mesh
    scaled = reconstruct_surface(es.PointCloud(scale * points)).mesh
    assert np.array_equal(plain.faces, scaled.faces)
    assert np.array_equal(scale * plain.vertices, scaled.vertices)


def test_two_balls_are_two_surfaces():
    ball = es.icosphere(3).vertices
    made = reconstruct_surface(es.PointCloud(np.concatenate([ball, ball + np.array([4, 0, 0])])))
    assert es.geometry.vertex_components(made.mesh)[0] == 2
    assert es.geometry.enclosed_volume(made.mesh) == pytest.approx(8 / 3 * np.pi, rel=0.1)


def test_normals_that_fit_no_surface_are_refused():
    points = es.icosphere(2).vertices
    normals = np.random.default_rng(0).normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    with pytest.raises(es.InvalidShapeError, match=r"must reach the points .* misses 100 %"):
        reconstruct_surface(es.PointCloud(points), normals)


def test_what_has_no_surface_is_refused():
    with pytest.raises(es.InvalidShapeError, match="at least 100 points in R\\^3"):
        reconstruct_surface(es.PointCloud(np.eye(3)))
    with pytest.raises(es.InvalidShapeError, match="at least 100 points in R\\^3"):
        reconstruct_surface(es.PointCloud(np.random.default_rng(0).random((200, 2))))
    t = np.linspace(0, 1, 1000)
    line = np.column_stack([t, np.sin(9 * t), np.cos(9 * t)])
    with pytest.raises(
        es.InvalidShapeError, match="spread in two directions; those of 1000 of 1000"
    ):
        reconstruct_surface(es.PointCloud(line))
