"""Points thrown on surfaces: uniform, in their faces, the same for the same generator."""

import numpy as np
import pytest

import eigenshape as es


def mesh_of_two():
    """One triangle of area 3 and one of area 1."""
    points = [[0, 0, 0], [3, 0, 0], [0, 2, 0], [3, 0, 5], [3, 1, 5], [3, 0, 7]]
    return es.TriangleMesh(points, [[0, 1, 2], [3, 4, 5]])


def test_faces_are_met_by_area():
    found = es.geometry.sample_surface(mesh_of_two(), 20_000, rng=np.random.default_rng(0))
    assert np.mean(found.simplices == 0) == pytest.approx(
        0.75, abs=4 * np.sqrt(0.75 * 0.25 / 20_000)
    )


def test_points_are_spread_evenly_inside_a_face():
    found = es.geometry.sample_surface(mesh_of_two(), 20_000, rng=np.random.default_rng(1))
    # A uniform point of a triangle has barycentric coordinates of mean 1/3 and variance 1/18.
    np.testing.assert_allclose(found.weights.mean(axis=0), 1 / 3, atol=5 / np.sqrt(18 * 20_000))
    np.testing.assert_allclose(found.weights.var(axis=0), 1 / 18, rtol=0.05)
    assert (found.weights >= 0).all()


def test_points_lie_where_their_weights_say():
    mesh = es.shapes.torus(12, 8)
    found = es.geometry.sample_surface(mesh, 100, rng=np.random.default_rng(2))
    corners = mesh.vertices[mesh.faces[found.simplices]]
    np.testing.assert_allclose(found.points, (found.weights[:, :, None] * corners).sum(axis=1))


def test_the_same_generator_throws_the_same_points_at_every_size():
    mesh = es.shapes.torus(12, 8)
    small = es.TriangleMesh(mesh.vertices * 1e-100, mesh.faces)
    one, two = (
        es.geometry.sample_surface(each, 50, rng=np.random.default_rng(3)) for each in (mesh, small)
    )
    np.testing.assert_array_equal(one.simplices, two.simplices)
    np.testing.assert_allclose(one.points, two.points * 1e100)


def test_solids_can_be_sampled_too():
    solid = es.shapes.box(2, 2, 2)
    found = es.geometry.sample_surface(solid, 5000, rng=np.random.default_rng(4))
    low, high = solid.points.min(axis=0), solid.points.max(axis=0)
    np.testing.assert_allclose(found.points.mean(axis=0), (low + high) / 2, atol=0.03)


def test_what_has_no_area_cannot_be_sampled():
    flat = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(es.InvalidShapeError, match="must have area"):
        es.geometry.sample_surface(flat, 5, rng=np.random.default_rng(0))
    with pytest.raises(es.InvalidParameterError, match="n must lie in"):
        es.geometry.sample_surface(mesh_of_two(), 0, rng=np.random.default_rng(0))
