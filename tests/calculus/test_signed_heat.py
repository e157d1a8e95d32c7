from itertools import pairwise

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.signed_heat import signed_heat_distance
from eigenshape.calculus.vector_heat import prepare_vector_heat
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.surfaces import grid, torus


def octasphere(times: int) -> TriangleMesh:
    """Return a sphere that has its equator and its meridians along edges."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    ball = TriangleMesh(points, faces)
    for _ in range(times):
        finer = subdivide(ball)
        lengths = np.linalg.norm(finer.vertices, axis=1, keepdims=True)
        ball = TriangleMesh(finer.vertices / lengths, finer.faces)
    return ball


def equator(ball: TriangleMesh) -> np.ndarray:
    """Return the equator, run eastward, with its first vertex repeated."""
    on = np.flatnonzero(np.abs(ball.vertices[:, 2]) < 1e-12)
    around = on[np.argsort(np.arctan2(ball.vertices[on, 1], ball.vertices[on, 0]))]
    return np.append(around, around[0])


def square_loop(n: int) -> tuple[TriangleMesh, list[int], np.ndarray]:
    """Return a grid, the middle square run counter-clockwise, and the exact distance to it."""
    square, low, high = grid(n, n), n // 4, 3 * n // 4
    places = {tuple(place): at for at, place in enumerate(np.rint(square.vertices[:, :2] * n))}
    corners = [(low, low), (high, low), (high, high), (low, high), (low, low)]
    loop = [places[low, low]]
    for start, end in pairwise(corners):
        steps = np.linspace(start, end, high - low + 1)[1:]
        loop += [places[tuple(np.rint(step))] for step in steps]
    beyond = np.abs(square.vertices[:, :2] - 0.5) - 0.25
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return square, loop, outside + np.minimum(beyond.max(axis=1), 0)


def test_the_equator_gives_the_latitude_with_an_error_that_falls():
    errors, gaps = [], []
    for times in (3, 4, 5):
        ball = octasphere(times)
        loop = equator(ball)
        exact = -np.arcsin(np.clip(ball.vertices[:, 2], -1, 1))  # the north is on the left
        errors.append(np.abs(signed_heat_distance(ball, [loop]) - exact).max())
        # An eighth of the loop is missing; the sign changes there all the same.
        broken = signed_heat_distance(ball, [loop[: 7 * len(loop) // 8 + 1]])
        gaps.append(np.abs(broken - exact).max())
    assert errors[-1] < 0.01
    assert gaps[-1] < 0.06
    assert np.log2(errors[0] / errors[2]) / 2 > 0.3


def test_the_distance_to_a_square_is_that_of_the_plane():
    errors = []
    for n in (12, 24, 48):
        square, loop, exact = square_loop(n)
        errors.append(np.abs(signed_heat_distance(square, [loop]) - exact).max())
    assert errors[0] < 0.75 / 12  # less than an edge length
    order = -np.polyfit(np.log([12, 24, 48]), np.log(errors), 1)[0]
    assert order > 0.35


def test_an_open_straight_curve_gives_the_distance_to_its_line():
    square = grid(12, 12)
    x, y, _ = square.vertices.T
    line = np.flatnonzero((x == 0.5) & (y >= 0.25) & (y <= 0.75))
    found = signed_heat_distance(square, [line[np.argsort(y[line])]])
    np.testing.assert_allclose(found, x - 0.5, atol=1e-12)


def test_the_rim_of_a_square_is_a_curve_too():
    square = grid(8, 8)
    left = np.flatnonzero(square.vertices[:, 0] == 0)
    np.testing.assert_allclose(
        signed_heat_distance(square, [left]), square.vertices[:, 0], atol=1e-12
    )


def test_two_curves_share_the_surface_between_them():
    ring = torus(64, 32)
    away = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
    radius, tube = (away.max() + away.min()) / 2, (away.max() - away.min()) / 2
    curves = []
    for level, turn in ((away.max(), 1), (away.min(), -1)):
        on = np.flatnonzero(np.abs(away - level) < 1e-9)
        on = on[np.argsort(turn * np.arctan2(ring.vertices[on, 1], ring.vertices[on, 0]))]
        curves.append(np.append(on, on[0]))
    angle = np.arctan2(ring.vertices[:, 2], away - radius)
    exact = -np.sign(angle) * np.minimum(np.abs(angle), np.pi - np.abs(angle)) * tube
    np.testing.assert_allclose(signed_heat_distance(ring, curves), exact, atol=0.002)


def test_reversal_flips_the_sign_and_scale_scales():
    square, loop, exact = square_loop(12)
    found = signed_heat_distance(square, [loop])
    assert found[exact < -0.1].max() < 0 < found[exact > 0.1].min()
    reverse = signed_heat_distance(square, [loop[::-1]])
    np.testing.assert_allclose(reverse, -found, atol=1e-12)
    turned = TriangleMesh(square.vertices, square.faces[:, ::-1])
    np.testing.assert_allclose(signed_heat_distance(turned, [loop]), -found, atol=1e-12)
    large = TriangleMesh(2.0**300 * square.vertices, square.faces)
    np.testing.assert_array_equal(signed_heat_distance(large, [loop]), 2.0**300 * found)


def test_prepared_factors_and_pieces_of_a_curve_give_the_same():
    square, loop, _ = square_loop(12)
    solver = prepare_vector_heat(square)
    whole = signed_heat_distance(solver, [loop])
    np.testing.assert_array_equal(whole, signed_heat_distance(square, [loop]))
    pieces = signed_heat_distance(solver, [loop[:9], loop[8:]])
    np.testing.assert_allclose(pieces, whole, atol=1e-12)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_components_without_a_curve_are_infinitely_far():
    square, loop, _ = square_loop(12)
    pair = disjoint_union(square, square)
    found = signed_heat_distance(pair, [loop])
    np.testing.assert_allclose(
        found[: square.n_vertices], signed_heat_distance(square, [loop]), atol=1e-12
    )
    assert np.isposinf(found[square.n_vertices :]).all()


@pytest.mark.parametrize(
    ("curves", "match"),
    [
        ([], "at least one curve; there is none"),
        ([0, 1], r"curve 0 is 0. Pass a single curve as \[curve\]"),
        ([[0, 1], [2]], "at least two vertices; curve 1 has 1"),
        ([[0, 24]], "ends of an edge; 0 and 24 are not"),
        ([[0, 1, 1]], "ends of an edge; 1 and 1 are not"),
        ([[0, 25]], r"A vertex of curve 0 must lie in 0..24; it is 25"),
        ([[0, 1, 0]], "reach every face of their components; at face 0 they cancel"),
    ],
)
def test_a_curve_that_is_none(curves, match):
    with pytest.raises(InvalidParameterError, match=match):
        signed_heat_distance(grid(4, 4), curves)


def test_a_single_curve_in_a_list_and_a_longer_time_are_remedies():
    square = grid(4, 4)
    assert np.isfinite(signed_heat_distance(square, [[0, 1]])).all()
    strip = TriangleMesh(grid(2000, 1).vertices * [1, 1 / 2000, 1], grid(2000, 1).faces)
    with pytest.raises(InvalidParameterError, match="larger time_factor of prepare_vector_heat"):
        signed_heat_distance(strip, [[0, 1]])
    solver = prepare_vector_heat(strip, time_factor=100.0)
    np.testing.assert_allclose(
        signed_heat_distance(solver, [[0, 1]]), strip.vertices[:, 0], atol=1e-6
    )


def test_flipped_faces_and_missing_coordinates_are_refused():
    faces = np.array(grid(4, 4).faces)
    faces[0] = faces[0, ::-1]
    points = np.array(grid(4, 4).vertices)
    with pytest.raises(InvalidShapeError, match="Neighboring faces must be turned the same way"):
        signed_heat_distance((points, faces), [[0, 1]])
    points[3] = np.nan
    with pytest.raises(InvalidShapeError, match="vertices must be finite; vertex 3"):
        signed_heat_distance((points, grid(4, 4).faces), [[0, 1]])
