"""Points by which labels are transferred."""

from dataclasses import replace

import numpy as np

import eigenshape as es
from eigenshape.retrieval.labels.labeled_shape import LARGEST_RADIUS, label_points
from eigenshape.retrieval.labels.transport import transport_points


def test_the_largest_balls_that_touch_a_sphere_fill_it_and_have_no_end_outside():
    points = label_points(es.icosphere(3))
    inside, outside = np.exp(points.radii.T)  # in sides of the box
    np.testing.assert_allclose(inside, 0.5, atol=0.02)
    np.testing.assert_allclose(outside, LARGEST_RADIUS)


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
