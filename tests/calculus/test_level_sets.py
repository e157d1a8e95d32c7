"""Level sets: lengths, lines that close, surfaces in solids."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.calculus import level_set

BALL = es.icosphere(3)
SQUARE = es.shapes.grid(6, 6)
SOLID = es.shapes.box(5, 5, 5)


def test_a_line_through_a_square_is_straight():
    found = level_set(SQUARE, SQUARE.vertices @ [1.0, 2.0, 0.0], 1.3)
    assert found.size == pytest.approx(np.hypot(1.0, 0.5))
    (line,) = found.polylines()
    np.testing.assert_allclose(line @ [1.0, 2.0, 0.0], 1.3)
    np.testing.assert_allclose(found.interpolate(SQUARE.vertices[:, 1]), found.points[:, 1])
    np.testing.assert_allclose(
        found.interpolate(SQUARE.vertices @ np.eye(3)), found.points, atol=1e-15
    )


def test_a_level_through_vertices_is_found_once():
    found = level_set(SQUARE, SQUARE.vertices[:, 0], 0.5)  # along a row of edges
    assert found.size == pytest.approx(1.0)
    assert len(found.polylines()) == 1


def test_lines_on_a_closed_surface_close():
    values = BALL.vertices[:, 0] * BALL.vertices[:, 1]
    found = level_set(BALL, values, 0.2)
    lines = found.polylines()
    assert len(lines) == 2
    assert all((line[0] == line[-1]).all() for line in lines)
    total = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines)
    assert total == pytest.approx(found.size)


def test_larger_values_lie_on_the_left():
    found = level_set(SQUARE, SQUARE.vertices[:, 1], 0.4)  # grows upward: lines go right
    steps = np.diff(found.points[found.pieces], axis=1)[:, 0]
    assert (steps[:, 0] > -1e-12).all()


def test_a_plane_through_a_solid():
    found = level_set(SOLID, SOLID.points @ [1.0, 1.0, 0.0], 0.77)
    assert found.size == pytest.approx(0.77 * np.sqrt(2))
    surface = found.surface()
    normals = es.geometry.face_normals(surface)[es.geometry.face_areas(surface) > 1e-12]
    np.testing.assert_allclose(normals, np.broadcast_to([0.5**0.5, 0.5**0.5, 0], normals.shape))


def test_a_sphere_in_a_solid_is_closed_and_oriented():
    radii = np.linalg.norm(SOLID.points - 0.5, axis=1)
    surface = level_set(SOLID, radii, 0.31).surface()
    assert es.geometry.is_closed(surface)
    assert es.geometry.enclosed_volume(surface) > 0


def test_values_near_the_largest_float():
    found = level_set(SQUARE, (SQUARE.vertices[:, 0] - 0.5) * 1.7e308 * 2, 0.0)
    assert found.size == pytest.approx(1.0)


def test_a_level_that_is_not_reached_is_empty():
    found = level_set(SQUARE, SQUARE.vertices[:, 0], 5.0)
    assert found.size == 0.0
    assert found.polylines() == []


def test_lines_end_where_three_faces_meet():
    points = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]]
    fins = es.TriangleMesh(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    lines = level_set(fins, fins.vertices[:, 2], 0.5).polylines()
    assert [len(line) for line in lines] == [2, 2, 2]


def test_wrong_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="values must hold one number per vertex"):
        level_set(BALL, np.zeros(3), 0.0)
    with pytest.raises(es.InvalidParameterError, match="level must be finite"):
        level_set(BALL, np.zeros(BALL.n_vertices), np.nan)
    with pytest.raises(es.InvalidShapeError, match="found on triangles and tetrahedra"):
        level_set(es.shapes.interval(3), np.zeros(4), 0.0)
    line = level_set(BALL, BALL.vertices[:, 2], 0.1)
    with pytest.raises(es.InvalidShapeError, match="Only level sets in solids are surfaces"):
        line.surface()
    with pytest.raises(es.InvalidParameterError, match="the level set crosses an edge of vertex"):
        line.interpolate([1.0, 2.0])
    with pytest.raises(es.InvalidShapeError, match="Only level sets on surfaces are lines"):
        level_set(SOLID, SOLID.points[:, 0], 0.1).polylines()
