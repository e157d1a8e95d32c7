import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table, euler_characteristic, is_closed, is_manifold
from eigenshape.shapes.creatures import FEWEST_NEIGHBORS, MOST_NEIGHBORS, collapse_shortest_edges
from eigenshape.shapes.isosurface import isosurface


def ring(points):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, points[:, 2]) - 0.4


RING = isosurface(ring, np.array([-1.4, -1.4, -0.4]), np.array([1.4, 1.4, 0.4]), 0.15)
OCTAHEDRON = TriangleMesh(
    [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
    [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]],
)


@settings(deadline=None, max_examples=8)
@given(st.integers(150, RING.n_vertices))
def test_a_ring_stays_a_closed_ring(n_vertices):
    mesh = collapse_shortest_edges(RING, n_vertices)
    assert mesh.n_vertices == n_vertices
    assert (euler_characteristic(mesh), is_closed(mesh), is_manifold(mesh)) == (0, True, True)
    assert inconsistent_edges(mesh).size == 0
    degrees = np.bincount(edge_table(mesh).edges.ravel())
    assert degrees.min() >= FEWEST_NEIGHBORS
    assert degrees.max() <= max(MOST_NEIGHBORS, np.bincount(edge_table(RING).edges.ravel()).max())


def test_the_shortest_edge_collapses_into_its_middle():
    lengths = np.linalg.norm(np.diff(RING.vertices[edge_table(RING).edges], axis=1)[:, 0], axis=1)
    one, two = edge_table(RING).edges[lengths.argmin()]
    middle = (RING.vertices[one] + RING.vertices[two]) / 2
    mesh = collapse_shortest_edges(RING, RING.n_vertices - 1)
    assert np.linalg.norm(mesh.vertices - middle, axis=1).min() == pytest.approx(0, abs=1e-15)
    assert mesh.n_faces == RING.n_faces - 2


def test_an_octahedron_cannot_lose_a_vertex():
    mesh = collapse_shortest_edges(OCTAHEDRON, 4)
    np.testing.assert_array_equal(mesh.vertices, OCTAHEDRON.vertices)
    np.testing.assert_array_equal(mesh.faces, OCTAHEDRON.faces)
