import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eigenshape.figures.camera import in_picture, three_quarter_view
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.surfaces import disjoint_union, icosphere, torus
from eigenshape.io.mesh_files import read_mesh

BALL = icosphere(2)


def leaning_tower(up):
    """A shape that stands along `up` alone: plate, leg on its rim, heavy head, and most vertices on a tiny far nose."""
    plate = BALL.vertices * [1.0, 1.0, 0.05]
    leg = BALL.vertices * [0.1, 0.1, 0.5] + [0.85, 0, 0.5]
    head = BALL.vertices * 0.6 + [0.35, 0, 1.5]
    nose = TriangleMesh(icosphere(4).vertices * 0.05 + [3, 0, 1.5], icosphere(4).faces)
    tower = disjoint_union(nose, *(TriangleMesh(points, BALL.faces) for points in (plate, leg, head)))
    return TriangleMesh(np.roll(tower.vertices, {"z": 0, "x": 1, "y": 2}[up], axis=1), tower.faces)


def test_a_shape_that_stands_along_one_axis_is_shown_standing():
    for up in ("y", "z"):
        tower = leaning_tower(up)
        automatic, told = three_quarter_view(tower, up="auto"), three_quarter_view(tower, up=up)
        assert np.array_equal(automatic.rotation, told.rotation)
        head_row = in_picture(tower, automatic)[-1, 1]
        plate_row = in_picture(tower, automatic)[-3 * BALL.n_vertices, 1]
        assert head_row < plate_row


def test_y_is_up_where_both_would_stand_or_neither():
    for mesh in (BALL, torus(), leaning_tower("x")):
        assert np.array_equal(three_quarter_view(mesh, up="auto").rotation, three_quarter_view(mesh).rotation)


def test_the_guess_does_not_depend_on_the_unit():
    tower = leaning_tower("z")
    usual = three_quarter_view(tower, up="auto").rotation
    for power in (-330, 330):
        scaled = TriangleMesh(tower.vertices * 2.0**power, tower.faces)
        assert np.array_equal(three_quarter_view(scaled, up="auto").rotation, usual)


def test_a_shape_without_area_has_a_view():
    needle = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    camera = three_quarter_view(needle, up="auto", size=50)
    assert np.isfinite(in_picture(needle, camera)).all()


@settings(deadline=None, max_examples=20)
@given(st.sampled_from(["x", "y", "z"]), st.integers(0, 2**32 - 1))
def test_cameras_are_rotations_with_up_upward_and_shapes_fill_the_picture(up, seed):
    points = np.random.default_rng(seed).standard_normal((30, 3)) * [1, 2, 3] + 5
    mesh = TriangleMesh(points, np.arange(30).reshape(10, 3))
    camera = three_quarter_view(mesh, up=up, size=100)
    right, down, towards = camera.rotation
    assert camera.rotation @ camera.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.cross(right, towards) == pytest.approx(down, abs=1e-12)  # right, down, towards: a mirror would flip it
    assert right["xyz".index(up)] == pytest.approx(0, abs=1e-12)
    assert down["xyz".index(up)] < 0
    places = in_picture(mesh, camera)[:, :2]
    assert np.ptp(places, axis=0).max() == pytest.approx(92)
    assert (places.min(axis=0) + places.max(axis=0)) / 2 == pytest.approx([50, 50])


@pytest.mark.data
@pytest.mark.parametrize(("name", "up"), [("tosca_cat0", "z"), ("tosca_dog0", "z"), ("sumner_horse-10", "y")])
def test_real_animals_are_shown_on_their_feet(data, name, up):
    (path,) = (data / "retrieval").rglob(f"{name}.*")
    mesh = read_mesh(path)
    assert np.array_equal(three_quarter_view(mesh, up="auto").rotation, three_quarter_view(mesh, up=up).rotation)
