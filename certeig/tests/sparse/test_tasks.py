"""Factors and orders are divided among threads; what each computes does not depend on their number."""

import itertools

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from known_spectra import adjacency, kronecker_sum, random_symmetric, surface

import certeig
from certeig.sparse.dissection import dissect
from certeig.sparse.elimination import analyze_pattern
from certeig.sparse.symmetric_factor import SymmetricFactor


@pytest.fixture(autouse=True)
def small_work(monkeypatch):
    monkeypatch.setattr("certeig.sparse.tasks.FEWEST_ENTRIES", 1)
    monkeypatch.setattr("certeig.sparse.dissection.WORTH_A_THREAD", 60)
    yield
    certeig.set_threads(None)


def with_diagonal(matrix):
    """Make a symmetric matrix diagonally dominant, with pivots of both signs."""
    signs = np.where(np.arange(matrix.shape[0]) % 3, 1.0, -1.0)
    sums = np.asarray(abs(matrix).sum(axis=0)).ravel() + 1
    found = sp.csc_array(matrix + sp.diags_array(signs * 2 * sums))
    found.sort_indices()
    return found


MATRICES = {
    "surface": with_diagonal(surface(4000)),
    "solid": with_diagonal(kronecker_sum(*[adjacency(10)] * 3)),
    "pieces": with_diagonal(sp.block_diag([sp.csc_array(np.ones((7, 7)))] * 200)),
    "clique": with_diagonal(sp.csc_array(np.ones((300, 300)))),
    "one point": sp.csc_array(np.array([[2.0]])),
}


@pytest.mark.parametrize("name", MATRICES)
def test_digits_are_those_of_one_thread(name):
    matrix, found = MATRICES[name], []
    right = np.random.default_rng(0).normal(size=(matrix.shape[0], 19))
    for n in (1, 2, 4):
        certeig.set_threads(n)
        elimination = analyze_pattern(matrix)
        factor = SymmetricFactor.of_entries(elimination, matrix.data)
        arrays = elimination.order, factor.panels, factor.pivots, factor.solve(right)
        found.append([array.tobytes() for array in arrays])
    assert found[0] == found[1] == found[2]
    np.testing.assert_allclose(matrix @ factor.solve(right), right, atol=1e-9)


@settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(1, 400), st.floats(0, 0.06), st.integers(0, 10**6))
def test_tasks_solve_what_they_share(n, density, seed):
    certeig.set_threads(2)
    matrix = with_diagonal(random_symmetric(n, density, seed))
    elimination = analyze_pattern(matrix)
    tasks = elimination.tasks
    assert sorted(itertools.chain(*(each.tolist() for each in tasks.rounds))) == list(
        range(tasks.n)
    )
    round_of = {task: at for at, each in enumerate(tasks.rounds) for task in each.tolist()}
    task_of = np.repeat(np.arange(tasks.n), np.diff(tasks.first))
    for front, parent in enumerate(elimination.above.tolist()):
        if parent >= 0 and task_of[parent] != task_of[front]:
            assert round_of[task_of[front]] < round_of[task_of[parent]]
    factor = SymmetricFactor.of_entries(elimination, matrix.data)
    assert np.count_nonzero(factor.pivots < 0) == np.count_nonzero(
        np.linalg.eigvalsh(matrix.toarray()) < 0
    )
    right = np.random.default_rng(seed).normal(size=(n, 3))
    np.testing.assert_allclose(matrix @ factor.solve(right), right, atol=1e-9)


def test_a_pivot_that_is_zero_is_found_in_any_task():
    matrix = MATRICES["surface"].copy()
    elimination = analyze_pattern(matrix)
    for place in (0, 2000, 3999):
        data, point = matrix.data.copy(), elimination.order[place]
        data[matrix.indptr[point] : matrix.indptr[point + 1]] = np.nan
        for n in (1, 2):
            certeig.set_threads(n)
            assert SymmetricFactor.of_entries(elimination, data) is None


def test_threads_order_a_graph_as_one_does():
    matrix = surface(6000).tocsc()
    graph = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64)
    orders = []
    for n in (1, 2, 5):
        certeig.set_threads(n)
        orders.append(dissect(*graph))
    assert sorted(orders[0].tolist()) == list(range(6000))
    np.testing.assert_array_equal(orders[0], orders[1])
    np.testing.assert_array_equal(orders[0], orders[2])
