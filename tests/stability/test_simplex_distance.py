"""Distances from points to simplices: by hand, and against fine samples."""

import numpy as np
import pytest

from eigenshape.stability.anchors import squared_distances

TRIANGLE = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ([0.5, 0.5, 3.0], 3.0),  # over the inside
        ([1.0, -2.0, 0.0], 2.0),  # beside an edge
        ([-3.0, -4.0, 0.0], 5.0),  # beyond a corner
        ([2.0, 2.0, 0.0], 2**0.5),  # beyond the long edge
        ([1.0, 0.5, 0.0], 0.0),
    ],
)
def test_a_triangle_by_hand(point, distance):
    assert squared_distances(np.array([point]), TRIANGLE)[0, 0] == pytest.approx(
        distance**2, rel=1e-14, abs=1e-30
    )


@pytest.mark.parametrize("dim", [0, 1, 2, 3])
def test_no_point_of_the_simplex_is_nearer(dim):
    rng = np.random.default_rng(dim)
    corners, points = rng.standard_normal((4, dim + 1, 3)), 2 * rng.standard_normal((30, 3))
    found = squared_distances(points, corners)
    weights = rng.dirichlet(np.full(dim + 1, 0.6), 20_000)
    for place, simplex in enumerate(corners):
        nearest = ((points[:, None] - weights @ simplex) ** 2).sum(axis=2).min(axis=1)
        assert (found[:, place] <= nearest * (1 + 1e-12)).all()
        np.testing.assert_allclose(np.sqrt(found[:, place]), np.sqrt(nearest), atol=0.15)
