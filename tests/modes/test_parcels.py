import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

import eigenshape as es

MESH = es.make_creature("quadruped", n_vertices=900)
LAPLACIAN = es.cotangent_laplacian(MESH)


def n_pieces(labels, parcel):
    graph = es.operators.edge_graph(MESH)
    inside = np.flatnonzero(labels == parcel)
    return connected_components(sp.csr_array(graph)[inside][:, inside])[0]


def test_parcels_are_connected_and_sizes_add_up():
    found = es.modes.nodal_parcels(LAPLACIAN, 25)
    assert set(found.labels) == set(range(25))
    assert [n_pieces(found.labels, parcel) for parcel in range(25)] == 25 * [1]
    np.testing.assert_allclose(found.sizes, np.bincount(found.labels, LAPLACIAN.mass.diagonal()))
    assert (found.parents[1:] < np.arange(1, 25)).all()


def test_fewer_parcels_are_those_of_fewer_cuts():
    found, few = es.modes.nodal_parcels(LAPLACIAN, 25), es.modes.nodal_parcels(LAPLACIAN, 7)
    np.testing.assert_array_equal(found.cut(7), few.labels)
    np.testing.assert_array_equal(found.cut(25), found.labels)
    assert not found.cut(1).any()
    with pytest.raises(es.InvalidParameterError, match=r"n_parcels must lie in 1\.\.25; it is 26"):
        found.cut(26)


def test_a_strip_is_cut_across_and_then_into_quarters():
    strip = es.shapes.grid(40, 5)
    strip = es.TriangleMesh(strip.vertices * [8.0, 1.0, 1.0], strip.faces)
    found = es.modes.nodal_parcels(es.cotangent_laplacian(strip), 4)
    quarter = np.clip((strip.vertices[:, 0] / 2.0).astype(int), 0, 3)
    inside = (
        abs(strip.vertices[:, 0] % 2 - 1) < 0.85
    )  # lines between parcels may fall on either side
    for number in range(4):
        assert len(set(found.labels[inside & (quarter == number)])) == 1
    np.testing.assert_allclose(found.sizes, 2.0, rtol=0.15)


def test_every_point_can_be_a_parcel():
    small = es.cotangent_laplacian(es.icosphere(0))
    found = es.modes.nodal_parcels(small, 12)
    assert sorted(found.labels.tolist()) == list(range(12))
    with pytest.raises(es.InvalidParameterError, match=r"n_parcels must lie in 1\.\.12"):
        es.modes.nodal_parcels(small, 13)


def test_pieces_are_parcels_before_they_are_cut():
    ball = es.icosphere(1)
    vertices = np.concatenate([ball.vertices + 3 * i for i in range(3)])
    faces = np.concatenate([ball.faces + 42 * i for i in range(3)])
    found = es.modes.nodal_parcels(es.cotangent_laplacian((vertices, faces)), 3)
    np.testing.assert_array_equal(found.labels, np.repeat([0, 1, 2], 42))


def test_an_operator_that_is_corrected_is_refused():
    with pytest.raises(es.InvalidParameterError, match="matrices alone"):
        es.modes.nodal_parcels(es.mesh_laplacian(MESH, correct="log"), 3)
