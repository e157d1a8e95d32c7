import inspect
import itertools

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus import geodesic_paths
from eigenshape.calculus.geodesic_paths import geodesic_path
from eigenshape.calculus.geodesic_rays import trace_geodesic
from eigenshape.calculus.log_map import logarithmic_map
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.connection import tangent_frames
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid, icosphere, torus


def test_paths_on_a_plane_are_straight():
    square = grid(12, 9)
    rng = np.random.default_rng(0)
    for start, end in rng.choice(square.n_vertices, (20, 2)):
        if start != end:
            path = geodesic_path(square, start, end)
            apart = np.linalg.norm(square.vertices[start] - square.vertices[end])
            assert path.length == pytest.approx(apart, rel=1e-12)
            assert (path.points[[0, -1]] == square.vertices[[start, end]]).all()


def test_a_path_around_a_hole_bends_at_its_rim():
    square = grid(6, 6, width=6, height=6)
    middles = square.vertices[square.faces].mean(axis=1)
    hole = (np.abs(middles[:, :2] - 3) < 1).all(axis=1)
    holed = TriangleMesh(square.vertices, square.faces[~hole])
    loose = np.setdiff1d(np.arange(49), holed.faces)
    used = np.setdiff1d(np.arange(49), loose)
    places = np.full(49, -1)
    places[used] = np.arange(len(used))
    mesh = TriangleMesh(square.vertices[used], places[holed.faces])
    one, two = (
        int(np.flatnonzero((mesh.vertices[:, :2] == place).all(axis=1))[0])
        for place in ([1, 1], [5, 5])
    )
    assert geodesic_path(mesh, one, two).length == pytest.approx(2 * 10**0.5, rel=1e-12)


def test_a_path_around_the_corner_of_a_cube():
    cube = boundary_surface(box(4, 4, 4))
    corners = [
        int(np.flatnonzero((cube.vertices == place).all(axis=1))[0])
        for place in ([0, 0, 0], [1, 1, 1])
    ]
    assert geodesic_path(cube, *corners).length == pytest.approx(5**0.5, rel=1e-12)


def test_via_chooses_the_way_around_a_torus():
    ring = torus(24, 12)
    outer = np.flatnonzero(np.abs(ring.vertices[:, 2]) < 1e-12)
    angle = np.arctan2(ring.vertices[outer, 1], ring.vertices[outer, 0])
    far = np.linalg.norm(ring.vertices[outer], axis=1) > 1
    order = outer[far][np.argsort(angle[far])]
    start, end, other = order[0], order[5], order[14]
    short, long = geodesic_path(ring, start, end), geodesic_path(ring, start, end, via=[other])
    assert short.length < 0.5 * long.length
    assert geodesic_path(ring, end, start).length == pytest.approx(short.length, rel=1e-12)


def test_neighbors_are_joined_by_their_edge():
    ball = icosphere(2)
    one, two = ball.faces[7, :2]
    path = geodesic_path(ball, one, two)
    assert path.length == pytest.approx(np.linalg.norm(ball.vertices[one] - ball.vertices[two]))
    assert len(path.points) == 2


def test_a_walk_on_a_plane_ends_where_the_vector_says_or_at_the_boundary():
    square = grid(6, 6)
    frame = tangent_frames(square)[24]
    vector = np.array([0.31, 0.17])
    ends = trace_geodesic(square, 24, vector).points
    assert ends[-1] == pytest.approx(square.vertices[24] + vector @ frame, abs=1e-14)
    stopped = trace_geodesic(square, 24, 10 * vector)
    assert stopped.length < np.linalg.norm(10 * vector)
    assert np.abs(stopped.points[-1][:2] - 0.5).max() == pytest.approx(0.5)
    assert len(trace_geodesic(square, 24, [0.0, 0.0]).points) == 1


def test_walks_on_the_sphere_are_great_circles_and_undo_logarithms():
    ball = icosphere(4)
    frame, source = tangent_frames(ball)[25], ball.vertices[25]
    for vector in ([1.0, 0.0], [0.3, 1.2], [-0.5, 2.0]):
        length = np.hypot(*vector)
        path = trace_geodesic(ball, 25, vector)
        assert path.length == pytest.approx(length, rel=1e-12)
        exact = np.cos(length) * source + np.sin(length) / length * (np.array(vector) @ frame)
        assert np.linalg.norm(path.points[-1] - exact) < 0.003
    logarithms = logarithmic_map(ball, 25)
    target = int(np.argmin(np.abs(np.linalg.norm(logarithms, axis=1) - 1)))
    reached = trace_geodesic(ball, 25, logarithms[target]).points[-1]
    assert np.linalg.norm(reached - ball.vertices[target]) < 0.01


def test_at_a_corner_angles_are_shares_of_the_angle_around_it():
    """Between two edges of an octahedron, whose corners have 240 degrees, a path meets the middle of the side."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    faces = [
        [x, y, z] if x + y + z in (3, 7, 9, 11) else [y, x, z]
        for x in (0, 3)
        for y in (1, 4)
        for z in (2, 5)
    ]
    octahedron = TriangleMesh(corners, faces)
    height = np.sqrt(1.5)  # of a face
    for angle in np.pi / 4 + np.pi / 2 * np.arange(4):
        end = trace_geodesic(
            octahedron, 2, [height * np.cos(angle), height * np.sin(angle)]
        ).points[-1]
        np.testing.assert_allclose(np.abs(end), [0.5, 0.5, 0], atol=1e-12)


def place(mesh, *points):
    return es.geometry.closest_points(mesh, np.array(points))


def face_frame(mesh, face):
    """Return x along the first side of a face, and y a quarter turn further."""
    one, two, three = mesh.vertices[mesh.faces[face]]
    x = (two - one) / np.linalg.norm(two - one)
    normal = np.cross(x, three - one)
    return np.stack([x, np.cross(normal / np.linalg.norm(normal), x)])


def points_of(mesh, n=40, seed=0):
    """Return points inside faces, on edges, at vertices and next to them, away from the boundary."""
    rng = np.random.default_rng(seed)
    inside = mesh.vertices[mesh.faces].mean(axis=1)
    on_edges = mesh.vertices[mesh.faces[:, :2]].mean(axis=1)
    beside = mesh.vertices + np.array([1e-5, 3e-8, 0])
    found = np.concatenate([inside, on_edges, mesh.vertices, beside])
    found = found[(np.abs(found[:, :2] - 0.5) < 0.35).all(axis=1)]
    return rng.permutation(found)[:n]


def test_paths_between_points_inside_faces_of_a_plane_are_straight():
    square = es.shapes.grid(7, 5)
    points = points_of(square)
    for one, two in itertools.pairwise(points):
        path = geodesic_path(square, place(square, one), place(square, two))
        assert path.length == pytest.approx(np.linalg.norm(two - one), abs=1e-6)
        np.testing.assert_allclose(path.points[[0, -1]], [one, two], atol=1e-6)
    close = place(square, points[0] + [1e-3, 0, 0])
    assert geodesic_path(square, place(square, points[0]), close).length == pytest.approx(1e-3)
    to_vertex = geodesic_path(square, place(square, points[0]), 0)
    assert to_vertex.length == pytest.approx(np.linalg.norm(points[0]), abs=1e-6)


def test_paths_between_points_bend_over_edges():
    cube = es.geometry.boundary_surface(es.shapes.box(5, 5, 5))
    for height in (0.4, 0.5, 0.9):
        front, side = place(cube, [0.3, 0, 0.4]), place(cube, [1, 0.6, height])
        exact = np.hypot(0.7 + 0.6, height - 0.4)
        assert geodesic_path(cube, front, side).length == pytest.approx(exact)
    corner = np.flatnonzero((cube.vertices == 0).all(axis=1))
    distances = es.geometry.geodesic_distances(cube, front)[0]
    np.testing.assert_allclose(distances[corner], 0.5)


def test_walks_from_points_undo_logarithms_and_distances_on_a_plane():
    square = es.shapes.grid(7, 5)
    rng = np.random.default_rng(1)
    solver = es.calculus.prepare_vector_heat(square)
    for point in points_of(square):
        start = place(square, point)
        frame = face_frame(square, start.simplices[0])
        vector = 0.1 * rng.uniform(-1, 1, 2)
        path = trace_geodesic(square, start, vector)
        np.testing.assert_allclose(path.points[-1], point + vector @ frame, atol=1e-9)
        away = square.vertices - point
        distances = es.geometry.geodesic_distances(square, start)[0]
        np.testing.assert_allclose(distances, np.linalg.norm(away, axis=1), atol=1e-7)
        for method in ("affine", "adaptive"):
            found = es.calculus.logarithmic_map(solver, start, method=method)
            np.testing.assert_allclose(found, away @ frame.T, atol=1e-9)
    assert trace_geodesic(square, start, [0, 0]).length == 0
    assert trace_geodesic(square, start, [9, 0]).length < 1.5  # at the boundary


def test_points_are_as_good_sources_as_vertices_on_a_sphere():
    ball = es.icosphere(4)
    start = place(ball, [0.3, 0.2, 0.9])
    source = start.points[0] / np.linalg.norm(start.points[0])
    exact = np.arccos(np.clip(ball.vertices @ source, -1, 1))
    found = es.geometry.geodesic_distances(ball, start)[0]
    of_vertex = es.geometry.geodesic_distances(ball, [0])[0]
    exact_of_vertex = np.arccos(np.clip(ball.vertices @ ball.vertices[0], -1, 1))
    assert np.abs(found - exact).max() < np.abs(of_vertex - exact_of_vertex).max()
    maps = es.calculus.logarithmic_map(ball, start)
    near = exact < 1.5
    assert np.abs(np.linalg.norm(maps, axis=1) - exact)[near].max() < 0.011
    for vertex in np.flatnonzero(near)[::100]:
        end = trace_geodesic(ball, start, maps[vertex]).points[-1]
        assert np.linalg.norm(end - ball.vertices[vertex]) < 0.02


@pytest.mark.parametrize("unit", [1e-100, 1e100])
def test_paths_of_points_scale_exactly(unit):
    ball = es.icosphere(2)
    large = es.TriangleMesh(unit * ball.vertices, ball.faces)
    one, two = place(ball, [0.3, 0.2, 0.9]), place(ball, [-0.3, 0.7, 0.1])
    far_one, far_two = place(large, unit * one.points[0]), place(large, unit * two.points[0])
    for function in (
        lambda mesh, one, two: geodesic_path(mesh, one, two).length,
        lambda mesh, one, two: trace_geodesic(mesh, one, [0.3 * mesh.vertices.max(), 0]).points,
        lambda mesh, one, two: es.geometry.geodesic_distances(mesh, one),
        lambda mesh, one, two: es.calculus.logarithmic_map(mesh, one),
    ):
        expected = function(ball, one, two)
        np.testing.assert_allclose(function(large, far_one, far_two) / unit, expected, atol=1e-9)


def test_points_of_another_mesh_are_refused():
    ball, other = es.icosphere(2), es.icosphere(3)
    one, far = place(ball, [0, 0, 1.0]), place(other, [0.3, 0.2, 0.9])
    outside = es.geometry.SurfacePoints(far.points, far.simplices + 10_000, far.weights)
    solid = es.geometry.SurfacePoints(one.points, one.simplices, np.full((1, 4), 0.25))
    two = place(ball, [0, 0, 1.0], [0, 1.0, 0])
    for name, call in {
        "start": lambda at: geodesic_path(ball, at, 0),
        "end": lambda at: geodesic_path(ball, 0, at),
        "sources": lambda at: es.geometry.geodesic_distances(ball, at),
        "source": lambda at: es.calculus.logarithmic_map(ball, at),
        "start ": lambda at: trace_geodesic(ball, at, [1.0, 0]),
    }.items():
        for wrong in (far, outside, solid):
            with pytest.raises(
                InvalidParameterError,
                match=rf"{name.strip()} must lie on this mesh; point 0 .*closest_points\(mesh",
            ):
                call(wrong)
        call(place(ball, *far.points))  # the remedy
        if name != "sources":
            with pytest.raises(
                InvalidParameterError, match=f"{name.strip()} must be one point; there are 2"
            ):
                call(two)
    with pytest.raises(
        InvalidParameterError,
        match=r"start must be a vertex or a SurfacePoints; the value is a list",
    ):
        inspect.unwrap(geodesic_path)(ball, [0, 0, 1.0], 0)
    solver = es.calculus.prepare_vector_heat(ball)
    with pytest.raises(InvalidParameterError, match=r"The face of source must lie in 0..319"):
        es.calculus.logarithmic_map(solver, outside)


def test_bad_input_is_named(monkeypatch):
    ball = icosphere(1)
    with pytest.raises(InvalidParameterError, match="differ from the one before; vertex 3"):
        geodesic_path(ball, 3, 3)
    with pytest.raises(InvalidParameterError, match="end must lie in"):
        geodesic_path(ball, 3, 42)
    with pytest.raises(InvalidParameterError, match="must be on one component; 0 and 50"):
        geodesic_path(disjoint_union(ball, ball), 0, 50)
    with pytest.raises(InvalidParameterError, match="vector must hold two coordinates"):
        trace_geodesic(ball, 0, [1.0, 0.0, 0.0])
    with pytest.raises(InvalidParameterError, match="vector must point into the surface"):
        trace_geodesic(grid(2, 2), 0, [-1.0, -1.0])
    faces = ball.faces.copy()
    faces[3] = faces[3, ::-1]
    with pytest.raises(InvalidShapeError, match="turned against each other"):
        geodesic_path(TriangleMesh(ball.vertices, faces), 0, 5)
    monkeypatch.setattr(geodesic_paths, "ROUNDS", 0)
    with pytest.raises(ConvergenceError, match="path must become straight"):
        geodesic_path(ball, 0, 30)
