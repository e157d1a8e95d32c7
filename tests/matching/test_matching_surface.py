"""What matching measures on a surface."""

from dataclasses import fields

import numpy as np

import eigenshape as es
from eigenshape._corners import mean_normals
from eigenshape.matching.surface import _directions, describe_surface, turn_over


def test_directions_turn_left_as_seen_from_outside():
    """On a plane, towards points that are infinitely far away: ahead, and an eighth and a quarter of a turn on."""
    plane = es.shapes.grid(8, 8)
    ahead = np.array([[1, 0, 0], [0.5**0.5, 0.5**0.5, 0], [0, 1, 0]])
    distances = -ahead @ plane.vertices.T
    for faces, left in ((plane.faces, 1j), (plane.faces[:, ::-1], -1j)):
        mesh = es.TriangleMesh(plane.vertices, faces)
        found = _directions(mesh, np.array([40, 41, 49]), distances, mean_normals(mesh))
        turns = found / found[:, :1]
        np.testing.assert_allclose(turns, np.tile([1, left**0.5, left], (3, 1)), atol=1e-6)


def test_a_surface_that_is_turned_over_twice_is_as_it_was():
    surface = describe_surface(es.icosphere(3), 4.0, 20)
    once, twice = turn_over(surface), turn_over(turn_over(surface))
    assert not np.array_equal(once.numbers, surface.numbers)
    assert np.array_equal(twice.mesh.faces, surface.mesh.faces)
    for field in fields(surface):
        if field.name != "mesh":
            assert np.array_equal(getattr(twice, field.name), getattr(surface, field.name))
