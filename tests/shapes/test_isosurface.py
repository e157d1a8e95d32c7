import numpy as np
import pytest

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.topology import euler_characteristic, is_closed, is_manifold
from eigenshape.shapes.isosurface import find_spacing, isosurface


def ball(points):
    return np.linalg.norm(points, axis=1) - 1


def ring(points):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, points[:, 2]) - 0.4


def two_balls(points):
    return np.minimum(ball(points), ball(points - np.array([4.0, 0, 0])))


def test_a_sphere_is_met():
    mesh = isosurface(ball, -np.ones(3), np.ones(3), 0.2)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=1e-3)
    assert enclosed_volume(mesh) == pytest.approx(4 / 3 * np.pi, rel=0.03)
    assert (euler_characteristic(mesh), is_closed(mesh), is_manifold(mesh)) == (2, True, True)


def test_a_torus_has_its_hole():
    mesh = isosurface(ring, np.array([-1.4, -1.4, -0.4]), np.array([1.4, 1.4, 0.4]), 0.15)
    np.testing.assert_allclose(ring(mesh.vertices), 0, atol=2e-3)
    assert (euler_characteristic(mesh), is_closed(mesh), is_manifold(mesh)) == (0, True, True)
    assert enclosed_volume(mesh) == pytest.approx(2 * np.pi**2 * 0.16, rel=0.05)


def test_a_surface_in_two_parts_is_refused():
    with pytest.raises(
        InvalidShapeError, match=r"smooth at the spacing of the grid; at spacing 0\.25 it is not"
    ):
        isosurface(two_balls, -np.ones(3), np.array([5.0, 1, 1]), 0.25)


def test_the_spacing_gives_about_the_vertices_asked_for():
    for n_vertices in (300, 3000):
        spacing = find_spacing(ball, -np.ones(3), np.ones(3), n_vertices)
        assert isosurface(ball, -np.ones(3), np.ones(3), spacing).n_vertices == pytest.approx(
            n_vertices, rel=0.1
        )
