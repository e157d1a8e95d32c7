import numpy as np
import pytest

from eigenshape.scans.raster import Raster, depths_at
from eigenshape.shapes.surfaces import icosphere

QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def square(left, top, right, bottom, height=0.0):
    corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
    return np.column_stack([np.array(corners, dtype=float), np.full(4, float(height))])


def test_a_square_covers_exactly_its_pixels():
    seen = Raster.of(square(2, 1, 5, 4, 0.25), QUAD, 8, 6)
    expected = np.zeros((6, 8), dtype=bool)
    expected[1:4, 2:5] = True
    np.testing.assert_array_equal(seen.face >= 0, expected)
    np.testing.assert_allclose(seen.depth[expected], 0.25, rtol=1e-15)
    assert (seen.depth[~expected] == -np.inf).all()
    assert not seen.weights[~expected].any()


def test_faces_share_the_diagonal_and_the_lower_one_wins_it():
    seen = Raster.of(square(0, 0, 3, 3), QUAD, 3, 3)
    assert seen.face.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert Raster.of(square(0, 0, 3, 3), QUAD[::-1], 3, 3).face.tolist() == [
        [0, 1, 1],
        [0, 0, 1],
        [0, 0, 0],
    ]


@pytest.mark.parametrize("turned", [False, True])
def test_weights_give_the_middle_of_the_pixel(turned):
    points = np.array([[0.3, 0.2, 1.0], [7.1, 1.9, 3.0], [2.2, 6.8, -2.0]])
    faces = np.array([[0, 2, 1] if turned else [0, 1, 2]])
    seen = Raster.of(points, faces, 8, 8)
    row, column = np.nonzero(seen.face == 0)
    assert len(row) > 10
    there = np.einsum(
        "ij,ijk->ik", seen.weights[row, column], points[faces[seen.face[row, column]]]
    )
    np.testing.assert_allclose(there[:, 0], column + 0.5, atol=1e-12)
    np.testing.assert_allclose(there[:, 1], row + 0.5, atol=1e-12)
    np.testing.assert_allclose(there[:, 2], seen.depth[row, column], atol=1e-12)
    np.testing.assert_allclose(seen.weights[row, column].sum(axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_the_nearer_face_is_seen(order):
    points = np.concatenate([square(0, 0, 4, 4, 1.0), square(2, 0, 4, 4, 2.0)])
    faces = np.concatenate([QUAD, QUAD + 4])[::order]
    seen = Raster.of(points, faces, 4, 4)
    assert (seen.depth[:, :2] == 1).all()
    assert (seen.depth[:, 2:] == 2).all()
    assert set(faces[seen.face[:, 2:]].ravel().tolist()) <= {4, 5, 6, 7}


def test_of_equal_heights_the_lower_face_is_seen():
    points = np.concatenate([square(0, 0, 4, 4)] * 3)
    seen = Raster.of(points, np.concatenate([QUAD + 8, QUAD, QUAD + 4]), 4, 4)
    assert set(seen.face.ravel().tolist()) == {0, 1}


def buffer_of_all_pixels(points, faces, width, height):
    """Test every pixel against every face, in NumPy."""
    y, x = np.indices((height, width)) + 0.5
    depth, face = np.full((height, width), -np.inf), np.full((height, width), -1)
    for number, (a, b, c) in enumerate(points[faces]):
        u, v = b - a, c - a
        area = u[0] * v[1] - u[1] * v[0]
        if area == 0:
            continue
        one = (v[1] * (x - a[0]) - v[0] * (y - a[1])) / area
        two = (u[0] * (y - a[1]) - u[1] * (x - a[0])) / area
        there = a[2] + one * u[2] + two * v[2]
        inside = (one >= 0) & (two >= 0) & (one + two <= 1) & (there > depth)
        depth[inside], face[inside] = there[inside], number
    return depth, face


@pytest.mark.parametrize(("width", "height", "scale"), [(40, 30, 15.0), (25, 50, 40.0)])
def test_the_picture_is_that_of_a_search_of_all_pixels(width, height, scale):
    rng = np.random.default_rng(4)
    points = rng.random((90, 3)) * scale  # at the larger scale faces end beyond the picture
    faces = rng.integers(0, 90, (60, 3))
    seen = Raster.of(points, faces, width, height)
    depth, face = buffer_of_all_pixels(points, faces, width, height)
    np.testing.assert_array_equal(seen.face, face)
    np.testing.assert_allclose(seen.depth, depth, rtol=1e-9)


def test_a_sphere_has_no_pinholes():
    ball = icosphere(3)
    points = ball.vertices * 60 + 64
    seen = Raster.of(points, ball.faces, 128, 128)
    y, x = np.indices((128, 128)) + 0.5
    distance = np.hypot(x - 64, y - 64)
    assert (seen.face[distance < 58] >= 0).all()  # its flat faces reach within 1 % of 60
    assert (seen.face[distance > 60] == -1).all()
    front = np.sqrt(60**2 - distance[distance < 58] ** 2) + 64
    np.testing.assert_allclose(seen.depth[distance < 58], front, atol=3)


def test_what_is_outside_of_the_picture_is_cut_off():
    seen = Raster.of(square(-3, -3, 2, 9), QUAD, 4, 4)
    assert (seen.face[:, :2] >= 0).all()
    assert (seen.face[:, 2:] == -1).all()
    assert (Raster.of(square(10, 10, 20, 20), QUAD, 4, 4).face == -1).all()


def test_a_face_seen_from_its_edge_covers_nothing():
    points = np.array([[0.0, 0.5, 0], [4, 0.5, 0], [2, 0.5, 9]])
    assert (Raster.of(points, np.array([[0, 1, 2]]), 4, 4).face == -1).all()


def test_depths_at_some_pixels_are_those_of_the_picture():
    ball = icosphere(3)
    points = ball.vertices * [20, 24, 9] + [24, 28, 0]
    pixels = points[:, :2].astype(np.int64)
    seen = Raster.of(points, ball.faces, 56, 56)
    wanted = seen.depth[pixels[:, 1], pixels[:, 0]]
    assert len(np.unique(wanted)) > 100
    assert np.array_equal(depths_at(points, ball.faces, pixels, 56), wanted)
