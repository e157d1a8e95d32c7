import numpy as np
import pytest
from each_creature import KINDS
from threadpoolctl import threadpool_limits

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import edge_lengths, enclosed_volume
from eigenshape.geometry.simplices import degenerate_simplices
from eigenshape.geometry.topology import (
    euler_characteristic,
    is_closed,
    is_manifold,
    unreferenced_vertices,
    vertex_components,
)
from eigenshape.shapes import creatures
from eigenshape.shapes.creatures import make_creature

N = 800
POSES = (0, 1, 2, 3, 4)
each_kind = pytest.mark.parametrize("kind", KINDS)


def least_angles(mesh):
    """Return the least angle of each triangle, in degrees."""
    corners = mesh.vertices[mesh.faces]
    sides = np.roll(corners, -1, axis=1) - corners
    sides /= np.linalg.norm(sides, axis=2, keepdims=True)
    cosines = -np.einsum("fij,fij->fi", sides, np.roll(sides, 1, axis=1))
    return np.degrees(np.arccos(np.clip(cosines, -1, 1))).min(axis=1)


def windings(points, mesh):
    """Return how often the surface winds around each point: 0 outside, 1 inside (Van Oosterom and Strackee 1983)."""
    a, b, c = (mesh.vertices[mesh.faces] - points[:, None, None]).transpose(2, 0, 1, 3)
    x, y, z = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    dots = [np.einsum("pfi,pfi->pf", one, two) for one, two in ((a, b), (b, c), (c, a))]
    volume = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
    return np.arctan2(volume, x * y * z + dots[0] * z + dots[1] * x + dots[2] * y).sum(axis=1) / (
        2 * np.pi
    )


def outward(mesh):
    """Return unit normals at the vertices."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    normals = np.zeros_like(mesh.vertices)
    np.add.at(normals, mesh.faces, np.cross(b - a, c - a)[:, None, :])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.long
@pytest.mark.sweep
@each_kind
@pytest.mark.parametrize(("n_vertices", "individual"), [(500, 1), (N, 0), (2500, 0)])
def test_the_skin_is_one_closed_sphere_that_faces_outward(kind, n_vertices, individual):
    mesh = make_creature(kind, n_vertices=n_vertices, individual=individual)
    assert is_closed(mesh)
    assert is_manifold(mesh)
    assert inconsistent_edges(mesh).size == 0
    assert vertex_components(mesh)[0] == 1
    assert unreferenced_vertices(mesh).size == 0
    assert euler_characteristic(mesh) == 2
    assert enclosed_volume(mesh) > 0
    assert abs(mesh.n_vertices / n_vertices - 1) < 0.02


@pytest.mark.long
@each_kind
def test_triangles_are_even(kind):
    mesh = make_creature(kind, n_vertices=N)
    assert degenerate_simplices(mesh).size == 0
    assert np.percentile(least_angles(mesh), 1) > 20
    low, high = np.percentile(edge_lengths(mesh) / edge_lengths(mesh).mean(), [1, 99])
    assert low > 0.4
    assert high < 1.6


@pytest.mark.long
@each_kind
def test_poses_bend_and_hardly_stretch(kind):
    poses = [make_creature(kind, pose, n_vertices=2500) for pose in POSES]
    for one in poses:
        np.testing.assert_array_equal(one.faces, poses[0].faces)
        for other in poses:
            change = np.abs(edge_lengths(one) / edge_lengths(other) - 1)
            assert np.median(change) < 0.03
            assert np.percentile(change, 95) < 0.15


@pytest.mark.long
@each_kind
def test_poses_differ_to_the_eye(kind):
    rest = make_creature(kind, n_vertices=N)
    size = np.ptp(rest.vertices, axis=0).max()
    moved = [
        np.linalg.norm(make_creature(kind, p, n_vertices=N).vertices - rest.vertices, axis=1)
        for p in POSES[1:]
    ]
    assert min(way.max() for way in moved) > 0.08 * size
    assert max(way.max() for way in moved) > 0.15 * size


@pytest.mark.long
@each_kind
def test_poses_hardly_run_through_themselves(kind):
    for pose in POSES[:4]:
        mesh = make_creature(kind, pose, n_vertices=N)
        some = slice(None, None, 4)
        inside = windings(mesh.vertices[some] + 0.012 * outward(mesh)[some], mesh) > 0.5
        assert inside.mean() < 0.02


@each_kind
def test_creatures_stand_upright_and_look_ahead(kind):
    x, y, z = np.ptp(make_creature(kind, n_vertices=N).vertices, axis=0)
    wide = {
        "bird": x > z > y,
        "snake": z > x > y,
        "fish": z > max(x, y),
        "lizard": z > x > y,
        "ant": z > y,
        "octopus": x > y,
    }
    assert wide.get(kind, y > max(x, 0.9 * z))


@each_kind
def test_the_rest_pose_of_the_plan_is_as_wide_to_the_left_as_to_the_right(kind):
    points = make_creature(kind, n_vertices=N).vertices
    if kind not in {"hand", "snake"}:
        assert points[:, 0].max() == pytest.approx(-points[:, 0].min(), abs=0.05)


def forget_creatures():
    for function in (creatures._rest_pose, creatures._fine_skin):
        function.cache_clear()


@pytest.mark.long
def test_the_same_seed_gives_the_same_bits():
    first = make_creature("fish", 5, n_vertices=800, individual=2)
    forget_creatures()
    again = make_creature("fish", 5, n_vertices=800, individual=2)
    np.testing.assert_array_equal(again.vertices, first.vertices)
    np.testing.assert_array_equal(again.faces, first.faces)


@pytest.mark.long
def test_the_number_of_threads_changes_no_bit():
    made = []
    for n_threads in (1, 4):
        forget_creatures()
        with threadpool_limits(n_threads, user_api="blas"):
            made.append(creatures._rest_pose("biped", 2500, 1))
    (mesh, joints), (again, joints_again) = made
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    # Posed vertices may round the difference away, and the shares do not.
    np.testing.assert_array_equal(joints_again.follows, joints.follows)


@pytest.mark.long
def test_individuals_differ_in_proportions():
    one, two = (make_creature("fish", n_vertices=800, individual=i) for i in (0, 1))
    assert abs(enclosed_volume(one) / enclosed_volume(two) - 1) > 0.01


def test_an_unknown_kind_is_refused_by_name():
    with pytest.raises(
        InvalidParameterError, match=r"kind must be one of ant, biped, .*; it is 'unicorn'"
    ):
        make_creature("unicorn")


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"pose": -1}, r"pose must lie in 0\.\.4294967295; it is -1"),
        ({"n_vertices": 499}, r"n_vertices must lie in 500\.\.100000; it is 499"),
        ({"individual": 2**32}, r"individual must lie in 0\.\.4294967295; it is 4294967296"),
    ],
)
def test_numbers_out_of_range_are_refused(options, match):
    with pytest.raises(InvalidParameterError, match=match):
        make_creature("fish", **options)
