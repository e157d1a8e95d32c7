"""Points by which labels are transferred."""

import numpy as np

import eigenshape as es
from eigenshape.retrieval.labels.labeled_shape import LARGEST_RADIUS, label_points


def test_the_largest_balls_that_touch_a_sphere_fill_it_and_have_no_end_outside():
    points = label_points(es.icosphere(3))
    inside, outside = np.exp(points.radii.T)  # in sides of the box
    np.testing.assert_allclose(inside, 0.5, atol=0.02)
    np.testing.assert_allclose(outside, LARGEST_RADIUS)
