import pickle

import numpy as np
import pytest

from eigenshape.geometry.facet_lists import list_facets
from eigenshape.geometry.facets import (
    boundary_facets,
    boundary_surface,
    facet_components,
    facet_table,
    without_pinches,
)
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_vertices, disjoint_union, edge_table
from eigenshape.shapes.domains import ball, box, interval
from eigenshape.shapes.surfaces import grid, icosphere

BOWTIE = TriangleMesh(
    [[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [4, 3, 0]]
)


def test_two_triangles_by_hand():
    table = facet_table(
        TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [3, 0, 2]])
    )
    assert table.facets.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert table.simplex_facets.tolist() == [[3, 1, 0], [1, 4, 2]]
    assert table.n_simplices.tolist() == [1, 2, 1, 1, 1]
    assert table.boundary.tolist() == [0, 2, 3, 4]


def test_on_triangles_it_is_the_edge_table():
    mesh = icosphere(1)
    table, edges = facet_table(mesh), edge_table(mesh)
    np.testing.assert_array_equal(table.facets, edges.edges)
    np.testing.assert_array_equal(table.simplex_facets, edges.face_edges)
    np.testing.assert_array_equal(table.n_simplices, edges.n_faces)
    assert not table.boundary.size


@pytest.mark.parametrize("mesh", [interval(4), grid(3, 2), box(2, 2, 2)])
def test_a_facet_lies_opposite_to_its_corner(mesh):
    table = facet_table(mesh)
    for simplex, facets in zip(mesh.simplices, table.simplex_facets, strict=True):
        for corner, facet in zip(simplex, facets, strict=True):
            assert {corner, *table.facets[facet]} == set(simplex)
    np.testing.assert_array_equal(table.facets[table.boundary], boundary_facets(mesh))


@pytest.mark.parametrize("mesh", [interval(4), grid(3, 2), box(2, 2, 2)])
def test_facets_of_huge_meshes_are_sorted_as_rows(mesh, monkeypatch):
    packed = facet_table(mesh)
    monkeypatch.setattr("eigenshape.geometry.facet_lists.PACKED_BELOW", 0)
    rows = list_facets(mesh.simplices, mesh.n_points)
    np.testing.assert_array_equal(rows.facets, packed.facets)
    np.testing.assert_array_equal(rows.simplex_facets, packed.simplex_facets)
    np.testing.assert_array_equal(rows.n_simplices, packed.n_simplices)


def test_three_triangles_may_share_a_facet():
    book = TriangleMesh(
        [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    )
    table = facet_table(book)
    assert table.n_simplices.tolist() == [3, 1, 1, 1, 1, 1, 1]
    assert facet_components(table)[0] == 1
    np.testing.assert_array_equal(without_pinches(book).simplices, book.faces)


def test_what_touches_in_a_point_is_apart():
    assert facet_components(facet_table(BOWTIE)) == (2, pytest.approx([0, 1]))
    opened = without_pinches(BOWTIE)
    assert opened.simplices.tolist() == [[0, 2, 3], [5, 4, 1]]
    np.testing.assert_array_equal(opened.points[opened.simplices], BOWTIE.vertices[BOWTIE.faces])


def test_what_touches_in_an_edge_of_tetrahedra_is_apart():
    points = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    mesh = SimplicialMesh(points, [[0, 1, 2, 3], [0, 1, 4, 5]])
    assert facet_components(facet_table(mesh))[0] == 2
    assert without_pinches(mesh).n_points == 8


@pytest.mark.parametrize(
    "mesh", [interval(4), icosphere(1), ball(4), disjoint_union(grid(2, 2), icosphere(0))]
)
def test_sound_meshes_keep_their_points(mesh):
    opened = without_pinches(mesh)
    np.testing.assert_array_equal(opened.points, mesh.points)
    np.testing.assert_array_equal(opened.simplices, mesh.simplices)


def test_two_parts_are_numbered():
    count, labels = facet_components(facet_table(disjoint_union(grid(1, 1), grid(1, 1))))
    assert count == 2
    assert labels.tolist() == [0, 0, 1, 1]


def test_vertices_of_the_boundary_are_its_points_in_order():
    solid = ball(3)
    surface, points = boundary_surface(solid), boundary_vertices(solid)
    np.testing.assert_array_equal(surface.vertices, solid.points[points])


@pytest.mark.parametrize("mesh", [icosphere(1), box(1, 1, 1)])
def test_facets_are_listed_once_for_each_mesh_and_are_read_only(mesh):
    table = facet_table(mesh)
    assert facet_table(mesh) is table
    with pytest.raises(ValueError, match="read-only"):
        table.n_simplices[0] = 7
    copy = pickle.loads(pickle.dumps(mesh))
    assert "facets" not in vars(copy)  # which would make the pickle larger
    np.testing.assert_array_equal(facet_table(copy).facets, table.facets)
