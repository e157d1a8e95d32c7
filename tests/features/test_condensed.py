"""Regions of like values, and means over them."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

import eigenshape as es
from eigenshape import InvalidParameterError, InvalidShapeError
from eigenshape.features import condense

BALL = es.icosphere(3)


def test_halves_of_two_values_are_two_regions():
    north = BALL.vertices[:, 2] > 0
    found = condense(BALL, np.column_stack([north, 3 - 2 * north]), tolerance=0)
    assert found.labels.max() == 1
    assert (found.labels == found.labels[0]).tolist() == (north == north[0]).tolist()
    areas = es.geometry.dual_volumes(BALL)
    np.testing.assert_allclose(found.values[found.labels], np.column_stack([north, 3 - 2 * north]))
    np.testing.assert_allclose(found.areas[found.labels[north]], areas[north].sum())
    middle = areas[north] @ BALL.vertices[north] / areas[north].sum()
    np.testing.assert_allclose(found.centers[found.labels[north][0]], middle, atol=1e-15)
    assert found.lost == pytest.approx(0, abs=1e-20)


def test_what_is_lost_is_what_the_means_leave():
    values = np.random.default_rng(0).random((BALL.n_vertices, 3)) + BALL.vertices
    areas = es.geometry.dual_volumes(BALL)
    spread = areas @ np.square(values - areas @ values / areas.sum()).sum(axis=1)
    counts = []
    for tolerance in (0.0, 0.1, 0.3, 1.0):
        found = condense(BALL, values, tolerance)
        left = areas @ np.square(values - found.values[found.labels]).sum(axis=1)
        assert found.lost == pytest.approx(left / spread, abs=1e-12)
        assert found.lost <= tolerance + 1e-20
        counts.append(len(found.areas))
    assert counts[0] == BALL.n_vertices
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 1


def test_regions_are_connected_and_pieces_stay_apart():
    two = es.geometry.disjoint_union(BALL, es.TriangleMesh(BALL.vertices + 5, BALL.faces))
    found = condense(two, two.vertices[:, 1], 0.1)
    edges = es.geometry.edge_table(two).edges
    inside = edges[found.labels[edges[:, 0]] == found.labels[edges[:, 1]]]
    links = sp.coo_array((np.ones(len(inside)), inside.T), shape=(two.n_vertices, two.n_vertices))
    assert connected_components(links, directed=False)[0] == len(found.areas)
    assert not set(found.labels[:642]) & set(found.labels[642:])
    assert len(condense(two, np.full(two.n_vertices, 0.1)).areas) == 2


def test_units_and_shifts_change_no_region():
    values = np.random.default_rng(1).random((BALL.n_vertices, 2)) + BALL.vertices[:, :2]
    one = condense(BALL, values)
    for other in (condense(BALL, 1e150 * values), condense(BALL, values + 3)):
        assert np.array_equal(one.labels, other.labels)


def test_bad_values_are_refused():
    with pytest.raises(InvalidParameterError, match=r"one row for each of 642 vertices; .* \(3,\)"):
        condense(BALL, [1.0, 2, 3])
    values = np.zeros(642)
    with pytest.raises(InvalidParameterError, match="tolerance must lie between 0 and 1; it is 2"):
        condense(BALL, values, 2)
    values[7] = np.nan
    with pytest.raises(InvalidParameterError, match="that of vertex 7 is nan"):
        condense(BALL, values)
    loose = es.TriangleMesh([*BALL.vertices, [9, 9, 9]], BALL.faces)
    with pytest.raises(InvalidShapeError, match="642"):
        condense(loose, np.zeros(643))


def test_a_table_has_a_row_for_each_region_and_a_name_for_each_column():
    found = condense(BALL, BALL.vertices[:, :2])
    table = found.table(["one", "two"])
    assert list(table) == ["region", "x", "y", "z", "area", "n_vertices", "one", "two"]
    np.testing.assert_array_equal(np.column_stack([table["one"], table["two"]]), found.values)
    assert table["n_vertices"].sum() == BALL.n_vertices
    with pytest.raises(
        InvalidParameterError, match=r"must hold one for each of 2 columns .*; it holds 1"
    ):
        found.table(["one"])
