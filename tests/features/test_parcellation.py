"""Parcels of a surface, and means of functions over them."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError
from eigenshape.features import Parcellation, parcellate

# Two triangles of areas 1/2 and 2: vertices weigh 1/6, 5/6, 5/6 and 2/3.
MESH = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2.5, 2.5, 0]], [[0, 1, 2], [1, 3, 2]])
HALVES = Parcellation([0, 0, 1, -1], ("one", "two", "none"))


def test_means_are_weighted_by_area():
    weights = es.geometry.dual_volumes(MESH)
    assert weights[1] > 2 * weights[0]
    found = parcellate(MESH, [1.0, 2.0, 5.0, np.nan], HALVES)
    assert found[0] == pytest.approx((weights[0] + 2 * weights[1]) / (weights[0] + weights[1]))
    assert found[1] == pytest.approx(5)
    assert np.isnan(found[2])
    table = parcellate(MESH, np.column_stack([[1.0, 2, 5, 0], [2.0, 4, 10, 0]]), HALVES)
    np.testing.assert_allclose(table, np.column_stack([found, 2 * found]))


def test_names_and_colors_have_defaults():
    many = Parcellation(np.arange(300))
    assert many.names[299] == "parcel 299"
    assert len(np.unique(np.rint(255 * many.colors), axis=0)) == 300
    nothing = Parcellation([-1, -1])
    assert nothing.names == ()
    assert nothing.colors.shape == (0, 4)
    assert (
        parcellate(
            es.TriangleMesh(MESH.vertices, MESH.faces), np.ones(4), Parcellation([-1] * 4)
        ).size
        == 0
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ([0, 2], ("a", "b")),
            "places in names or -1; that of vertex 1 is 2, and there are 2 names",
        ),
        (([-2],), "A label must lie in -1"),
        (([0], ("a",), np.ones((2, 4))), r"colors must be \(1, 4\) numbers in 0..1"),
        (([0], ("a",), [[0, 0, 0, 2]]), r"colors must be \(1, 4\) numbers in 0..1"),
    ],
)
def test_bad_parcellations_are_named(arguments, message):
    with pytest.raises(InvalidParameterError, match=message):
        Parcellation(*arguments)


def test_bad_maps_are_named():
    with pytest.raises(InvalidParameterError, match="finite in parcels; vertex 1 of 'one' has nan"):
        parcellate(MESH, [0, np.nan, 0, 0], HALVES)
    with pytest.raises(InvalidParameterError, match="values must hold one row per vertex, shape"):
        parcellate(MESH, np.ones(3), HALVES)
    with pytest.raises(
        InvalidParameterError, match="of 4 vertices; it has 1, so it belongs to another"
    ):
        parcellate(MESH, np.ones(4), Parcellation([0]))
