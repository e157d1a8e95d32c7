import numpy as np
import pytest

import eigenshape as es
from eigenshape._errors import InvalidShapeError


def torus_curvature(mesh, outer=1.0, inner=0.4):
    rim = np.hypot(*mesh.vertices[:, :2].T)
    return (2 * rim - outer) / (2 * inner * rim)


@pytest.mark.parametrize("radius", [0.5, 3.0])
def test_a_sphere_that_faces_outward_has_one_over_its_radius(radius):
    unit = es.icosphere(4)
    found = es.operators.mean_curvature(es.TriangleMesh(radius * unit.vertices, unit.faces))
    assert np.median(np.abs(found * radius - 1)) < 0.001
    assert np.abs(found * radius - 1).max() < 0.15  # at the twelve vertices of five faces


def test_turned_inside_out_it_changes_sign():
    mesh = es.shapes.torus(16, 10)
    inward = es.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    np.testing.assert_allclose(
        es.operators.mean_curvature(inward), -es.operators.mean_curvature(mesh), rtol=1e-9
    )


def test_a_torus_is_approached_with_the_square_of_the_edges():
    errors = []
    for n in (16, 32, 64):
        mesh = es.shapes.torus(2 * n, n)
        errors.append(np.abs(es.operators.mean_curvature(mesh) - torus_curvature(mesh)).max())
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 1.9).all()
    assert errors[-1] < 0.001


def test_a_plane_has_none_and_a_cylinder_half_of_one_over_its_radius():
    flat = es.shapes.grid(30, 30)
    assert np.abs(es.operators.mean_curvature(flat)).max() < 1e-9
    x, y, _ = flat.vertices.T
    rolled = es.TriangleMesh(np.column_stack([2 * np.sin(x / 2), y, 2 * np.cos(x / 2)]), flat.faces)
    inside = ~np.isin(np.arange(flat.n_vertices), es.geometry.boundary_vertices(flat))
    np.testing.assert_allclose(es.operators.mean_curvature(rolled)[inside], 0.25, rtol=0.001)


@pytest.mark.parametrize("exponent", [-300, 300])
def test_it_scales_exactly_and_moves_with_the_shape(exponent):
    mesh = es.shapes.torus(12, 8)
    scaled = es.TriangleMesh(mesh.vertices * 2.0**exponent, mesh.faces)
    found = es.operators.mean_curvature(mesh)
    assert np.array_equal(es.operators.mean_curvature(scaled), found * 2.0**-exponent)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = es.TriangleMesh(mesh.vertices @ turn + 1000.0, mesh.faces)
    np.testing.assert_allclose(es.operators.mean_curvature(moved), found, atol=1e-8)


def test_bad_meshes_are_named():
    with pytest.raises(InvalidShapeError, match="vertex 3 at"):
        es.operators.mean_curvature(es.TriangleMesh(np.eye(4, 3), [[0, 1, 2]]))
