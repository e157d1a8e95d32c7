"""Faces that cross are found, all of them, and none that merely touch."""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from each_creature import KINDS
from hypothesis import given, settings
from hypothesis import strategies as st

from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere, torus

TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
TETRAHEDRON_FACES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
CUBE_FACES = np.array(
    [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]
)  # fmt: skip


def cube(low=0.0, high=1.0):
    corners = [[x, y, z] for z in (low, high) for y in (low, high) for x in (low, high)]
    return TriangleMesh(corners, CUBE_FACES)


def pairs(vertices, faces):
    return self_intersections(TriangleMesh(vertices, faces)).tolist()


def half(corners, normal, level):
    """Cut a polygon to the side of a plane where normal · x >= level, exactly."""
    kept, heights = (
        [],
        [sum(n * x for n, x in zip(normal, corner, strict=True)) - level for corner in corners],
    )
    for k, (p, at_p) in enumerate(zip(corners, heights, strict=True)):
        q, at_q = corners[k - 1], heights[k - 1]
        if at_p * at_q < 0:
            kept.append([a + (b - a) * at_q / (at_q - at_p) for a, b in zip(q, p, strict=True)])
        if at_p >= 0:
            kept.append(p)
    return kept


def cross(u, v):
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def dot(u, v):
    return sum(a * b for a, b in zip(u, v, strict=True))


def reaches_inside(one, other):
    """Tell whether a point of triangle `one` lies inside `other`, by the mean of what is left of it there."""
    a, b, c = other
    normal = cross(minus(b, a), minus(c, a))
    if not any(normal):
        return False
    walls = [cross(normal, minus(q, p)) for p, q in ((a, b), (b, c), (c, a))]
    planes = [(normal, a), ([-x for x in normal], a), *zip(walls, other, strict=True)]
    left = list(one)
    for direction, point in planes:
        left = half(left, direction, dot(direction, point))
        if not left:
            return False
    mean = [sum(column) / len(left) for column in zip(*left, strict=True)]
    return all(dot(wall, minus(mean, point)) > 0 for wall, point in zip(walls, other, strict=True))


def minus(p, q):
    return [a - b for a, b in zip(p, q, strict=True)]


def brute_force(vertices, faces):
    exact = [[Fraction(float(x)) for x in vertex] for vertex in vertices]
    triangles = [[exact[corner] for corner in face] for face in faces]
    return [
        [i, j]
        for i, j in combinations(range(len(faces)), 2)
        if reaches_inside(triangles[i], triangles[j]) or reaches_inside(triangles[j], triangles[i])
    ]


def assert_as_by_fractions(vertices, faces):
    expected = brute_force(vertices, faces)
    assert pairs(vertices, faces) == expected
    return len(expected)


@pytest.mark.long
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(0, 3))
def test_lattice_triangles_are_told_as_by_fractions(seed, side, shift):
    """On so few places nearly every pair is degenerate: coplanar, in line, touching, without area, equal."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(-side, side + 1, (12, 3)) / 3.0 + shift / 7.0
    assert_as_by_fractions(vertices, rng.integers(0, 12, (14, 3)))


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_flat_lattice_triangles_are_told_as_by_fractions(seed):
    rng = np.random.default_rng(seed)
    places = rng.integers(-2, 3, (9, 2))
    slope = rng.integers(-1, 2, (2, 3))
    assert_as_by_fractions(places @ slope / 10, rng.integers(0, 9, (14, 3)))


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_random_triangles_are_told_as_by_fractions(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((15, 3)) * 10.0 ** rng.integers(-6, 1, (15, 1))
    assert_as_by_fractions(vertices, np.array([rng.permutation(15)[:3] for _ in range(14)]))


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_lattices_turned_and_rounded_are_told_as_by_fractions(seed):
    """What was coplanar is so up to the last digit, and the last digit decides."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    vertices = rng.integers(-1, 2, (12, 3)) @ turn + rng.standard_normal(3)
    assert_as_by_fractions(vertices, rng.integers(0, 12, (14, 3)))


@pytest.mark.long
@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_details_of_any_size_are_told_as_by_fractions(seed):
    """Around the origin, where floats are finest: 1e-70 of the largest coordinate, products of three of them 1e-210."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(-3, 4, (15, 3)) / 7 * 10.0 ** rng.choice([0, -70], (15, 1))
    assert_as_by_fractions(vertices, np.array([rng.permutation(15)[:3] for _ in range(14)]))


@pytest.mark.long
def test_lattices_and_rounded_lattices_do_cross_and_do_not():
    """What the laws above draw is worth drawing: many pairs of each kind."""
    rng, found = np.random.default_rng(0), 0
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    for _ in range(10):
        vertices, faces = rng.integers(-1, 2, (12, 3)), rng.integers(0, 12, (14, 3))
        found += assert_as_by_fractions(vertices, faces) + assert_as_by_fractions(
            vertices @ turn, faces
        )
    assert 100 < found < 20 * 91 - 100


def test_two_tetrahedra_in_one_cube():
    """Each corner of one goes through a face of the other, with its three faces; parallel faces do not meet."""
    vertices = np.concatenate([TETRAHEDRON, -TETRAHEDRON])
    faces = np.concatenate([TETRAHEDRON_FACES, TETRAHEDRON_FACES[:, ::-1] + 4])
    assert pairs(vertices, faces) == [[i, 4 + j] for i in range(4) for j in range(4) if i != j]


def test_a_spike_through_a_cube():
    """Three sides of the spike go through one face of the bottom and one of the top."""
    base, tip = [[0.7, 0.2, -1], [0.75, 0.2, -1], [0.7, 0.25, -1]], [0.7, 0.2, 4]
    spike = TriangleMesh([*base, tip], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert self_intersections(disjoint_union(cube(), spike)).tolist() == [
        [face, side] for face in (0, 2) for side in (13, 14, 15)
    ]


def test_boxes_that_touch_and_boxes_that_overlap():
    inside = cube(0.25, 0.75)
    assert not self_intersections(disjoint_union(cube(), inside)).size
    at_corner, at_side, beside = (
        TriangleMesh(cube().vertices + move, CUBE_FACES)
        for move in ([1, 1, 1], [1, 1, 0], [1, 0.5, 0])
    )
    assert not self_intersections(disjoint_union(cube(), at_corner)).size
    assert not self_intersections(disjoint_union(cube(), at_side)).size
    walls = self_intersections(disjoint_union(cube(), beside))
    assert walls.tolist() == brute_force(*arrays(disjoint_union(cube(), beside)))
    assert {(10, 20), (10, 21), (11, 20), (11, 21)} & {tuple(pair) for pair in walls.tolist()}


def arrays(mesh):
    return mesh.vertices, mesh.faces


@pytest.mark.long
@pytest.mark.parametrize("size", [6, 7, 10])  # widths that floats hold, and such that they do not
def test_a_grid_folded_flat(size):
    """Each square lies upon its mirror image, whose diagonal crosses its own: two faces cross two."""
    flat = grid(size, 4)
    x, y, z = flat.vertices.T
    half_way = size // 2 * 5
    x = x.copy()
    x[-half_way:] = x[:half_way].reshape(-1, 5)[::-1].ravel()
    found = pairs(np.column_stack([x, y, z]), flat.faces)
    n_squares = size // 2 * 4
    if size % 2 == 0:
        assert len(found) == 4 * n_squares
    assert found == brute_force(np.column_stack([x, y, z]), flat.faces)
    lifted = np.column_stack([x, y, np.arange(size + 1).repeat(5) / 100.0])
    assert not pairs(lifted, flat.faces)


def test_neighbors_at_an_edge():
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    faces = [[0, 1, 2], [0, 3, 1]]
    assert not pairs([*flat, [0.3, -0.3, 0]], faces)
    assert not pairs([*flat, [0.3, 0.3, 1e-80]], faces)
    assert pairs([*flat, [0.3, 0.3, 0]], faces) == [[0, 1]]
    assert pairs([*flat, [0.3, 0.3, 1e-100]], faces) == [[0, 1]]  # finer than coordinates are taken


def test_faces_at_one_vertex():
    a = [[0, 0, 0], [2, 1, 0], [2, -1, 0]]
    faces = [[0, 1, 2], [0, 3, 4]]
    assert pairs([*a, [1, 0, 1], [1, 0, -1]], faces) == [[0, 1]]  # the side across goes through
    assert not pairs([*a, [3, 0, 1], [3, 3, 0]], faces)
    assert pairs([*a, [3, 0, 1], [3, 0, -1]], faces) == [
        [0, 1]
    ]  # its side across goes through the other
    assert pairs([*a, [1, 0, 1], [1, 0, 0]], faces) == [[0, 1]]  # a side within
    assert not pairs([*a, [1, 0.5, 1], [1, 0.5, 0]], faces)  # a side upon a side
    assert pairs([*a, [1, 0, 0], [1, 3, 0]], faces) == [[0, 1]]  # folded into one plane
    assert not pairs([*a, [-1, 0, 0], [-1, 1, 0]], faces)


def test_standing_upon_a_face_is_crossing_and_upon_its_border_is_not():
    floor = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    faces = [[0, 1, 2], [3, 4, 5]]
    assert pairs([*floor, [1, 1, 0], [1, 2, 3], [2, 1, 3]], faces) == [[0, 1]]
    assert pairs([*floor, [1, 1, 0], [2, 1, 0], [1, 1, 3]], faces) == [[0, 1]]
    assert not pairs([*floor, [2, 2, 0], [1, 2, 3], [2, 1, 3]], faces)
    assert not pairs([*floor, [1, 0, 0], [2, 0, 0], [1, 0, 3]], faces)
    assert not pairs([*floor, [1, 1, 1e-12], [1, 2, 3], [2, 1, 3]], faces)


def test_faces_without_area_cross_what_they_reach_the_inside_of():
    floor = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    faces = [[0, 1, 2], [3, 4, 5]]
    assert pairs([*floor, [1, 1, -1], [1, 1, 0], [1, 1, 2]], faces) == [[0, 1]]
    assert pairs([*floor, [1, 1, 0], [1, 1, 0], [1, 1, 0]], faces) == [[0, 1]]
    assert pairs([*floor, [-1, 1, 0], [9, 1, 0], [2, 1, 0]], faces) == [[0, 1]]
    assert not pairs([*floor, [-1, 0, 0], [9, 0, 0], [2, 0, 0]], faces)
    assert not pairs([*floor, [0, 0, 0], [0, 0, 0], [0, 0, 0]], faces)
    assert not pairs([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[0, 1, 2], [1, 2, 0], [0, 0, 0]])
    assert not pairs(
        [*floor, [2, 0, 0]], [[0, 3, 2], [3, 1, 2], [0, 1, 3]]
    )  # a sliver between others at one side


def test_a_face_twice_is_an_overlap():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert pairs(vertices, [[0, 1, 2], [2, 1, 0], [0, 1, 2]]) == [[0, 1], [0, 2], [1, 2]]
    assert pairs(vertices * 2, [[0, 1, 2], [3, 4, 5]]) == [[0, 1]]


@pytest.mark.parametrize("shape", [icosphere(3), torus(40, 20), torus(41, 3), grid(30, 20), cube()])
def test_clean_shapes_have_none_nor_have_their_loose_faces(shape):
    assert self_intersections(shape).shape == (0, 2)
    loose = TriangleMesh(
        shape.vertices[shape.faces].reshape(-1, 3), np.arange(3 * shape.n_faces).reshape(-1, 3)
    )
    assert self_intersections(loose).shape == (0, 2)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_creatures_at_rest_have_none(kind):
    assert not self_intersections(make_creature(kind, n_vertices=1000)).size


@pytest.mark.long
def test_an_ant_crosses_its_legs():
    """Poses are drawn, not examined: legs may meet, and what crosses is two legs, not neighbors."""
    ant = make_creature("ant", 3)
    found = self_intersections(ant)
    assert len(found)
    assert not (ant.faces[found[:, 0], :, None] == ant.faces[found[:, 1], None, :]).any()


def crossed(seed=0, n=30):
    """Two tori through each other, in general position."""
    rng = np.random.default_rng(seed)
    one, other = torus(n, 12), torus(n, 11)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return disjoint_union(one, TriangleMesh(other.vertices @ turn + [0.5, 0.1, 0.2], other.faces))


def as_set(found):
    return {tuple(pair) for pair in np.sort(found, axis=1).tolist()}


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_names_change_nothing_but_names(seed):
    rng, mesh = np.random.default_rng(seed), crossed()
    new_of_old, order = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
    vertices = np.empty_like(mesh.vertices)
    vertices[new_of_old] = mesh.vertices
    corners = np.stack([rng.permutation(face) for face in new_of_old[mesh.faces][order]])
    renamed = self_intersections(TriangleMesh(vertices, corners))
    assert as_set(order[renamed]) == as_set(self_intersections(mesh))
    assert len(renamed) > 50


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_names_change_nothing_on_a_lattice(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = rng.integers(-2, 3, (40, 3)).astype(float), rng.integers(0, 40, (60, 3))
    order = rng.permutation(60)
    shuffled = TriangleMesh(vertices, np.stack([rng.permutation(face) for face in faces[order]]))
    assert as_set(order[self_intersections(shuffled)]) == as_set(
        self_intersections(TriangleMesh(vertices, faces))
    )


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_moving_changes_nothing_in_general_position(seed):
    rng, mesh = np.random.default_rng(seed), crossed()
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    moved = TriangleMesh(mesh.vertices @ turn + rng.standard_normal(3), mesh.faces)
    np.testing.assert_array_equal(self_intersections(moved), self_intersections(mesh))


@pytest.mark.parametrize("scale", [2.0**-900, 2.0**-31, 2.0, 2.0**900, 1e-100, 1e100])
def test_units_change_nothing(scale):
    for mesh in (crossed(), disjoint_union(cube(), cube(0.5, 1.5))):
        scaled = self_intersections(TriangleMesh(mesh.vertices * scale, mesh.faces))
        np.testing.assert_array_equal(scaled, self_intersections(mesh))
        assert len(scaled)


def test_pairs_are_ascending_and_once():
    found = self_intersections(crossed())
    assert found.dtype == np.int64
    assert (found[:, 0] < found[:, 1]).all()
    keys = found @ [10**6, 1]
    assert (np.diff(keys) > 0).all()


def test_loose_vertices_and_one_face_are_no_matter():
    assert self_intersections(
        TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    ).shape == (0, 2)
    mesh = crossed()
    far = TriangleMesh(np.concatenate([mesh.vertices, [[1e300, 0, 0]]]), mesh.faces)
    np.testing.assert_array_equal(self_intersections(far), self_intersections(mesh))
