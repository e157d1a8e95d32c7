import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.geodesic import geodesic_balls
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.surfaces import grid, icosphere


def test_on_a_flat_grid_the_way_is_straight():
    mesh = grid(12, 12)
    found = geodesic_balls(mesh, 0.45)
    rows, columns = found.nonzero()
    straight = np.linalg.norm(mesh.vertices[rows] - mesh.vertices[columns], axis=1)
    np.testing.assert_allclose(found[rows, columns], straight, rtol=1e-12)
    all_near = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices, axis=2) <= 0.45 - 1e-9
    assert found.nnz == all_near.sum() - mesh.n_vertices


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31))
def test_on_flat_irregular_triangles_it_is_straight_up_to_few_per_cent(seed):
    rng = np.random.default_rng(seed)
    flat = rng.random((300, 2))
    mesh = TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), Delaunay(flat).simplices)
    found = geodesic_balls(mesh, 0.3)
    rows, columns = found.nonzero()
    ratio = found[rows, columns] / np.linalg.norm(flat[rows] - flat[columns], axis=1)
    assert ratio.min() > 1 - 1e-9
    assert np.quantile(ratio, 0.99) < 1.03


def test_on_the_sphere_it_is_the_great_circle():
    mesh = icosphere(4)
    found = geodesic_balls(mesh, 0.6)
    rows, columns = found.nonzero()
    exact = 2 * np.arcsin(np.linalg.norm(mesh.vertices[rows] - mesh.vertices[columns], axis=1) / 2)
    assert np.abs(found[rows, columns] / exact - 1).max() < 0.002


def test_two_sheets_that_nearly_touch_stay_far_apart():
    sheet = grid(8, 8)
    folded = np.array([[x, y, 0.0] if x <= 0.5 else [1 - x, y, 0.01] for x, y, _ in sheet.vertices])
    found = geodesic_balls(TriangleMesh(folded, sheet.faces), 0.4).toarray()
    below, above = 1 * 9 + 4, 7 * 9 + 4  # opposite each other, .01 apart, .75 along the sheet
    assert np.linalg.norm(folded[below] - folded[above]) < 0.011
    assert found[below, above] == 0


def test_never_longer_than_along_the_edges():
    mesh = icosphere(2)
    edges = geodesic_balls(mesh, 10.0)
    ways = dijkstra(_edge_lengths(mesh))
    assert (edges.toarray() <= ways + 1e-12).all()
    assert edges.nnz == mesh.n_vertices * (mesh.n_vertices - 1)


def _edge_lengths(mesh):
    lengths = np.full((mesh.n_vertices,) * 2, np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        ends = mesh.faces[:, a], mesh.faces[:, b]
        lengths[ends] = lengths[ends[::-1]] = np.linalg.norm(mesh.vertices[ends[0]] - mesh.vertices[ends[1]], axis=1)
    return lengths


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_change_nothing(size):
    mesh = icosphere(2)
    one = geodesic_balls(mesh, 0.7)
    other = geodesic_balls(TriangleMesh(size * mesh.vertices, mesh.faces), 0.7 * size)
    np.testing.assert_array_equal(one.indices, other.indices)
    np.testing.assert_allclose(other.data / size, one.data, rtol=1e-12)


def test_it_is_symmetric_and_the_same_in_five_dimensions():
    mesh = icosphere(2)
    turned = np.linalg.qr(np.random.default_rng(0).normal(size=(5, 5)))[0][:3]
    one = geodesic_balls(mesh, 0.7)
    other = geodesic_balls(SimplicialMesh(mesh.vertices @ turned, mesh.faces), 0.7)
    assert (one != one.T).nnz == 0
    np.testing.assert_allclose(other.toarray(), one.toarray(), atol=1e-12)


def test_curves_and_bad_radii_are_refused():
    with pytest.raises(InvalidShapeError, match="are measured on surfaces; this mesh has dimension 1"):
        geodesic_balls(SimplicialMesh([[0.0], [1.0]], [[0, 1]]), 1.0)
    with pytest.raises(InvalidParameterError, match="radius must be positive and finite"):
        geodesic_balls(icosphere(1), 0.0)
