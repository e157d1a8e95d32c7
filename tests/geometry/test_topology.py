from collections import Counter

import numpy as np
import pytest

from eigenshape._corners import half_edges
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import (
    boundary_edges,
    boundary_loops,
    disjoint_union,
    edge_table,
    euler_characteristic,
    is_closed,
    is_manifold,
    non_manifold_edges,
    non_manifold_vertices,
    submesh,
    unreferenced_vertices,
    vertex_components,
)
from eigenshape.shapes.surfaces import grid, icosphere, torus


def mesh_of(*faces):
    """Faces alone: the points lie on a parabola, no two in one place."""
    x = np.arange(np.max(faces) + 1.0)
    return TriangleMesh(np.column_stack([x, x**2, 0 * x]), np.array(faces))


SQUARE = mesh_of((0, 1, 2), (2, 1, 3))
BOW_TIE = mesh_of((3, 4, 2), (0, 1, 2))
FINS = mesh_of((0, 1, 2), (1, 0, 3), (0, 1, 4))


def sides_of(loops):
    """The directed sides of chains; one more for each chain that closes."""
    return [
        pair
        for loop in loops
        for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    ]


def test_edges_of_a_square():
    table = edge_table(SQUARE)
    assert table.edges.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    assert table.n_faces.tolist() == [1, 1, 2, 1, 1]
    assert table.face_edges.tolist() == [
        [2, 1, 0],
        [3, 4, 2],
    ]  # opposite to the corners 0, 1, 2 of each


def test_half_edges_run_with_their_faces():
    assert half_edges(mesh_of((0, 1, 2)).faces).tolist() == [[1, 2], [2, 0], [0, 1]]


def test_a_square_has_one_boundary_loop():
    assert sorted(map(tuple, boundary_edges(SQUARE).tolist())) == [(0, 1), (1, 3), (2, 0), (3, 2)]
    assert [loop.tolist() for loop in boundary_loops(SQUARE)] == [[0, 1, 3, 2]]


def test_a_closed_mesh_has_no_boundary():
    assert boundary_loops(icosphere(1)) == []
    assert boundary_edges(icosphere(1)).shape == (0, 2)


def test_loops_are_sorted_by_length_then_by_vertex():
    union = disjoint_union(mesh_of((0, 1, 2)), SQUARE, mesh_of((0, 1, 2)))
    assert [loop.tolist() for loop in boundary_loops(union)] == [[3, 4, 6, 5], [0, 1, 2], [7, 8, 9]]


@pytest.mark.parametrize(
    "faces", [[(3, 4, 2), (0, 1, 2)], [(0, 1, 2), (3, 4, 2)], [(2, 3, 4), (1, 2, 0)]]
)
def test_loops_that_touch_in_a_vertex_stay_apart(faces):
    assert sorted(sorted(loop.tolist()) for loop in boundary_loops(mesh_of(*faces))) == [
        [0, 1, 2],
        [2, 3, 4],
    ]


def test_a_ring_of_bow_ties_comes_apart_into_simple_loops():
    mesh = mesh_of((2, 3, 4), (0, 1, 2), (4, 5, 6), (6, 7, 0), (2, 8, 9))
    loops = boundary_loops(mesh)
    chained = sorted(sides_of(loops))
    assert chained == sorted(map(tuple, half_edges(mesh.faces).tolist()))
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)


@pytest.mark.parametrize("seed", range(8))
def test_loops_end_and_use_each_side_once_however_faces_are_turned(seed):
    rng = np.random.default_rng(seed)
    mesh = grid(4, 3)
    faces = mesh.faces[rng.random(mesh.n_faces) < 0.7]
    turned = rng.random(len(faces)) < 0.4
    mixed = TriangleMesh(mesh.vertices, np.where(turned[:, None], faces[:, ::-1], faces))
    given = sorted(map(tuple, boundary_edges(mixed).tolist()))
    loops = boundary_loops(mixed)
    # A chain that stays open has no side from its end to its beginning.
    within = [
        pair for loop in loops for pair in zip(loop[:-1].tolist(), loop[1:].tolist(), strict=True)
    ]
    closing = [(int(loop[-1]), int(loop[0])) for loop in loops]
    for pair in within:
        given.remove(pair)
    assert set(given) <= set(closing)
    assert len(given) == len(set(given))


def test_two_faces_turned_against_each_other():
    flipped = mesh_of((0, 1, 2), (1, 2, 3))
    assert inconsistent_edges(flipped).tolist() == [[1, 2]]
    assert inconsistent_edges(SQUARE).shape == (0, 2)
    within = [pair for loop in boundary_loops(flipped) for pair in sides_of([loop])[:-1]]
    assert sorted(within) == [(0, 1), (2, 0), (2, 3), (3, 1)]


def test_three_faces_at_an_edge_are_no_manifold():
    assert non_manifold_edges(FINS).tolist() == [[0, 1]]
    assert non_manifold_vertices(FINS).size == 0
    assert not is_manifold(FINS)
    assert not is_closed(FINS)


def test_two_fans_at_a_vertex_are_no_manifold():
    assert non_manifold_vertices(BOW_TIE).tolist() == [2]
    assert non_manifold_edges(BOW_TIE).shape == (0, 2)
    assert not is_manifold(BOW_TIE)


def test_closed_surfaces_that_touch_in_a_vertex_are_no_manifold():
    one = icosphere(0)
    faces = np.concatenate([one.faces, np.where(one.faces == 0, 0, one.faces + 11)])
    touching = TriangleMesh(np.concatenate([one.vertices, one.vertices[1:] + 3]), faces)
    assert is_closed(touching)
    assert non_manifold_vertices(touching).tolist() == [0]
    assert vertex_components(touching)[0] == 1


@pytest.mark.parametrize(
    ("mesh", "euler", "closed"),
    [
        (icosphere(0), 2, True),
        (icosphere(2), 2, True),
        (torus(6, 5), 0, True),
        (grid(4, 3), 1, False),
    ],
)
def test_euler_characteristic(mesh, euler, closed):
    assert euler_characteristic(mesh) == euler
    assert is_closed(mesh) == closed
    assert is_manifold(mesh)
    assert euler_characteristic(disjoint_union(mesh, mesh)) == 2 * euler


def test_loose_vertices_are_components_and_do_not_count_for_euler():
    loose = TriangleMesh(np.arange(15.0).reshape(5, 3), [[1, 2, 4]])
    assert unreferenced_vertices(loose).tolist() == [0, 3]
    count, labels = vertex_components(loose)
    assert count == 3
    assert labels[1] == labels[2] == labels[4]
    assert len({labels[0], labels[1], labels[3]}) == 3
    assert euler_characteristic(loose) == 1


def test_submesh_keeps_coordinates_and_tells_where_vertices_were():
    part, old = submesh(SQUARE, np.array([False, True]))
    assert old.tolist() == [1, 2, 3]
    assert part.faces.tolist() == [[1, 0, 2]]
    np.testing.assert_array_equal(part.vertices, SQUARE.vertices[old])


def has_several_fans(faces, vertex):
    """Grow one fan over shared neighbors, and see whether a face is left."""
    rims = [set(face) - {vertex} for face in faces if vertex in face]
    reached = rims[0] if rims else set()
    for _ in rims:
        reached = reached.union(*(rim for rim in rims if rim & reached))
    return any(not rim & reached for rim in rims)


@pytest.mark.parametrize("seed", range(40))
def test_fans_and_loops_of_any_faces(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    mesh = TriangleMesh(
        rng.random((n, 3)), [rng.choice(n, 3, replace=False) for _ in range(rng.integers(1, 12))]
    )
    faces = mesh.faces.tolist()
    assert non_manifold_vertices(mesh).tolist() == [
        v for v in range(n) if has_several_fans(faces, v)
    ]
    counts = Counter(tuple(sorted(side)) for side in half_edges(mesh.faces).tolist())
    assert (
        dict(
            zip(map(tuple, edge_table(mesh).edges.tolist()), edge_table(mesh).n_faces, strict=True)
        )
        == counts
    )
    alone = [
        tuple(side) for side in half_edges(mesh.faces).tolist() if counts[tuple(sorted(side))] == 1
    ]
    loops = boundary_loops(mesh)
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)
    within = [pair for loop in loops for pair in sides_of([loop])[:-1]]
    assert len(set(within)) == len(within)
    assert set(within) <= set(alone) <= set(sides_of(loops))


@pytest.mark.parametrize("seed", range(8))
def test_faces_that_repeat_a_corner_stop_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = TriangleMesh(rng.random((5, 3)), rng.integers(0, 5, (9, 3)))
    assert edge_table(mesh).n_faces.sum() == 27
    assert sum(len(loop) for loop in boundary_loops(mesh)) <= 27 + len(boundary_loops(mesh))
    assert set(non_manifold_vertices(mesh)) <= set(mesh.faces.ravel())
