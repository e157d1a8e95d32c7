"""Holes are closed by faces that fit: nothing else moves."""

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.holes import fill_holes
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.simplices import degenerate_simplices
from eigenshape.geometry.topology import (
    disjoint_union,
    euler_characteristic,
    is_closed,
    is_manifold,
    non_manifold_edges,
)
from eigenshape.io.mesh_files import read_mesh
from eigenshape.shapes.surfaces import grid, icosphere, torus


def without(mesh, keep):
    return TriangleMesh(mesh.vertices, mesh.faces[keep])


def capped(level, height, scale=1.0):
    """Cut caps off a sphere, above and below."""
    ball = icosphere(level)
    return without(
        TriangleMesh(scale * ball.vertices, ball.faces),
        np.abs(ball.vertices[ball.faces, 2]).max(1) < height,
    )


def require_closed(mesh):
    assert is_closed(mesh)
    assert is_manifold(TriangleMesh(*used(mesh)))
    assert inconsistent_edges(mesh).size == 0
    assert degenerate_simplices(mesh).size == 0


def used(mesh):
    vertices, faces = np.unique(mesh.faces, return_inverse=True)
    return mesh.vertices[vertices], faces.reshape(-1, 3)


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_caps_are_flat(scale):
    open_ = capped(4, 0.7, scale)
    done = fill_holes(open_)
    require_closed(done.mesh)
    added = done.mesh.n_faces - open_.n_faces
    assert done.report == (f"fill_holes closed 2 holes with {added} faces",)
    assert euler_characteristic(TriangleMesh(*used(done.mesh))) == 2
    np.testing.assert_array_equal(done.mesh.faces[: open_.n_faces], open_.faces)
    np.testing.assert_array_equal(done.mesh.vertices, open_.vertices)
    caps = surface_area(TriangleMesh(done.mesh.vertices / scale, done.mesh.faces[open_.n_faces :]))
    disc = np.pi * (1 - (open_.vertices[open_.faces, 2].max() / scale) ** 2)
    ball = icosphere(4)
    assert (
        2 * disc
        < caps
        < surface_area(ball) - surface_area(TriangleMesh(ball.vertices, open_.faces))
    )


def test_one_face_comes_back():
    ball = icosphere(1)
    done = fill_holes(without(ball, np.arange(80) != 17))
    assert set(done.mesh.faces[-1].tolist()) == set(ball.faces[17].tolist())
    require_closed(done.mesh)


def test_straight_rims_get_no_flat_faces():
    done = fill_holes(grid(5, 4))
    assert done.mesh.n_faces > grid(5, 4).n_faces
    assert degenerate_simplices(done.mesh).size == 0
    assert non_manifold_edges(done.mesh).size == 0


def test_holes_that_touch_at_a_vertex_are_closed_both():
    ball = icosphere(3)
    star = np.flatnonzero((ball.faces == 40).any(axis=1))
    keep = np.ones(ball.n_faces, dtype=bool)
    keep[[star[0], star[3]]] = False
    opposite = without(ball, keep)
    done = fill_holes(opposite)
    require_closed(done.mesh)
    assert done.mesh.n_faces == ball.n_faces


def test_what_is_left_is_told():
    both = disjoint_union(capped(3, 0.8), capped(1, 0.9))
    done = fill_holes(both, most_edges=12)
    assert "left 2 of more than 12 edges" in done.report[0]
    triangle = TriangleMesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    flat = fill_holes(
        TriangleMesh([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 3], [1, 2, 3]])
    )
    assert flat.report == (
        "fill_holes closed 0 holes with 0 faces, left 1 that good faces do not close",
    )
    assert fill_holes(triangle).mesh.n_faces == 1  # the second would be the same face, turned over
    assert fill_holes(torus(8, 6)).report == ("fill_holes closed 0 holes with 0 faces",)


def test_turned_faces_leave_open_chains_alone():
    ball = icosphere(1)
    faces = ball.faces[:60].copy()
    faces[::7] = faces[::7, ::-1]
    done = fill_holes(TriangleMesh(ball.vertices, faces))
    assert "that good faces do not close" in done.report[0]


def test_it_is_a_repair_by_name_and_refuses_nonsense():
    assert repair(capped(2, 0.9), ["fill_holes"]).report[0].startswith("fill_holes closed 2 holes")
    with pytest.raises(
        InvalidParameterError,
        match="most_edges must be at least 3, the edges of a triangle; it is 2",
    ):
        fill_holes(icosphere(1), most_edges=2)


@pytest.mark.data
def test_a_scanned_person_is_closed(data):
    person = read_mesh(data / "classics" / "human_neutral.obj")
    done = fill_holes(person)
    assert done.report == ("fill_holes closed 1 hole with 30 faces",)
    require_closed(done.mesh)
