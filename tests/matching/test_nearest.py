"""A tree of points with normals finds the nearest, wherever a search begins and however its rows move."""

import numpy as np
import pytest

from eigenshape.matching.nearest import LEAF, RowTree


def nearest_of_all(points, rows):
    return np.linalg.norm(points[..., None, :] - rows, axis=-1).min(axis=-1)


@pytest.mark.parametrize("n_rows", [1, 2, LEAF, LEAF + 1, 700])
def test_no_row_is_nearer(n_rows):
    draw = np.random.default_rng(n_rows)
    rows, points = draw.standard_normal((n_rows, 6)), draw.standard_normal((5, 80, 6))
    tree = RowTree(rows)
    distances, found = tree.nearest(points)
    assert np.allclose(distances, nearest_of_all(points, rows), rtol=1e-14)
    assert np.allclose(np.linalg.norm(points - rows[found], axis=2), distances, rtol=1e-14)
    wrong = draw.integers(0, n_rows, found.shape)
    kept = wrong.copy()
    assert np.array_equal(tree.nearest(points, wrong)[0], distances)
    assert np.array_equal(wrong, kept)


@pytest.mark.parametrize("n_rows", [LEAF + 1, 5 * LEAF, 700])
@pytest.mark.parametrize("n_values", [2, 1000])
def test_each_node_is_halved_where_it_is_longest(n_rows, n_values):
    rows = np.random.default_rng(n_rows).integers(0, n_values, (n_rows, 6)).astype(float)
    tree = RowTree(rows)
    assert np.array_equal(np.sort(tree.order), np.arange(n_rows))
    leaves = 1 << tree.levels
    width = leaves
    while width > 1:
        for leaf in range(0, leaves, width):
            first, middle, end = (
                (leaf + part) * n_rows // leaves for part in (0, width // 2, width)
            )
            block = rows[tree.order[first:end]]
            axis = np.ptp(block, axis=0).argmax()
            low, high = block[: middle - first, axis], block[middle - first :, axis]
            assert low.max() <= high.min()
        width //= 2


def test_rows_that_move_are_found_where_they_are():
    draw = np.random.default_rng(0)
    rows, points = draw.standard_normal((2, 500, 6))
    tree = RowTree(rows)
    moved = 3 * rows[::-1] + 1
    tree.move(moved)
    distances, found = tree.nearest(points)
    assert np.allclose(distances, nearest_of_all(points, moved), rtol=1e-14)
    assert np.allclose(np.linalg.norm(points - moved[found], axis=1), distances, rtol=1e-14)


def test_the_first_of_equal_rows_is_enough():
    distances, found = RowTree(np.zeros((3 * LEAF, 6))).nearest(np.ones((2, 6)))
    assert np.array_equal(distances, np.full(2, np.sqrt(6)))
    assert np.all(found < 3 * LEAF)
