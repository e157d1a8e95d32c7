"""Points by which labels are transferred."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

import eigenshape as es
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.retrieval.labels.labeled_shape import LARGEST_RADIUS, label_points
from eigenshape.retrieval.labels.transport import transport_points


def test_the_largest_balls_that_touch_a_sphere_fill_it_and_have_no_end_outside():
    points = label_points(es.icosphere(3))
    inside, outside = np.exp(points.radii.T)  # in sides of the box
    np.testing.assert_allclose(inside, 0.5, atol=0.02)
    np.testing.assert_allclose(outside, LARGEST_RADIUS)


def test_no_vertex_lies_within_a_ball_that_touches_the_surface():
    mesh = es.make_creature("fish", n_vertices=500)
    points = label_points(mesh)
    unit = normalize_mesh(mesh, "box")
    normals = es.geometry.vertex_normals(unit)[points.vertices]
    for radii, side in zip(np.exp(points.radii.T), (-1, 1), strict=True):
        centers = unit.vertices[points.vertices] + side * radii[:, None] * normals
        nearest, _ = cKDTree(unit.vertices).query(centers)
        assert np.median(nearest / radii) > 0.95
        assert (nearest > 0.8 * radii).mean() > 0.95


def test_shapes_cost_more_if_thicknesses_or_distances_differ():
    mesh = es.make_creature("fish", n_vertices=500)
    points = label_points(mesh)
    shares, cost = transport_points(points, points)
    np.testing.assert_allclose(shares.sum(axis=1), 1)
    thicker = replace(points, radii=points.radii + 0.5)
    assert transport_points(thicker, points)[1] > cost + 0.1
    other = np.random.default_rng(0).permutation(len(points.vertices))
    elsewhere = replace(points, distances=points.distances[np.ix_(other, other)])
    assert transport_points(elsewhere, points)[1] > cost + 0.1
