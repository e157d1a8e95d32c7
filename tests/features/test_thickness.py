import numpy as np
import pytest
from scipy.spatial import KDTree

from eigenshape.features.part_contrast import inscribed_radii
from eigenshape.geometry.measure import vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.surfaces import icosphere


def radii(mesh, largest=5.0):
    return inscribed_radii(
        KDTree(mesh.vertices), vertex_normals(mesh), np.arange(mesh.n_vertices), largest
    )


def test_balls_in_a_sphere_have_its_radius():
    assert radii(icosphere(4)) == pytest.approx(1, rel=0.02)


def test_a_ball_holds_no_other_point():
    ball = icosphere(3)
    egg = TriangleMesh(ball.vertices * [2.0, 1.0, 0.3], ball.faces)
    found = radii(egg)
    centers = egg.vertices - found[:, None] * vertex_normals(egg)
    gaps, _ = KDTree(egg.vertices).query(centers)
    inside = gaps < found * (1 - 1e-3)
    assert inside.mean() < 0.1, "only balls that touch their own side stop early"
    middle = np.linalg.norm(egg.vertices[:, :2] / [2.0, 1.0], axis=1) < 0.3
    assert found[middle] == pytest.approx(0.3, rel=0.1)


def test_a_ball_that_meets_nothing_keeps_the_largest_radius():
    ball = icosphere(2)
    inside_out = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    assert (radii(inside_out, 2.5) == 2.5).all()
