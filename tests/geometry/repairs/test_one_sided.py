"""Pieces with one side only are cut open, and nothing else."""

import numpy as np
import pytest
from broken_meshes import moebius

from eigenshape.geometry.face_turns import face_turns, inconsistent_edges
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.repairs.one_sided import cut_edges, cut_one_sided
from eigenshape.geometry.topology import (
    boundary_loops,
    disjoint_union,
    edge_table,
    euler_characteristic,
    is_manifold,
    vertex_components,
)
from eigenshape.shapes.surfaces import grid, icosphere


def test_a_strip_is_cut_across_and_has_two_sides():
    strip = moebius(24, 6)
    done = cut_one_sided(strip)
    assert done.report == (
        "cut_one_sided cut 1 piece with one side only along 6 edges, and added 7 vertices",
    )
    assert not len(inconsistent_edges(done.mesh))
    assert face_turns(done.mesh).orientable.all()
    assert is_manifold(done.mesh)
    assert (euler_characteristic(done.mesh), len(boundary_loops(done.mesh))) == (1, 1)  # a disc
    assert surface_area(done.mesh) == pytest.approx(surface_area(strip))
    assert np.array_equal(done.mesh.vertices, strip.vertices[done.source_vertices])


def test_other_pieces_stay():
    ball = icosphere(1)
    done = cut_one_sided(disjoint_union(ball, moebius()))
    assert np.array_equal(done.mesh.faces[: ball.n_faces], ball.faces)
    assert np.array_equal(cut_one_sided(ball).mesh.faces, ball.faces)


def test_a_mesh_is_cut_along_edges_that_part_it():
    sheet = grid(4, 2)
    table = edge_table(sheet)
    x = sheet.vertices[table.edges, 0]
    done = cut_edges(sheet, (x == 0.5).all(axis=1))
    assert done.mesh.n_vertices == sheet.n_vertices + 3
    assert vertex_components(done.mesh)[0] == 2


def test_one_edge_inside_parts_nothing():
    sheet = grid(4, 4)
    cut = np.zeros(len(edge_table(sheet).edges), dtype=bool)
    cut[np.flatnonzero(edge_table(sheet).n_faces == 2)[10]] = True
    assert cut_edges(sheet, cut).mesh.n_vertices == sheet.n_vertices
