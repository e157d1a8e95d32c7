import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.distances.geodesic import (
    _fans,
    farthest_points,
    geodesic_balls,
    geodesic_distances,
    geodesic_waves,
)
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.surfaces import grid, icosphere


def test_on_a_flat_grid_the_way_is_straight():
    mesh = grid(12, 12)
    found = geodesic_balls(mesh, 0.45)
    rows, columns = found.nonzero()
    straight = np.linalg.norm(mesh.vertices[rows] - mesh.vertices[columns], axis=1)
    np.testing.assert_allclose(found[rows, columns], straight, rtol=1e-12)
    all_near = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices, axis=2) <= 0.45 - 1e-9
    assert found.nnz == all_near.sum() - mesh.n_vertices


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31))
def test_on_flat_irregular_triangles_it_is_straight_up_to_few_per_cent(seed):
    rng = np.random.default_rng(seed)
    flat = rng.random((300, 2))
    mesh = TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), Delaunay(flat).simplices)
    found = geodesic_balls(mesh, 0.3)
    rows, columns = found.nonzero()
    ratio = found[rows, columns] / np.linalg.norm(flat[rows] - flat[columns], axis=1)
    assert ratio.min() > 1 - 1e-9
    assert np.quantile(ratio, 0.99) < 1.03


def test_on_the_sphere_it_is_the_great_circle():
    mesh = icosphere(4)
    found = geodesic_balls(mesh, 0.6)
    rows, columns = found.nonzero()
    exact = 2 * np.arcsin(np.linalg.norm(mesh.vertices[rows] - mesh.vertices[columns], axis=1) / 2)
    assert np.abs(found[rows, columns] / exact - 1).max() < 0.002


def test_two_sheets_that_nearly_touch_stay_far_apart():
    sheet = grid(8, 8)
    folded = np.array([[x, y, 0.0] if x <= 0.5 else [1 - x, y, 0.01] for x, y, _ in sheet.vertices])
    found = geodesic_balls(TriangleMesh(folded, sheet.faces), 0.4).toarray()
    below, above = 1 * 9 + 4, 7 * 9 + 4  # opposite each other, .01 apart, .75 along the sheet
    assert np.linalg.norm(folded[below] - folded[above]) < 0.011
    assert found[below, above] == 0


def test_never_longer_than_along_the_edges():
    mesh = icosphere(2)
    edges = geodesic_balls(mesh, 10.0)
    ways = dijkstra(_edge_lengths(mesh))
    assert (edges.toarray() <= ways + 1e-12).all()
    assert edges.nnz == mesh.n_vertices * (mesh.n_vertices - 1)


def _edge_lengths(mesh):
    lengths = np.full((mesh.n_vertices,) * 2, np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        ends = mesh.faces[:, a], mesh.faces[:, b]
        lengths[ends] = lengths[ends[::-1]] = np.linalg.norm(
            mesh.vertices[ends[0]] - mesh.vertices[ends[1]], axis=1
        )
    return lengths


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_change_nothing(size):
    mesh = icosphere(2)
    one = geodesic_balls(mesh, 0.7)
    other = geodesic_balls(TriangleMesh(size * mesh.vertices, mesh.faces), 0.7 * size)
    np.testing.assert_array_equal(one.indices, other.indices)
    np.testing.assert_allclose(other.data / size, one.data, rtol=1e-12)


def test_it_is_symmetric_and_the_same_in_five_dimensions():
    mesh = icosphere(2)
    turned = np.linalg.qr(np.random.default_rng(0).normal(size=(5, 5)))[0][:3]
    one = geodesic_balls(mesh, 0.7)
    other = geodesic_balls(SimplicialMesh(mesh.vertices @ turned, mesh.faces), 0.7)
    assert (one != one.T).nnz == 0
    np.testing.assert_allclose(other.toarray(), one.toarray(), atol=1e-12)


def test_curves_and_bad_radii_are_refused():
    with pytest.raises(
        InvalidShapeError, match="need a mesh of dimension 2; this one has dimension 1"
    ):
        geodesic_balls(SimplicialMesh([[0.0], [1.0]], [[0, 1]]), 1.0)
    with pytest.raises(InvalidParameterError, match="radius must be positive and finite"):
        geodesic_balls(icosphere(1), 0.0)


@pytest.mark.parametrize("place", [0, 5, 10])
def test_from_a_line_on_a_grid_the_way_is_straight(place):
    mesh = grid(10, 10)
    away = np.abs(mesh.vertices[:, 0] - place / 10)
    line = np.flatnonzero(away < 1e-9)
    np.testing.assert_allclose(geodesic_distances(mesh, [line])[0], away, atol=1e-15)


def test_from_a_line_through_irregular_triangles_it_is_straight_up_to_few_per_cent():
    rng = np.random.default_rng(0)
    flat = np.vstack(
        [rng.random((2000, 2)), np.column_stack([np.full(60, 0.5), np.linspace(0, 1, 60)])]
    )
    mesh = TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), Delaunay(flat).simplices)
    away = np.abs(flat[:2000, 0] - 0.5)
    ratio = geodesic_distances(mesh, [np.arange(2000, 2060)])[0][:2000] / away
    assert ratio.min() > 1 - 1e-9
    assert np.median(ratio) < 1.002
    assert ratio[away > 0.02].max() < 1.07


def test_from_far_sources_it_is_the_least_of_their_distances():
    mesh = icosphere(3)
    sources = [0, 1, 2, 3]  # corners of the icosahedron
    found, least = (
        geodesic_distances(mesh, [sources])[0],
        geodesic_distances(mesh, sources).min(axis=0),
    )
    assert (found[sources] == 0).all()
    np.testing.assert_allclose(
        found, least, rtol=0.03
    )  # half-way between two the front counts as straight
    np.testing.assert_array_equal(found, geodesic_distances(mesh, [[3, 2, 2, 1, 0]])[0])


def test_beyond_the_reach_it_is_infinite():
    mesh = icosphere(3)
    whole, near = (
        geodesic_distances(mesh, [[0, 9]])[0],
        geodesic_distances(mesh, [[0, 9]], reach=0.5)[0],
    )
    np.testing.assert_array_equal(near, np.where(whole <= 0.5, whole, np.inf))
    assert 2 < np.isfinite(near).sum() < mesh.n_vertices


def test_another_component_is_infinitely_far_and_so_is_nothing():
    mesh = disjoint_union(icosphere(1), icosphere(1))
    assert np.isinf(geodesic_distances(mesh, [[0, 1]])[0]).tolist() == [False] * 42 + [True] * 42
    assert np.isinf(geodesic_distances(mesh, [[]])[0]).all()


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_change_no_distance_from_a_set(size):
    mesh = icosphere(2)
    one = geodesic_distances(mesh, [[0, 5, 9]])[0]
    other = geodesic_distances(TriangleMesh(size * mesh.vertices, mesh.faces), [[0, 5, 9]])[0]
    np.testing.assert_allclose(other / size, one, rtol=1e-12)


def test_sources_must_be_vertices_of_a_surface():
    with pytest.raises(InvalidParameterError, match=r"A source must lie in 0\.\.41; it is 42"):
        geodesic_distances(icosphere(1), [[3, 42]])[0]
    with pytest.raises(
        InvalidShapeError, match="need a mesh of dimension 2; this one has dimension 1"
    ):
        geodesic_distances(SimplicialMesh([[0.0], [1.0]], [[0, 1]]), [[0]])[0]


def test_edges_without_length_change_no_distance():
    flat = grid(9, 9)
    vertices, faces = flat.vertices.copy(), flat.faces
    ends = faces[40, :2]
    vertices[ends[0]] = vertices[ends[1]]
    found = geodesic_distances(TriangleMesh(vertices, faces), [0])[0]
    straight = np.linalg.norm(vertices - vertices[0], axis=1)
    assert found[ends[0]] == pytest.approx(found[ends[1]], rel=1e-12)
    np.testing.assert_allclose(found, straight, rtol=0.05)


def test_farthest_points_are_chosen_one_after_the_other_with_all_distances():
    mesh = grid(14, 9)
    chosen, rows, nearest = farthest_points(mesh, 9)
    np.testing.assert_array_equal(rows, geodesic_distances(mesh, chosen))
    # Of several that are equally near, however sums are rounded, the first
    equal = rows <= (1 + 1e-9) * rows.min(axis=0)
    np.testing.assert_array_equal(nearest, equal.argmax(axis=0))
    for number in range(1, 9):
        assert chosen[number] == rows[:number].min(axis=0).argmax()
    # Distances that end at a reach change no choice.
    near = farthest_points(mesh, 9, reach=0.3)
    np.testing.assert_array_equal(near[0], chosen)
    np.testing.assert_array_equal(near[2], nearest)
    within = rows <= 0.3
    np.testing.assert_array_equal(near[1][within], rows[within])


@pytest.mark.parametrize("source", [-1, 150, [0, 150]])
def test_a_wave_from_what_is_no_vertex_is_refused(source):
    with pytest.raises(InvalidParameterError, match="A source must"):
        geodesic_waves(grid(14, 9))(source)


def test_a_wave_has_room_for_repeated_sources():
    wave = geodesic_waves(grid(3, 3))
    np.testing.assert_array_equal(wave([4, 7] * 500), wave([4, 7]))


@pytest.mark.parametrize("reach", [np.nan, -1.0])
def test_a_reach_must_be_a_distance(reach):
    mesh = grid(3, 3)
    with pytest.raises(InvalidParameterError, match="reach must be"):
        geodesic_distances(mesh, [0], reach=reach)
    with pytest.raises(InvalidParameterError, match="reach must be"):
        geodesic_waves(mesh)(0, reach)
    with pytest.raises(InvalidParameterError, match="reach must be"):
        farthest_points(mesh, 2, reach=reach)


def test_waves_that_follow_each_other_are_as_if_alone():
    mesh = grid(14, 9)
    wave = geodesic_waves(mesh)
    wave([0, 30, 31], 0.4)
    wave(5)
    np.testing.assert_array_equal(wave(77, 0.5), geodesic_waves(mesh)(77, 0.5))
    np.testing.assert_array_equal(wave([8, 70]), geodesic_waves(mesh)([8, 70]))


def triangles_in(fans):
    """Return the triangles at each vertex as fans list them, and three lengths of each, in order."""
    starts, corners, lengths = fans
    found = {}
    for vertex in range(len(starts) - 1):
        assert lengths[starts[vertex + 1] - 1, 1] == -1
        for entry in range(starts[vertex], starts[vertex + 1]):
            if lengths[entry, 1] < 0:
                continue
            pairs = zip(corners[entry : entry + 2], lengths[entry : entry + 2, 0], strict=True)
            (one, to_one), (two, to_two) = sorted(pairs)
            sizes = found.setdefault((vertex, one, two), [])
            sizes.append([to_one, to_two, lengths[entry, 1]])
    return dict(sorted(found.items()))


def test_fans_list_each_triangle_once_at_each_corner():
    ball = icosphere(1)
    faces = ball.faces.copy()
    faces[::3] = faces[::3, ::-1]  # neighbors that disagree
    fins = [[0, faces[0, 1], 5], [0, faces[0, 1], 9], faces[7]]  # edges of three and more faces
    for mesh in (
        ball,
        TriangleMesh(ball.vertices, np.concatenate([faces, fins])),
        TriangleMesh(ball.vertices, faces[::2]),
    ):
        fans, scale = _fans(mesh)
        places, wanted = mesh.vertices / scale, {}
        for face in mesh.faces:
            for corner in range(3):
                vertex, *others = np.roll(face, -corner).tolist()
                one, two = sorted(others)
                ends = places[[one, two, one]] - places[[vertex, vertex, two]]
                sizes = wanted.setdefault((vertex, one, two), [])
                sizes.append(np.linalg.norm(ends, axis=1).tolist())
        found = triangles_in(fans)
        assert list(found) == sorted(wanted)
        for triangle, sizes in found.items():
            np.testing.assert_allclose(sizes, wanted[triangle], rtol=1e-14)
    # A closed fan names its first neighbor again.
    assert _fans(ball)[0][0][-1] == 3 * ball.n_faces + ball.n_vertices


def test_farthest_points_say_0_where_no_point_is_near():
    balls = disjoint_union(icosphere(1), icosphere(1))
    chosen, distances, nearest = farthest_points(balls, 1)
    assert chosen.tolist() == [balls.n_vertices // 2]  # beyond all of the first ball
    assert np.isinf(distances).sum() == balls.n_vertices // 2
    assert not nearest.any()
