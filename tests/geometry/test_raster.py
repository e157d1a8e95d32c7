import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_fill_holes

from eigenshape.geometry import raster
from eigenshape.geometry.raster import rasterize
from eigenshape.geometry.surfaces import icosphere

ONE = np.array([[0, 1, 2]])


def sphere_in_pixels(size, *, stretch=(1, 1, 1), rotation=None):
    sphere = icosphere(3)
    points = sphere.vertices * stretch @ (np.eye(3) if rotation is None else rotation)
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - low) * (0.9 * size / (high - low)[:2].max()) + [0.05 * size, 0.05 * size, 0], sphere.faces


def holes(seen):
    return int((binary_fill_holes(seen) & ~seen).sum())


def test_a_triangle_covers_the_pixel_middles_inside_it():
    seen = rasterize(np.array([[0.0, 0, 0], [4, 0, 4], [0, 4, 8]]), ONE, 5, 4)
    #  (right, down) is covered where right + 0.5 + down + 0.5 <= 4, the hypotenuse included
    assert np.array_equal(seen.face >= 0, np.add.outer(np.arange(4), np.arange(5)) <= 3)
    assert seen.weights[0, 0] == pytest.approx([0.75, 0.125, 0.125])
    assert seen.depth[0, 0] == pytest.approx(4 * 0.125 + 8 * 0.125)
    assert seen.weights[1, 2] == pytest.approx([0, 0.625, 0.375])
    assert seen.depth[3, 4] == -np.inf


@pytest.mark.parametrize("faces", [[[0, 1, 2], [3, 4, 5]], [[3, 4, 5], [0, 1, 2]], [[0, 2, 1], [3, 5, 4]]])
def test_the_nearest_face_is_seen_whichever_comes_first_or_is_turned_over(faces):
    low, high = np.array([[0.0, 0, 1], [9, 0, 1], [0, 9, 1]]), np.array([[0.0, 0, 2], [3, 0, 2], [0, 3, 2]])
    seen = rasterize(np.concatenate([low, high]), np.array(faces), 4, 4)
    nearest = faces.index(next(face for face in faces if 3 in face))
    assert seen.face[0, 0] == nearest
    assert seen.face[3, 3] == 1 - nearest
    assert (seen.depth[0, 0], seen.depth[3, 3]) == (2, 1)


def test_of_equal_heights_the_lowest_face_is_seen():
    points = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0]])
    assert set(np.unique(rasterize(points, np.array([[0, 1, 2]] * 3), 6, 6).face)) == {-1, 0}


def test_what_is_edge_on_or_outside_is_not_seen():
    edge_on = np.array([[0.0, 2.5, 0], [4, 2.5, 0], [2, 2.5, 3]])
    outside = np.array([[-5.0, 0, 0], [-1, 0, 0], [-1, 4, 0]])
    for points in (edge_on, outside, outside + np.array([20, 0, 0]), outside + np.array([3, 50, 0])):
        seen = rasterize(points, ONE, 5, 5)
        assert (seen.face == -1).all()
        assert (seen.depth == -np.inf).all()


def test_a_triangle_far_larger_than_the_picture_fills_it():
    seen = rasterize(np.array([[-1e7, -1e7, 0.0], [1e7, -1e7, 1], [0, 1e7, 2]]), ONE, 30, 20)
    assert (seen.face == 0).all()
    assert seen.weights.sum(axis=2) == pytest.approx(np.ones((20, 30)))


def test_a_sphere_covers_a_disc_and_has_no_pinhole():
    points, faces = sphere_in_pixels(257)
    seen = rasterize(points, faces, 257, 257)
    assert (seen.face >= 0).sum() == pytest.approx(np.pi * (0.45 * 257) ** 2, rel=0.01)
    assert seen.depth.max() == pytest.approx(points[:, 2].max(), abs=0.1)
    assert holes(seen.face >= 0) == 0


@pytest.mark.parametrize("stretch", [(1, 1, 1e-3), (1, 1e-3, 1), (1e-2, 1, 1), (1, 1e-5, 1e-2)])
def test_slivers_leave_no_pinhole(stretch):
    for seed in range(4):
        rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
        points, faces = sphere_in_pixels(151, stretch=stretch, rotation=rotation)
        assert holes(rasterize(points, faces, 151, 151).face >= 0) == 0


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_edges_through_pixel_middles_leave_no_gap(seed):
    rng = np.random.default_rng(seed)
    lines = np.sort(np.concatenate([[2.5, 40.5], rng.integers(3, 40, 8) + rng.choice([0.5, 0.0, 1e-7, 1e-3], 8)]))
    across, down = np.meshgrid(lines, lines)
    points = np.column_stack([across.ravel(), down.ravel(), rng.standard_normal(100)])
    corner = (np.arange(9)[:, None] * 10 + np.arange(9)).ravel()
    a, b, c, d = corner, corner + 1, corner + 10, corner + 11
    faces = np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])
    wanted = np.zeros((44, 44), dtype=bool)
    wanted[2:41, 2:41] = True
    assert np.array_equal(rasterize(points, faces, 44, 44).face >= 0, wanted)


def nearest_by_hand(points, faces, column, row):
    """Height of the surface over the middle of one pixel in exact arithmetic, None where there is none."""
    here = [Fraction(2 * column + 1, 2), Fraction(2 * row + 1, 2)]
    heights = []
    for face in faces.tolist():
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ([Fraction(x) for x in points[i].tolist()] for i in face)
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area:
            v = ((here[0] - ax) * (cy - ay) - (here[1] - ay) * (cx - ax)) / area
            w = ((bx - ax) * (here[1] - ay) - (by - ay) * (here[0] - ax)) / area
            if v >= 0 and w >= 0 and v + w <= 1:
                heights.append(az + v * (bz - az) + w * (cz - az))
    return max(heights) if heights else None


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_equal_to_exact_arithmetic_pixel_by_pixel(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(-8, 40, (9, 3)) / 4.0
    faces = rng.integers(0, 9, (6, 3))
    seen = rasterize(points, faces, 8, 7)
    for row in range(7):
        for column in range(8):
            height = nearest_by_hand(points, faces, column, row)
            assert (seen.face[row, column] >= 0) == (height is not None)
            if height is not None:
                assert seen.depth[row, column] == pytest.approx(float(height), abs=1e-9)
                corners = points[faces[seen.face[row, column]]]
                middle = [column + 0.5, row + 0.5, float(height)]
                assert seen.weights[row, column] @ corners == pytest.approx(middle, abs=1e-7)


@pytest.mark.parametrize("at_once", [1, 7, 1000, 10**9])
def test_the_size_of_the_chunks_changes_nothing(monkeypatch, at_once):
    points, faces = sphere_in_pixels(40)
    points = np.concatenate([points, [[-50.0, -50, -9], [120, 0, 9], [0, 120, 9]]])
    faces = np.concatenate([faces, [[len(points) - 3, len(points) - 2, len(points) - 1]]])
    usual = rasterize(points, faces, 40, 40)
    monkeypatch.setattr(raster, "CANDIDATES_AT_ONCE", at_once)
    other = rasterize(points, faces, 40, 40)
    assert np.array_equal(usual.face, other.face)
    assert np.allclose(usual.weights, other.weights, rtol=0, atol=1e-12)
    assert np.array_equal(np.isfinite(usual.depth), np.isfinite(other.depth))
    assert np.allclose(usual.depth[usual.face >= 0], other.depth[usual.face >= 0], rtol=0, atol=1e-9)


def test_memory_is_bounded_also_for_one_huge_face(monkeypatch):
    monkeypatch.setattr(raster, "CANDIDATES_AT_ONCE", 20_000)
    tracemalloc.start()
    try:
        seen = rasterize(np.array([[-1e4, -1e4, 0.0], [1e4, -1e4, 1], [0, 1e4, 2]]), ONE, 700, 700)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (seen.face == 0).all()
    answer = seen.face.nbytes + seen.weights.nbytes + seen.depth.nbytes
    assert peak < 1.5 * answer + 300 * 20_000
