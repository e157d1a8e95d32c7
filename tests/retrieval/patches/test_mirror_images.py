"""Shapes and their mirror images."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.retrieval.patches.matching import pack_points, unpack_points
from eigenshape.retrieval.patches.mirror_images import is_mirror_image

N_BUMPS = 6


def handed(angle: float) -> es.TriangleMesh:
    """Return a ball with bumps, which no plane makes symmetric; other angles give other triangles."""
    ball = es.icosphere(4)
    points = ball.vertices @ Rotation.from_rotvec([angle, angle / 2, 0]).as_matrix()
    rng = np.random.default_rng(1)
    radius = np.ones(ball.n_vertices)
    for _ in range(N_BUMPS):
        direction, height = rng.standard_normal(3), rng.uniform(0.5, 2.5)
        apart = np.arccos(np.clip(points @ direction / np.linalg.norm(direction), -1, 1))
        radius += height * np.exp(-(apart**2) / rng.uniform(0.03, 0.15))
    return es.TriangleMesh(points * radius[:, None], ball.faces)


def in_mirror(mesh: es.TriangleMesh, axis: int = 0) -> es.TriangleMesh:
    """Return the mirror image of a mesh, turned outward."""
    signs = np.ones(3)
    signs[axis] = -1
    return es.TriangleMesh(mesh.vertices * signs, mesh.faces[:, ::-1])


def points_of(mesh: es.TriangleMesh):
    """Return the points of a mesh, as an index keeps them."""
    return unpack_points(pack_points(es.describe(mesh).points[0]))


@pytest.fixture(scope="module")
def fine():
    return points_of(handed(0))


def test_a_mirror_image_with_other_triangles_in_another_unit_is_one(fine):
    other = handed(0.3)
    moved = es.TriangleMesh(1000 * other.vertices[:, [1, 2, 0]] + 5, other.faces)
    assert is_mirror_image(fine, points_of(moved)) is False
    for axis in range(3):
        assert is_mirror_image(fine, points_of(in_mirror(moved, axis))) is True


def test_a_shape_turned_inside_out_is_no_mirror_image(fine):
    other = handed(0.3)
    inside_out = es.TriangleMesh(other.vertices, other.faces[:, ::-1])
    assert is_mirror_image(fine, points_of(inside_out)) is False


def test_an_animal_in_another_pose_has_no_other_side():
    one, two = (es.make_creature("biped", pose, n_vertices=1000) for pose in (0, 2))
    assert is_mirror_image(points_of(one), points_of(two)) is None
    assert is_mirror_image(points_of(one), points_of(in_mirror(two))) is None


def test_nothing_is_said_of_sheets_and_of_shapes_that_do_not_agree(fine):
    sheet = es.shapes.grid(20, 12)
    x, y, z = sheet.vertices.T
    wedge = es.TriangleMesh(np.column_stack([x * (0.4 + y), y, z]), sheet.faces)
    assert is_mirror_image(points_of(wedge), points_of(in_mirror(wedge))) is None
    assert is_mirror_image(fine, points_of(es.make_creature("octopus", n_vertices=1000))) is None


def test_a_match_of_an_index_and_a_labeled_shape_say_it(tmp_path):
    one = handed(0)
    index = es.ShapeIndex.create(tmp_path / "index")
    index.add("right", one, n_views=0)
    index.add("by heat", one, recipe=es.retrieval.SCALE_FREE, n_views=0)
    assert index.query(in_mirror(one))[0].mirrored is True
    assert index.query(one)[0].mirrored is False
    assert index.query(es.describe(one, es.retrieval.SCALE_FREE))[0].mirrored is None
    labeled = es.retrieval.LabeledShape(one, np.zeros(one.n_faces, dtype=int))
    symmetric = es.retrieval.LabeledShape(es.icosphere(2), np.zeros(320, dtype=int))
    found = es.transfer_labels([labeled, symmetric], in_mirror(one))
    assert found.mirrored == (True, None)
