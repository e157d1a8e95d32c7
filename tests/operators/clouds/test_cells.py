import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es
from eigenshape.operators.clouds.cell_grid import (
    cell_grid,
    count_partners,
    gaussian_differences,
    gaussian_rows,
)
from eigenshape.operators.clouds.pair_loops import component_labels


def dense_kernel(points, weights, t, reach):
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    return np.where(
        squares <= reach**2, np.outer(weights, weights) * np.exp(-squares / (4 * t)), 0.0
    )


def sparse_kernel(points, weights, t, reach):
    grid = cell_grid(points, reach)
    starts = np.concatenate([[0], np.cumsum(count_partners(grid))])
    columns, values = gaussian_rows(grid, weights, t, starts)
    return sp.csr_array((values, columns, starts), shape=(len(points),) * 2)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(1, 60), st.floats(0.02, 3.0), st.integers(0, 2**31))
def test_the_kernel_is_that_of_all_pairs(dim, n, reach, seed):
    rng = np.random.default_rng(seed)
    points, weights = rng.normal(size=(n, dim)), rng.random(n) + 0.5
    expected = dense_kernel(points, weights, 0.1, reach)
    found = sparse_kernel(points, weights, 0.1, reach)
    np.testing.assert_allclose(found.toarray(), expected, rtol=1e-14)
    assert found.has_canonical_format  # columns ascend
    assert (found.toarray() == found.toarray().T).all()  # to the last digit
    fields = rng.normal(size=(n, 2))
    product = gaussian_differences(cell_grid(points, reach), weights, 0.1, fields)
    np.testing.assert_allclose(
        product, expected.sum(axis=1)[:, None] * fields - expected @ fields, atol=1e-12
    )


def test_equal_points_lie_in_one_cell():
    found = sparse_kernel(np.ones((3, 2)), np.ones(3), 1.0, 0.5)
    assert found.toarray().tolist() == [[1.0] * 3] * 3


def test_points_far_apart_need_no_room_for_the_cells_between():
    points = np.array([[0.0, 0, 0], [1e-9, 0, 0], [1, 1, 1], [1, 1, 1 - 1e-9]])
    assert count_partners(cell_grid(points, 1e-8)).tolist() == [2, 2, 2, 2]


def test_the_number_of_threads_changes_nothing():
    points = np.random.default_rng(1).random((3000, 3))
    results = []
    try:
        for n_threads in (1, 7):
            es.set_threads(n_threads)
            results.append(sparse_kernel(points, np.ones(3000), 0.01, 0.1))
    finally:
        es.set_threads(None)
    np.testing.assert_array_equal(results[0].data, results[1].data)
    np.testing.assert_array_equal(results[0].indices, results[1].indices)


def test_points_not_chosen_are_not_counted():
    points = np.zeros((5, 1))
    assert count_partners(cell_grid(points, 1.0), np.array([1, 3])).tolist() == [0, 5, 0, 5, 0]


def test_components_are_numbered_by_their_first_rows():
    graph = sp.csr_array(np.array([[0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]]))
    assert component_labels(graph.indptr, graph.indices).tolist() == [0, 1, 2, 0]


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_powers_of_two_change_no_digit(scale):
    points = np.random.default_rng(2).random((50, 3))
    one, other = (
        count_partners(cell_grid(points, 0.3)),
        count_partners(cell_grid(points * scale, 0.3 * scale)),
    )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("n", [1, 2, 5, 40, 1500])
def test_columns_ascend_where_cells_hold_many_points(n):
    points = np.random.default_rng(n).random((n, 3))
    found, expected = (make(points, np.ones(n), 1.0, 0.7) for make in (sparse_kernel, dense_kernel))
    rows, columns = np.nonzero(expected)
    np.testing.assert_array_equal(found.indices, columns)
    np.testing.assert_array_equal(np.diff(found.indptr), np.bincount(rows))
