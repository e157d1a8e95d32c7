"""Closed pieces inside others: solids face out, cavities face in."""

import numpy as np
import pytest
from broken_meshes import everted, moebius

from eigenshape.geometry.distances.closest import signed_distance, winding_numbers
from eigenshape.geometry.distances.nesting import find_pieces
from eigenshape.geometry.face_turns import face_turns
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.orient import orient
from eigenshape.geometry.repairs.repair import repair, suggest_repairs
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid, icosphere, torus

BALL = icosphere(1)
CUBE = boundary_surface(box(2, 2, 2))  # with a vertex in the middle of each side
OCTAHEDRON = icosphere(0)


def ball(radius, x=0.0):
    return TriangleMesh(radius * BALL.vertices + [x, 0, 0], BALL.faces)


def cube(low, high):
    return TriangleMesh(low + (high - low) * CUBE.vertices, CUBE.faces)


def depths(*parts):
    mesh = disjoint_union(*parts)
    return find_pieces(mesh, face_turns(mesh)).depths.tolist()


def test_depths_count_what_lies_around():
    nested = [ball(3), ball(0.3, 10), ball(1), ball(2), ball(0.2, 2.5), ball(0.5)]
    assert depths(*nested) == [0, 0, 2, 1, 1, 3]
    assert depths(*nested[::-1]) == [3, 1, 1, 2, 0, 0]
    assert depths(*(everted(part) for part in nested)) == [0, 0, 2, 1, 1, 3]
    # In the hole of a ring, which the box around it holds
    assert depths(torus(), ball(0.01)) == [0, 0]


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_rays_through_corners_and_along_sides_count_right(turn):
    # Above and below the middle of each face of the small cube lie edges and corners of the large.
    rotation = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    parts = [cube(0.0, 1.0), cube(0.25, 0.75), cube(0.375, 0.625), cube(0.75, 0.875)]
    parts = [TriangleMesh(part.vertices @ rotation.T, part.faces) for part in parts]
    assert depths(*parts) == [0, 1, 2, 1]


def test_pieces_turn_by_their_depth():
    parts = [ball(3), ball(1, 1.5), ball(1, -1.5), ball(0.5, 1.5), ball(2, 9)]
    volumes = [enclosed_volume(part) for part in parts]
    solid = volumes[0] - volumes[1] - volumes[2] + volumes[3] + volumes[4]
    rng = np.random.default_rng(0)
    for _ in range(4):
        mesh = disjoint_union(*(everted(part) if rng.random() < 0.5 else part for part in parts))
        done = orient(mesh).mesh
        assert enclosed_volume(done) == pytest.approx(solid)
        assert suggest_repairs(done) == ()
        # Each point is wound around once or never.
        points = rng.uniform(-3.5, 3.5, (200, 3))
        turns = winding_numbers(done, points)
        assert {*np.round(turns, 9)} <= {0.0, 1.0}


def test_pieces_that_touch_from_inside_are_inside():
    octahedron = TriangleMesh(np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
                              / 2 + 0.5, [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5],
                                          [3, 1, 5], [0, 3, 5]])  # fmt: skip
    assert depths(CUBE, octahedron) == [0, 1]
    standing = TriangleMesh(0.5 * CUBE.vertices + [0.25, 0.25, 0], CUBE.faces)
    for mesh in (standing, TriangleMesh(standing.vertices - [0, 0, 1e-17], standing.faces)):
        assert depths(CUBE, mesh) == [0, 1]
    welded = repair(disjoint_union(CUBE, octahedron), ["weld"]).mesh
    assert welded.n_vertices == CUBE.n_vertices
    assert orient(welded).report == ("orient turned 8 faces over",)
    # Copies at one place, and boxes side by side, lie beside each other.
    assert depths(CUBE, CUBE) == [0, 0]
    assert depths(CUBE, TriangleMesh(CUBE.vertices + np.array([1.0, 0, 0]), CUBE.faces)) == [0, 0]


def test_pieces_that_share_an_edge_are_closed():
    beside = TriangleMesh(CUBE.vertices + np.array([1.0, 1, 0]), CUBE.faces)
    welded = repair(disjoint_union(CUBE, everted(beside)), ["weld"]).mesh
    assert welded.n_vertices == 2 * CUBE.n_vertices - 3
    assert orient(welded).report == ("orient turned 48 faces over",)
    fin = TriangleMesh(
        [*CUBE.vertices, [3, 3, 3]], [*CUBE.faces[:, ::-1], [*CUBE.faces[0][:2], 26]]
    )
    assert orient(fin).report == ("orient turned 48 faces over",)


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1e150])
def test_neither_unit_nor_place_matters(scale):
    parts = [ball(3), ball(2), ball(1e-9), ball(1e-9, 50), ball(1e-6, 2.5)]
    assert depths(*(TriangleMesh(scale * part.vertices, part.faces) for part in parts)) == [
        0,
        1,
        2,
        0,
        1,
    ]
    moved = [
        TriangleMesh(part.vertices + np.array([5e5, 4e6, 100]), part.faces) for part in parts[:2]
    ]
    assert depths(*moved) == [0, 1]


def test_open_and_one_sided_pieces_are_left_and_hold_nothing():
    sheet, strip = grid(2, 2), moebius()
    parts = [ball(3), TriangleMesh(sheet.vertices - 0.5, sheet.faces), strip, ball(0.05, 1.0)]
    mesh = disjoint_union(*parts)
    done = orient(mesh)
    turned = (done.mesh.faces != mesh.faces).any(axis=1)
    assert np.flatnonzero(turned).tolist() == list(range(mesh.n_faces - BALL.n_faces, mesh.n_faces))
    assert done.report[0].startswith("orient turned 80 faces over, left 1 piece with one side only")
    opened = TriangleMesh(BALL.vertices, BALL.faces[1:])
    assert depths(opened, ball(0.5)) == [0, 0]


@pytest.mark.long
def test_thousands_of_pieces_are_quick():
    rng = np.random.default_rng(1)
    places = rng.uniform(-0.5, 0.5, (3000, 3))
    # In cells of a grid, so that no two of them meet
    cells = np.unique(np.round(places * 40), axis=0) / 40
    specks = [TriangleMesh(0.01 * OCTAHEDRON.vertices + place, OCTAHEDRON.faces) for place in cells]
    found = depths(icosphere(4), *specks)
    assert found == [0] + [1] * len(cells)


def test_overlapping_pieces_are_a_union_for_signed_distances():
    nested = disjoint_union(ball(2), ball(1))
    assert signed_distance(nested, [[0.0, 0, 0]])[0] < 0
    assert signed_distance(orient(nested).mesh, [[0.0, 0, 0]])[0] > 0
