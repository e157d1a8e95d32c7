"""The smallest ball around points: by hand, by brute force, in bad positions and at any size."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es

some = settings(deadline=None, max_examples=100)


def circumscribed(points):
    """Center in the flat of some points, as far from all of them; None where there is none."""
    sides = points[1:] - points[0]
    gram = sides @ sides.T
    if len(sides) and np.linalg.cond(gram) > 1e12:
        return None
    return points[0] + np.linalg.solve(2 * gram, np.diag(gram)) @ sides if len(sides) else points[0]


def brute_force(points):
    """The least radius of the balls of 1 to d + 1 points that hold all."""
    best = np.inf
    for size in range(1, points.shape[1] + 2):
        for chosen in combinations(range(len(points)), size):
            center = circumscribed(points[list(chosen)])
            if center is not None:
                best = min(best, np.linalg.norm(points - center, axis=1).max())
    return best


def test_by_hand():
    ball = es.geometry.enclosing_ball([[0, 0], [2, 0], [1, 0.5]])
    np.testing.assert_allclose(ball.center, [1, 0], atol=1e-15)
    assert ball.radius == pytest.approx(1)
    corners = (
        np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    )  # all eight lie on the sphere
    ball = es.geometry.enclosing_ball(corners)
    np.testing.assert_allclose(ball.center, 0.5)
    assert ball.radius == pytest.approx(np.sqrt(3) / 2)
    with pytest.raises(ValueError, match="read-only"):
        ball.center[0] = 0


@some
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 9), st.sampled_from([2, 5, 10**6])
)
def test_it_is_the_least_of_all_balls(seed, dim, n, spread):
    points = np.random.default_rng(seed).integers(0, spread, (n, dim)).astype(float)
    ball = es.geometry.enclosing_ball(points)
    assert ball.radius == pytest.approx(brute_force(points), rel=1e-9)
    assert (np.linalg.norm(points - ball.center, axis=1) <= ball.radius * (1 + 1e-12)).all()


@pytest.mark.parametrize("scale", [1e-300, 1e-100, 1.0, 1e100, 1e300])
def test_it_scales_and_moves_with_the_points(scale):
    points = np.random.default_rng(0).standard_normal((200, 3))
    plain, moved = (
        es.geometry.enclosing_ball(points),
        es.geometry.enclosing_ball(scale * (points + 7)),
    )
    assert moved.radius == pytest.approx(scale * plain.radius, rel=1e-12)
    np.testing.assert_allclose(moved.center, scale * (plain.center + 7), rtol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 1e-15, 1e-12, 1e-8, 1e-4])
def test_bad_positions(shift):
    """Equal and nearly equal points, points on a line, points on a sphere."""
    rng = np.random.default_rng(1)
    pair = np.array([[0, 0, 0], [1.0, 0, 0]])
    near = np.concatenate([pair, pair + shift * rng.standard_normal((2, 3)), pair])
    assert es.geometry.enclosing_ball(near).radius == pytest.approx(0.5, rel=1e-12 + 3 * shift)
    line = rng.random((50, 1)) * np.array([[1.0, 2.0, 3.0]]) + shift * rng.standard_normal((50, 3))
    assert es.geometry.enclosing_ball(line).radius == pytest.approx(
        np.ptp(line @ [1, 2, 3]) / 2 / 14**0.5, rel=1e-12 + 4 * shift
    )
    sphere = rng.standard_normal((500, 3))
    sphere *= (1 - shift * rng.random((500, 1))) / np.linalg.norm(sphere, axis=1, keepdims=True)
    assert es.geometry.enclosing_ball(sphere).radius == pytest.approx(1, rel=1e-12 + shift)


def test_a_single_point_has_a_ball_without_radius():
    assert es.geometry.enclosing_ball([[3.0, 4.0]]).radius == 0
    assert es.geometry.enclosing_ball(np.full((5, 3), 1e8)).radius == 0


def test_many_points_in_many_dimensions():
    points = np.random.default_rng(2).standard_normal((2000, 8))
    ball = es.geometry.enclosing_ball(points)
    away = np.linalg.norm(points - ball.center, axis=1)
    assert away.max() == pytest.approx(ball.radius, rel=1e-14)
    # The center of the smallest ball is a convex combination of the points on its boundary.
    touching = points[away > ball.radius * (1 - 1e-9)]
    weights = np.linalg.lstsq(
        np.vstack([touching.T, np.ones(len(touching))]), np.append(ball.center, 1), rcond=None
    )[0]
    assert (weights > 0).all()
    np.testing.assert_allclose(weights @ touching, ball.center, atol=1e-9)


def test_bad_input_is_named():
    with pytest.raises(es.InvalidShapeError, match="An enclosing ball must contain points"):
        es.geometry.enclosing_ball(np.empty((0, 3)))
    with pytest.raises(es.InvalidShapeError, match="point 1 is"):
        es.geometry.enclosing_ball([[0, 0], [np.nan, 1]])
