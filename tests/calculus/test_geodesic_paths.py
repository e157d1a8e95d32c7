import numpy as np
import pytest

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
