"""Fewer faces, the same topology, and what lay on the surface."""

import sys

import numpy as np
import pytest
from broken_meshes import moebius

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError, MissingExtraError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import suggest_repairs
from eigenshape.geometry.resolution.decimation import decimate
from eigenshape.geometry.topology import (
    boundary_loops,
    disjoint_union,
    euler_characteristic,
    vertex_components,
)
from eigenshape.shapes.surfaces import grid, icosphere, torus

BALL = icosphere(3)


def topology(mesh):
    return vertex_components(mesh)[0], euler_characteristic(mesh), len(boundary_loops(mesh))


@pytest.mark.parametrize(
    "mesh",
    [BALL, torus(30, 20), grid(16, 16), disjoint_union(BALL, grid(9, 9))],
    ids=["ball", "torus", "sheet", "ball and sheet"],
)
def test_topology_stays_and_twice_gives_the_same(mesh):
    done = decimate(mesh, ratio=0.25)
    assert topology(done.mesh) == topology(mesh)
    assert done.mesh.n_faces in (round(mesh.n_faces / 4), round(mesh.n_faces / 4) - 1)
    assert surface_area(done.mesh) == pytest.approx(surface_area(mesh), rel=0.05)
    assert not set(suggest_repairs(done.mesh)) & {
        "drop_degenerate",
        "drop_duplicate_faces",
        "orient",
    }
    assert np.array_equal(decimate(mesh, ratio=0.25).mesh.vertices, done.mesh.vertices)


@pytest.mark.parametrize("unit", [2.0**-30, 2.0**20])
def test_the_unit_does_not_matter(unit):
    done = decimate(TriangleMesh(unit * BALL.vertices, BALL.faces), 200)
    assert np.array_equal(done.mesh.faces, decimate(BALL, 200).mesh.faces)


def test_values_and_labels_are_carried():
    done = decimate(BALL, 320)
    positions = done.carry_values(BALL.vertices)
    distances = np.linalg.norm(positions - done.mesh.vertices, axis=1)
    assert distances.max() < 0.03, "linear functions lie within the distance of the two surfaces"
    assert done.carry_values(np.ones(BALL.n_vertices)) == pytest.approx(1)
    upper = BALL.vertices[BALL.faces].mean(axis=1)[:, 2] > 0
    middles = done.mesh.vertices[done.mesh.faces].mean(axis=1)[:, 2]
    clear = np.abs(middles) > 0.1
    assert np.array_equal(done.carry_labels(upper)[clear], middles[clear] > 0)
    with pytest.raises(
        InvalidShapeError, match="a row for each of the 642 vertices of the original"
    ):
        done.carry_values(np.ones(3))
    with pytest.raises(InvalidShapeError, match="a row for each of the 1280 faces of the original"):
        done.carry_labels(np.ones(3))


def test_edges_with_three_faces_are_cut_and_counted():
    sheets = grid(8, 8)
    wall = sheets.vertices[:, [0, 2, 1]] + np.array([0.0, 0.5, 0.0])
    faces = np.concatenate([sheets.faces, sheets.faces + sheets.n_vertices])
    points = np.concatenate([sheets.vertices, wall])
    # The foot of the wall stands on the middle of the floor.
    names = np.unique(points.round(9), axis=0, return_inverse=True)[1].ravel()
    first = np.array([np.argmax(names == name) for name in names])
    used, joined = np.unique(first[faces], return_inverse=True)
    done = decimate(TriangleMesh(points[used], joined.reshape(-1, 3)), 60)
    assert done.report[0].startswith("decimate cut 8 edges with more than two faces")
    assert done.mesh.n_faces in (59, 60)
    assert surface_area(done.mesh) == pytest.approx(2, rel=0.02)


def test_what_cannot_become_fewer_is_said():
    done = decimate(disjoint_union(icosphere(0), icosphere(0), icosphere(0)), 4)
    assert done.mesh.n_faces == 12  # three tetrahedra
    assert done.report[-1] == "fewer faces, such as 4, would change the topology"


def test_bad_requests_are_refused(monkeypatch):
    with pytest.raises(
        InvalidParameterError, match="Exactly one of n_faces and ratio must be given"
    ):
        decimate(BALL)
    with pytest.raises(InvalidParameterError, match=r"n_faces must lie in 4\.\.1279; it is 1280"):
        decimate(BALL, 1280)
    with pytest.raises(InvalidParameterError, match=r"n_faces must lie in 4\.\.1279; it is 3"):
        decimate(BALL, 3)
    with pytest.raises(InvalidParameterError, match="ratio must lie between 0 and 1; it is 1"):
        decimate(BALL, ratio=1)
    with pytest.raises(InvalidShapeError, match="more than 4 faces to be decimated; it has 2"):
        decimate(grid(1, 1), 4)
    with pytest.raises(InvalidShapeError, match="cut_one_sided"):
        decimate(moebius(), 20)
    monkeypatch.setitem(sys.modules, "igl", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'eigenshape\[decimate\]'"):
        decimate(BALL, 20)
