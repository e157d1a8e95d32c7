"""What matching measures on a surface."""

import numpy as np

import eigenshape as es
from eigenshape.geometry.measure import mean_normals
from eigenshape.matching.surface import _directions


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
