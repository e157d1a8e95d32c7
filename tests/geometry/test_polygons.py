"""Polygons become triangles that cover them, whatever their outline."""

import numpy as np
import pytest

from eigenshape import InvalidShapeError
from eigenshape.geometry.polygons import cut_polygons, triangulate_polygons

PRISM = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]]  # L-shaped, area 5
DART = [[0, 0], [2, -1], [1, 0], [2, 1]]  # area 1
COMB = [[0, 0], [5, 0], [5, 2], [4, 1], [3, 2], [2, 1], [1, 2], [0, 1]]  # area 7.5
SPIRAL = [
    [0, 0],
    [5, 0],
    [5, 5],
    [1, 5],
    [1, 2],
    [3, 2],
    [3, 3],
    [2, 3],
    [2, 4],
    [4, 4],
    [4, 1],
    [0, 1],
]
FRAME = [
    [0, 0], [4, 0], [4, 4], [0, 4], [0, 0], [1, 1], [1, 3], [3, 3], [3, 1], [1, 1],
]  # fmt: skip
LINE = [[0, 0], [1, 0], [2, 0], [3, 0], [3, 2], [0, 2]]  # area 6, two corners on a side
OUTLINES = {
    "prism": (PRISM, 5.0), "dart": (DART, 1.0), "comb": (COMB, 7.5), "spiral": (SPIRAL, 15.0),
    "frame": (FRAME, 12.0), "line": (LINE, 6.0),
}  # fmt: skip
BOW = [[0, 0], [1, 1], [1, 0], [0, 2]]


def cut(outline):
    outline = np.array(outline, dtype=np.float64)
    n = len(outline)
    return triangulate_polygons(outline, np.array([0, n]), np.arange(n))[0]


def areas(outline, triangles):
    """Signed areas in the plane."""
    x, y = np.array(outline, dtype=np.float64)[triangles].transpose(2, 1, 0)
    return ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) / 2


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("unit", [1e-100, 1.0, 1e100])
def test_triangles_cover_the_polygon_from_any_first_corner(name, unit):
    outline, area = OUTLINES[name]
    for first in range(len(outline)):
        turned = np.roll(outline, -first, axis=0)
        for order, sign in ((turned, 1), (turned[::-1], -1)):
            triangles = cut(unit * order)
            found = sign * areas(order, triangles)
            assert triangles.shape == (len(outline) - 2, 3)
            assert set(triangles.ravel().tolist()) == set(range(len(outline)))
            assert found.min() > 0
            assert found.sum() == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize("name", OUTLINES)
def test_polygons_lie_anywhere_in_space(name):
    outline, area = OUTLINES[name]
    flat = np.column_stack([np.array(outline, dtype=np.float64), np.zeros(len(outline))])
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    for places in (flat[:, [2, 0, 1]], flat @ rotation, 1e-3 * flat @ rotation + [5e5, 4e6, 0]):
        triangles = cut(places)
        a, b, c = places[triangles].transpose(1, 0, 2)
        vectors = np.cross(b - a, c - a) / 2
        assert (vectors @ vectors.sum(axis=0) > 0).all()
        unit = 1e-6 if places.max() > 1e5 else 1.0
        assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(unit * area, rel=1e-5)


def test_convex_polygons_stay_fans_around_their_first_corner():
    angles = 2 * np.pi * np.arange(1000) / 1000
    triangles = cut(np.column_stack([np.cos(angles), np.sin(angles)]))
    assert (
        triangles == np.column_stack([np.zeros(998), np.arange(1, 999), np.arange(2, 1000)])
    ).all()


def test_a_quad_that_is_not_flat_is_a_fan_unless_that_folds():
    assert cut([[0, 0, 0], [1, 0, 0.3], [1, 1, 0], [0, 1, 0.3]]).tolist() == [[0, 1, 2], [0, 2, 3]]
    folded = [[1, 0, 0], [0, 1, 0.1], [-1, 0, 0], [0, 0.4, -0.1]]
    assert sorted(map(sorted, cut(folded).tolist())) == [[0, 1, 3], [1, 2, 3]]


def test_polygons_of_all_lengths_keep_their_order_and_owners():
    points = np.array([*PRISM, *DART, [9, 9], [10, 9], [10, 10]], dtype=np.float64)
    starts = np.array([0, 3, 6, 12, 14, 18])
    corners = np.array([10, 11, 12, 12, 11, 10, *range(6), 3, 4, *range(6, 10)])
    triangles, owners = triangulate_polygons(points, starts, corners)
    assert owners.tolist() == [0, 1, 2, 2, 2, 2, 4, 4]
    assert triangles[:2].tolist() == [[10, 11, 12], [12, 11, 10]]
    assert areas(points, triangles[2:6]).sum() == 5.0
    assert areas(points, triangles[6:]).tolist() == [0.5, 0.5]
    assert triangulate_polygons(points, np.array([0]), np.array([], dtype=int))[0].shape == (0, 3)


@pytest.mark.parametrize(
    "outline",
    [
        [[0, 0], [1, 0], [2, 0], [1, 0]],
        [[1, 1]] * 5,
        [[0, 0], [1, 1], [3, 3], [2, 2], [4, 4]],
        [[0, 0], [1, 0], [1, 1], [0, np.nan], [0, 0]],
        [[0, 0], [1, 0], [1, 1], [1, 1]],
        [[0, 0], [1, 0], [1, 1], [0, 0]],
    ],
)
def test_polygons_without_area_or_place_are_left_to_the_repairs(outline):
    triangles = cut(outline)
    assert triangles.shape == (len(outline) - 2, 3)
    assert areas(np.nan_to_num(outline), triangles).min() >= 0


def test_corners_that_are_no_points_are_left_to_the_mesh():
    triangles, _ = triangulate_polygons(np.eye(3), np.array([0, 4]), np.array([0, 1, 7, -1]))
    assert triangles.tolist() == [[0, 1, 7], [0, 7, -1]]


@pytest.mark.parametrize(
    "outline",
    [
        BOW,
        [[0, 0], [1, 0], [0, 1], [1, 0]],
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[np.cos(a), np.sin(a)] for a in 4 * np.pi * np.arange(5) / 5],
        [[0, 0], [4, 0], [4, 3], [1, 3], [1, -1], [2, -1], [2, 2], [3, 2], [3, 1], [0, 1]],
    ],
)
def test_polygons_that_cross_themselves_are_refused_by_number(outline):
    points = np.array([*DART, *outline], dtype=np.float64)
    starts, corners = np.array([0, 4, len(points)]), np.arange(len(points))
    with pytest.raises(InvalidShapeError, match=r"cross themselves.*face 1 .*\(1 such\)"):
        triangulate_polygons(points, starts, corners)
    assert cut_polygons(points, starts, corners)[2].tolist() == [1]


def test_polygons_of_one_length_are_cut_or_refused_one_by_one():
    outlines = [DART, BOW, [[0, 0], [1, 0], [2, 0], [1, 0]], DART]
    points = np.array([corner for outline in outlines for corner in outline], dtype=np.float64)
    triangles, owners, crossed = cut_polygons(points, np.arange(0, 17, 4), np.arange(16))
    assert crossed.tolist() == [1]
    alone = cut(DART)
    assert (triangles[owners == 0] == alone).all()
    assert (triangles[owners == 3] == alone + 12).all()


def test_corners_in_the_order_of_the_outline_are_what_the_error_asks_for():
    assert areas(BOW, np.array([0, 2, 1, 3])[cut([BOW[i] for i in (0, 2, 1, 3)])]).sum() == 1.5


def test_equally_good_corners_are_cut_in_the_order_of_the_file():
    turned = np.array(COMB) @ [[0.6, 0.8], [-0.8, 0.6]]  # whose last digits differ
    assert (cut(COMB) == cut(turned)).all()
    assert (cut(COMB) == cut(1e-3 * turned + 4.0)).all()
