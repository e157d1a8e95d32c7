"""Conformal maps: exact on developable surfaces, better with finer meshes elsewhere."""

import numpy as np
import pytest
import scipy.sparse as sp

import eigenshape as es
from eigenshape.calculus import (
    angle_distortion,
    conformal,
    flatten_conformally,
    map_to_sphere,
)

SHEET = es.shapes.grid(10, 5)


def rolled(turn):
    x, y, _ = SHEET.vertices.T
    return es.TriangleMesh(np.column_stack([np.cos(turn * x), y, np.sin(turn * x)]), SHEET.faces)


def cap(level):
    ball = es.icosphere(level)
    upper = ball.faces[(ball.vertices[ball.faces, 2] > 0.1).all(axis=1)]
    return es.repair(es.TriangleMesh(ball.vertices, upper), ["drop_unreferenced"]).mesh


def test_a_flat_sheet_is_only_moved():
    plane = flatten_conformally(SHEET)
    edges = es.geometry.edge_table(SHEET).edges
    lengths = np.linalg.norm(plane[edges[:, 0]] - plane[edges[:, 1]], axis=1)
    np.testing.assert_allclose(lengths, es.geometry.edge_lengths(SHEET), rtol=1e-6)
    np.testing.assert_allclose(angle_distortion(SHEET, plane), 1.0, atol=1e-6)


def test_the_area_stays_and_orientation_too():
    mesh = cap(2)
    plane = flatten_conformally(mesh)
    one, two = (plane[mesh.faces[:, i]] - plane[mesh.faces[:, 0]] for i in (1, 2))
    signed = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    assert (signed > 0).all()
    assert signed.sum() == pytest.approx(es.geometry.surface_area(mesh))


def test_a_finer_cap_is_nearer_to_conformal():
    worst = [
        np.mean(angle_distortion(mesh, flatten_conformally(mesh)) - 1) for mesh in (cap(2), cap(3))
    ]
    assert worst[1] < 0.7 * worst[0] < 0.1


def test_an_egg_goes_to_the_sphere():
    mean = []
    for level in (1, 2):
        ball = es.icosphere(level)
        egg = es.TriangleMesh(ball.vertices * [1.0, 1.0, 1.5] + 7.0, ball.faces)
        sphere = map_to_sphere(egg)
        np.testing.assert_allclose(np.linalg.norm(sphere, axis=1), 1.0)
        assert es.geometry.enclosed_volume(es.TriangleMesh(sphere, egg.faces)) > 0
        mean.append(np.mean(angle_distortion(egg, sphere) - 1))
    assert mean[1] < 0.7 * mean[0]
    inside_out = map_to_sphere(es.TriangleMesh(egg.vertices, egg.faces[:, ::-1]))
    np.testing.assert_allclose(inside_out, sphere, atol=1e-6)


def test_wrong_arguments_are_named():
    with pytest.raises(es.InvalidShapeError, match="connected and have a boundary to be flattened"):
        flatten_conformally(es.icosphere(1))
    for mesh in (SHEET, es.shapes.torus(8, 6)):
        with pytest.raises(
            es.InvalidShapeError, match="Only a closed connected surface of genus 0"
        ):
            map_to_sphere(mesh)
    ball = es.icosphere(2)
    stick = es.TriangleMesh(ball.vertices * [1, 1, 20], ball.faces)
    with pytest.raises(es.ConvergenceError, match="must make the surface round within 2 steps"):
        map_to_sphere(stick, n_steps=2)
    with pytest.raises(es.ConvergenceError, match="equations of a conformal map must be definite"):
        conformal._factor(sp.csr_array([[0.0]]))
    with pytest.raises(es.InvalidParameterError, match="positions must hold one place per vertex"):
        angle_distortion(SHEET, np.zeros((3, 2)))
    with pytest.raises(
        es.InvalidParameterError, match="positions must be finite; that of vertex 0"
    ):
        angle_distortion(SHEET, np.full((SHEET.n_vertices, 2), np.nan))
    flipped = SHEET.faces.copy()
    flipped[0] = flipped[0, ::-1]
    with pytest.raises(es.InvalidShapeError, match="Neighboring faces must be turned the same way"):
        flatten_conformally(es.TriangleMesh(SHEET.vertices, flipped))


@pytest.mark.long
@pytest.mark.data
def test_a_camel_maps_to_the_sphere(data):
    """Its legs become 1e-13 of the sphere; the determinants of such triangles need differences."""
    camel = es.read_mesh(data / "classics" / "camel.off")
    sphere = map_to_sphere(camel)
    distortion, areas = angle_distortion(camel, sphere), es.geometry.face_areas(camel)
    assert areas @ (distortion < 1.5) > 0.75 * areas.sum()


def test_limbs_that_become_points_are_refused(monkeypatch):
    monkeypatch.setattr(conformal, "ROUNDING", 0.05)
    with pytest.raises(es.ConvergenceError, match="triangles become points, the first is face"):
        map_to_sphere(es.make_creature("biped", n_vertices=600))


def test_triangles_that_turned_over_are_turned_back():
    ball = es.icosphere(2)
    before = ball.vertices.copy()
    before[50] = before[ball.faces[0, 0]]  # far across its neighbors
    turned = conformal._turned_faces(ball, before)
    assert turned.size
    after = conformal._relax_around(ball, before, turned, 1)
    assert not conformal._turned_faces(ball, after).size
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), 1)


def test_triangles_that_stay_turned_over_are_refused(monkeypatch):
    monkeypatch.setattr(conformal, "_turned_faces", lambda mesh, sphere: np.array([3]))
    with pytest.raises(es.ConvergenceError, match="it turns 1 of 80, the first is face 3"):
        map_to_sphere(es.icosphere(1))


@pytest.mark.long
@pytest.mark.data
def test_a_head_with_thin_triangles_maps_to_the_sphere(data, monkeypatch):
    head = es.read_mesh(data / "classics" / "decimated-max.obj")
    sphere = map_to_sphere(head)
    assert not conformal._turned_faces(head, sphere).size
    assert np.median(angle_distortion(head, sphere)) < 1.1
    monkeypatch.setattr(conformal, "MOST_ROUNDS", 0)
    with pytest.raises(es.ConvergenceError, match="must not turn triangles over; it turns 11 of"):
        map_to_sphere(head)


def test_a_face_that_hangs_on_an_edge_is_named():
    ball = es.icosphere(3)
    one, two, _ = ball.faces[0]
    vertices = np.vstack([ball.vertices, 2 * ball.vertices[one]])
    fin = es.TriangleMesh(vertices, [*ball.faces, [one, two, ball.n_vertices]])
    with pytest.raises(
        es.InvalidShapeError, match=rf"share edge \({min(one, two)}, {max(one, two)}\)"
    ):
        es.calculus.flatten_conformally(fin)
