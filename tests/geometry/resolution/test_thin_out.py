"""Surfaces with fewer vertices: what stays, and what must not."""

import numpy as np
import pytest

from eigenshape.geometry.measure import edge_lengths, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.resolution.thinning import thin_out
from eigenshape.geometry.simplices import degenerate_simplices
from eigenshape.geometry.topology import (
    boundary_loops,
    boundary_vertices,
    disjoint_union,
    euler_characteristic,
    is_closed,
    is_manifold,
    repeated_simplices,
    vertex_components,
)
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere, torus

CASES = {
    "sphere": (lambda: icosphere(4), 400),
    "torus": (torus, 200),
    "creature": (lambda: make_creature("giraffe", n_vertices=3000), 900),
    "two": (lambda: disjoint_union(icosphere(4), icosphere(2)), 500),
    "flat": (lambda: subdivide(subdivide(grid(12, 12))), 300),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_vertices_stay_in_place_and_topology_stays(name):
    make, wanted = CASES[name]
    mesh = make()
    thin, source = thin_out(mesh, wanted)
    assert wanted / 2 < thin.n_vertices <= wanted
    np.testing.assert_array_equal(thin.vertices, mesh.vertices[source])
    assert is_manifold(thin)
    assert is_closed(thin) == is_closed(mesh)
    assert euler_characteristic(thin) == euler_characteristic(mesh)
    assert vertex_components(thin)[0] == vertex_components(mesh)[0]
    assert len(boundary_loops(thin)) == len(boundary_loops(mesh))
    assert not len(degenerate_simplices(thin))
    assert not len(repeated_simplices(thin))
    assert surface_area(thin) == pytest.approx(surface_area(mesh), rel=0.08)


def test_the_spacing_is_nearly_even():
    thin, _ = thin_out(icosphere(5), 1000)
    lengths = edge_lengths(thin)
    assert lengths.max() < 5 * lengths.min()


def test_a_boundary_moves_only_along_itself():
    sheet = subdivide(grid(20, 20))
    thin, source = thin_out(sheet, 200)
    rim = np.zeros(sheet.n_vertices, dtype=bool)
    rim[boundary_vertices(sheet)] = True
    thin_rim = np.zeros(thin.n_vertices, dtype=bool)
    thin_rim[boundary_vertices(thin)] = True
    np.testing.assert_array_equal(rim[source], thin_rim)


def test_vertices_at_an_edge_with_three_faces_stay():
    pages = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]]
    book = subdivide(TriangleMesh(pages, [[0, 1, 2], [0, 1, 3], [0, 1, 4]]))
    while book.n_vertices < 800:
        book = subdivide(book)
    _, source = thin_out(book, 200)
    spine = np.flatnonzero((book.vertices[:, :2] == 0).all(axis=1))
    assert np.isin(spine, source).all()


def test_noise_larger_than_the_edges_does_not_stop_it():
    ball = icosphere(5)
    noise = 2 * edge_lengths(ball).mean() * np.random.default_rng(0).standard_normal((10242, 3))
    noisy = TriangleMesh(ball.vertices + noise, ball.faces)
    thin, _ = thin_out(noisy, 1000)
    assert thin.n_vertices <= 1000
    assert is_closed(thin)


def test_what_has_few_enough_vertices_stays_as_it_is():
    mesh = icosphere(2)
    thin, source = thin_out(mesh, 162)
    np.testing.assert_array_equal(thin.faces, mesh.faces)
    np.testing.assert_array_equal(source, np.arange(162))
    smallest, _ = thin_out(mesh, 1)  # topology needs more than one vertex
    assert is_closed(smallest)
    assert euler_characteristic(smallest) == 2


@pytest.mark.parametrize("size", [2.0**-300, 2.0**300])
def test_the_unit_does_not_matter(size):
    mesh = icosphere(3)
    _, source = thin_out(mesh, 200)
    np.testing.assert_array_equal(
        thin_out(TriangleMesh(size * mesh.vertices, mesh.faces), 200)[1], source
    )
