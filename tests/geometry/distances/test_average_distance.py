import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError


def test_on_a_sphere_it_is_a_quarter_turn():
    found = es.geometry.average_geodesic_distance(es.icosphere(4))
    np.testing.assert_allclose(found, np.pi / 2, rtol=0.006)
    assert found.std() < 0.002


def test_with_all_bases_it_is_the_weighted_mean_of_all_distances():
    mesh = es.shapes.torus(14, 9)
    areas = es.geometry.dual_volumes(mesh)
    rows = es.geometry.geodesic_distances(mesh, np.arange(mesh.n_vertices))
    found = es.geometry.average_geodesic_distance(mesh, n_bases=10**6)
    np.testing.assert_allclose(found, areas @ rows / areas.sum(), rtol=1e-12)


def test_on_a_square_it_is_the_mean_of_straight_lines():
    # From the center of a unit square (√2 + ln(1 + √2)) / 6, from a corner twice that.
    mesh = es.shapes.grid(24, 24)
    found = es.geometry.average_geodesic_distance(mesh, n_bases=mesh.n_vertices)
    exact = (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6
    center = np.abs(mesh.vertices[:, :2] - 0.5).max(axis=1) < 1e-9
    corner = (mesh.vertices[:, :2] == 0).all(axis=1)
    assert found[center] == pytest.approx(exact, rel=0.003)
    assert found[corner] == pytest.approx(2 * exact, rel=0.003)
    assert found.argmin() == np.flatnonzero(center)[0]


@pytest.mark.long
def test_a_sample_of_bases_comes_near():
    mesh = es.shapes.torus(60, 30)
    exact = es.geometry.average_geodesic_distance(mesh, n_bases=mesh.n_vertices)
    errors = [
        np.abs(es.geometry.average_geodesic_distance(mesh, n_bases=n) / exact - 1).max()
        for n in (20, 150)
    ]
    assert errors[1] < errors[0]
    assert errors[1] < 0.02


def test_it_scales_exactly():
    mesh = es.shapes.torus(12, 8)
    scaled = es.TriangleMesh(mesh.vertices * 2.0**300, mesh.faces)
    assert np.array_equal(
        es.geometry.average_geodesic_distance(scaled),
        es.geometry.average_geodesic_distance(mesh) * 2.0**300,
    )


def test_distances_from_sources():
    mesh = es.geometry.disjoint_union(es.shapes.grid(6, 6), es.icosphere(1))
    found = es.geometry.geodesic_distances(mesh, [0, 48])
    flat = mesh.vertices[:49]
    np.testing.assert_allclose(found[0, :49], np.linalg.norm(flat - flat[0], axis=1), rtol=1e-12)
    assert np.isinf(found[:, 49:]).all()
    assert found[0, 48] == pytest.approx(found[1, 0], rel=1e-14)


def test_bad_input_is_named():
    pieces = es.geometry.disjoint_union(es.shapes.grid(1, 1), es.icosphere(0))
    with pytest.raises(
        InvalidShapeError,
        match="must be connected to have average distances; this one has 2 components",
    ):
        es.geometry.average_geodesic_distance(pieces)
    with pytest.raises(InvalidParameterError, match="n_bases must be at least 1; it is 0"):
        es.geometry.average_geodesic_distance(es.shapes.grid(1, 1), n_bases=0)
    with pytest.raises(InvalidParameterError, match=r"A source must lie in 0\.\.3; it is 4"):
        es.geometry.geodesic_distances(es.shapes.grid(1, 1), [4])
    with pytest.raises(InvalidShapeError, match="this one has dimension 1"):
        es.geometry.geodesic_distances(es.shapes.interval(3), [0])
