import itertools

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from known_spectra import adjacency, kronecker_sum, laplacian, random_symmetric, surface

from certeig.sparse.dissection_loops import narrow_cut
from certeig.sparse.elimination import analyze_pattern
from certeig.sparse.front_loops import WIDE
from certeig.sparse.symmetric_factor import SymmetricFactor


def solved(matrix, width=3):
    factor = SymmetricFactor.of_entries(analyze_pattern(matrix), matrix.data)
    right = np.random.default_rng(0).normal(size=(matrix.shape[0], width))
    return factor, right, factor.solve(right)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 400), st.floats(0, 0.06), st.integers(0, 10**6))
def test_any_pattern_is_factored_counted_and_solved(n, density, seed):
    matrix = random_symmetric(n, density, seed)
    factor, right, found = solved(matrix)
    assert sorted(factor.elimination.order) == list(range(n))
    dense = matrix.toarray()
    growth = (
        np.abs(factor.pivots).max() / np.abs(dense).max()
        + np.abs(dense).max() / np.abs(factor.pivots).min()
    )
    if growth < 1e5:  # without pivoting, growth is bad luck
        assert np.count_nonzero(factor.pivots < 0) == np.count_nonzero(
            np.linalg.eigvalsh(dense) < 0
        )
        np.testing.assert_allclose(
            dense @ found, right, atol=1e-7 * np.abs(found).max() * np.abs(dense).max()
        )


def fronts_by_definition(matrix, elimination):
    """The rows of each front, from the dense pattern: its columns eliminated, what children left passed on."""
    e = elimination
    pattern = matrix.toarray()[np.ix_(e.order, e.order)] != 0
    rows = []
    for s, (low, high) in enumerate(itertools.pairwise(e.first)):
        below = set(np.flatnonzero(pattern[:, low:high].any(axis=1)))
        for child in np.flatnonzero(e.above == s):
            below |= set(rows[child])
        rows.append([*range(low, high), *sorted(row for row in below if row >= high)])
    return rows


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 150), st.floats(0, 0.2), st.integers(0, 10**6))
def test_fronts_have_the_rows_of_their_definition_and_the_room_for_them(n, density, seed):
    matrix = random_symmetric(n, density, seed)
    e = analyze_pattern(matrix)
    expected = fronts_by_definition(matrix, e)
    found = [e.rows[start:stop].tolist() for start, stop in itertools.pairwise(e.begins)]
    assert found == expected
    parents = [
        next((s for s in range(len(expected)) if rows[width] < e.first[s + 1]), -1)
        if width < len(rows)
        else -1
        for rows, width in zip(expected, np.diff(e.first), strict=True)
    ]
    assert e.above.tolist() == parents
    sizes = [
        sum((len(rows) - start) * min(WIDE, width - start) for start in range(0, width, WIDE))
        for rows, width in zip(expected, np.diff(e.first), strict=True)
    ]
    assert np.diff(e.places).tolist() == sizes


@pytest.mark.parametrize("matrix", [surface(5000), laplacian(kronecker_sum(*[adjacency(10)] * 3))])
def test_surfaces_and_solids_below_zero_and_among_their_eigenvalues(matrix):
    stiffness, n = sp.csc_array(matrix), matrix.shape[0]
    elimination = analyze_pattern(stiffness)
    for shift, negative in ((-0.1, 0), (0.1 * stiffness.diagonal().mean(), None)):
        matrix = sp.csc_array(stiffness - shift * sp.eye_array(n))
        factor = SymmetricFactor.of_entries(elimination, matrix.data)
        right = np.random.default_rng(1).normal(size=(n, 11))
        np.testing.assert_allclose(matrix @ factor.solve(right), right, atol=1e-8)
        count = np.count_nonzero(factor.pivots < 0)
        assert count == negative if negative is not None else 0 < count < n


def test_what_is_full_and_what_falls_apart():
    full = np.random.default_rng(0).normal(size=(300, 300))
    for matrix in (full @ full.T + 300 * np.eye(300), np.diag(np.arange(1.0, 400.0))):
        _, right, found = solved(sp.csc_array(matrix))
        np.testing.assert_allclose(matrix @ found, right, atol=1e-9)


@pytest.mark.parametrize("density", [0.4, 0.6, 0.95])
def test_what_is_nearly_full_is_factored_and_counted(density):
    rng = np.random.default_rng(1)
    half = np.where(rng.random((500, 500)) < density, rng.normal(size=(500, 500)), 0.0)
    dense = half + half.T + np.diag(np.where(np.arange(500) < 200, -200.0, 200.0))
    factor, right, found = solved(sp.csc_array(dense))
    assert sorted(factor.elimination.order) == list(range(500))
    assert np.count_nonzero(factor.pivots < 0) == np.count_nonzero(np.linalg.eigvalsh(dense) < 0)
    np.testing.assert_allclose(dense @ found, right, atol=1e-9)


def test_ten_thousand_components():
    triangle = sp.csc_array(np.full((3, 3), -1.0) + 3.5 * np.eye(3))
    ring = sp.csc_array(sp.block_diag([triangle] * 10_000))
    factor, right, found = solved(ring, 1)
    np.testing.assert_allclose(ring @ found, right, atol=1e-12)
    assert factor.elimination.n_entries < 5 * 30_000


def test_an_arrow_is_eliminated_from_its_feathers():
    n = 3000
    arrow = sp.lil_array((n, n))
    arrow[0, :] = arrow[:, 0] = -1.0
    arrow.setdiag(float(n))
    factor, _, _ = solved(sp.csc_array(arrow))
    assert factor.elimination.n_entries < 6 * n


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_a_pivot_that_is_none(bad):
    chain = sp.csc_array(
        sp.diags_array([-np.ones(9), np.full(10, 2.0), -np.ones(9)], offsets=[-1, 0, 1])
    )
    assert SymmetricFactor.of_entries(analyze_pattern(chain), chain.data) is not None
    alone = sp.csc_array(sp.eye_array(4))
    assert (
        SymmetricFactor.of_entries(analyze_pattern(alone), np.array([1.0, bad, 1.0, 1.0])) is None
    )


def test_nothing_depends_on_the_run():
    matrix = sp.csc_array(surface(2000) + 0.1 * sp.eye_array(2000))
    one, two = (SymmetricFactor.of_entries(analyze_pattern(matrix), matrix.data) for _ in range(2))
    np.testing.assert_array_equal(one.panels, two.panels)


def test_the_bound_of_rounding_is_that_of_the_factor_in_any_unit():
    """Above the diagonal, panels of a large front keep numbers of the matrix, which are not of L."""
    factor = np.random.default_rng(0).standard_normal((3 * WIDE, 3 * WIDE))
    matrix = factor @ factor.T + 8 * np.eye(3 * WIDE)
    elimination = analyze_pattern(sp.csc_array(matrix))
    ordered = matrix[np.ix_(elimination.order, elimination.order)]
    lower = np.linalg.cholesky(ordered)
    sizes = (np.abs(lower) @ np.abs(lower.T)).sum(axis=1)
    lengths = np.arange(1, 3 * WIDE + 1)
    for unit in (1.0, 2.0**40):
        found = SymmetricFactor.of_entries(elimination, sp.csc_array(unit * matrix).data).rounding()
        share = found[elimination.order] / (unit * np.finfo(np.float64).eps * sizes)
        assert (share <= lengths + 5).all()
        assert (share >= 4).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.floats(0.05, 1), st.integers(0, 10**6))
def test_a_cut_is_narrowed_to_the_fewest_points(n_cut, n_beside, density, seed):
    edges = np.random.default_rng(seed).random((n_cut, n_beside)) < density
    edges[0, 0] = True
    # The cut, the points beside it on one side, and many more, which are joined to these or the cut.
    sizes = n_cut, n_beside, 200, 200
    side = np.repeat(np.array([2, 0, 0, 1], dtype=np.int8), sizes)
    n, cut, beside = len(side), slice(n_cut), slice(n_cut, n_cut + n_beside)
    graph = np.zeros((n, n), dtype=bool)
    graph[cut, beside] = edges
    graph[beside, n_cut + n_beside : -200] = graph[cut, -200:] = True
    pattern = sp.csr_array(graph | graph.T)
    scratch = np.empty((4, n), dtype=np.int64)
    narrow_cut(
        pattern.indptr.astype(np.int64),
        pattern.indices.astype(np.int64),
        np.arange(n),
        np.ones(n, dtype=np.int64),
        1,
        *scratch,
        side,
    )
    assert not pattern[side == 0][:, side == 1].nnz
    # No smaller set of rows and columns meets all edges (brute force over the rows).
    rows = [np.array(each, dtype=bool) for each in itertools.product([0, 1], repeat=n_cut)]
    smallest = min(int(each.sum() + edges[~each].any(axis=0).sum()) for each in rows)
    assert np.count_nonzero(side == 2) == smallest
