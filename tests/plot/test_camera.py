import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.plot import fields, shape_pairs, sheet
from eigenshape.plot.camera import aim_camera, in_picture
from eigenshape.plot.fields import figure_field, figure_segments
from eigenshape.plot.render import draw
from eigenshape.plot.sheet import Panel, figure_contact_sheet, figure_poses
from eigenshape.shapes.surfaces import icosphere, torus

BALL = icosphere(2)


def leaning_tower(up):
    """A shape that stands along `up` alone: plate, leg on its rim, heavy head, and most vertices on a tiny far nose."""
    plate = BALL.vertices * [1.0, 1.0, 0.05]
    leg = BALL.vertices * [0.1, 0.1, 0.5] + [0.85, 0, 0.5]
    head = BALL.vertices * 0.6 + [0.35, 0, 1.5]
    nose = TriangleMesh(icosphere(4).vertices * 0.05 + [3, 0, 1.5], icosphere(4).faces)
    tower = disjoint_union(
        nose, *(TriangleMesh(points, BALL.faces) for points in (plate, leg, head))
    )
    return TriangleMesh(np.roll(tower.vertices, {"z": 0, "x": 1, "y": 2}[up], axis=1), tower.faces)


def test_a_shape_that_stands_along_one_axis_is_shown_standing():
    for up in ("y", "z"):
        tower = leaning_tower(up)
        automatic, told = aim_camera(tower), aim_camera(tower, up=up)
        assert np.array_equal(automatic.rotation, told.rotation)
        head_row = in_picture(tower, automatic)[-1, 1]
        plate_row = in_picture(tower, automatic)[-3 * BALL.n_vertices, 1]
        assert head_row < plate_row


def test_y_is_up_where_both_would_stand_or_neither():
    for mesh in (BALL, torus(), leaning_tower("x")):
        assert np.array_equal(aim_camera(mesh).rotation, aim_camera(mesh, up="y").rotation)


def test_the_guess_does_not_depend_on_the_unit():
    tower = leaning_tower("z")
    usual = aim_camera(tower).rotation
    for power in (-330, 330):
        scaled = TriangleMesh(tower.vertices * 2.0**power, tower.faces)
        assert np.array_equal(aim_camera(scaled).rotation, usual)


def test_a_shape_is_shown_from_the_side_that_bends_more():
    """A ball with a dented face on its far side is turned round, however its faces are numbered and scaled."""
    ball = icosphere(4)
    x, y, z = ball.vertices.T
    for side in (1, -1):
        relief = 0.05 * np.sin(20 * x) * np.sin(20 * y) * np.clip(side * z, 0, 1)
        points = ball.vertices * (1 + relief)[:, None]
        for mesh in (
            TriangleMesh(points, ball.faces),
            TriangleMesh(points * 2.0**-300, ball.faces),
            TriangleMesh(points, ball.faces[:, ::-1]),
        ):
            right, down, towards = aim_camera(mesh).rotation
            assert side * towards[2] > 0.5
            assert towards[1] > 0.3
            assert np.cross(right, towards) == pytest.approx(down, abs=1e-12)


def test_a_shape_without_area_has_a_view():
    needle = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    camera = aim_camera(needle, size=50)
    assert np.isfinite(in_picture(needle, camera)).all()


@settings(deadline=None, max_examples=20)
@given(st.sampled_from(["x", "y", "z"]), st.integers(0, 2**32 - 1))
def test_cameras_are_rotations_with_up_upward_and_shapes_fill_the_picture(up, seed):
    points = np.random.default_rng(seed).standard_normal((30, 3)) * [1, 2, 3] + 5
    mesh = TriangleMesh(points, np.arange(30).reshape(10, 3))
    camera = aim_camera(mesh, up=up, size=100)
    right, down, towards = camera.rotation
    assert camera.rotation @ camera.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.cross(right, towards) == pytest.approx(
        down, abs=1e-12
    )  # right, down, towards: a mirror would flip it
    assert right["xyz".index(up)] == pytest.approx(0, abs=1e-12)
    assert down["xyz".index(up)] < 0
    places = in_picture(mesh, camera)[:, :2]
    assert np.ptp(places, axis=0).max() == pytest.approx(92)
    assert (places.min(axis=0) + places.max(axis=0)) / 2 == pytest.approx([50, 50])


@pytest.mark.data
def test_a_real_head_shows_its_face(data):
    assert aim_camera(read_mesh(data / "classics" / "decimated-max.obj")).rotation[2, 2] < -0.5


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "down"),
    [("horse.ply", [0, 0, -1]), ("bunny.off", [0, -1, 0]), ("camel.off", [0, -1, 0])],
)
def test_every_picture_of_a_classic_shape_shows_it_upright(data, name, down, monkeypatch):
    """Whichever figure draws it, and without being told which axis is up."""
    mesh = read_mesh(data / "classics" / name)
    views = []
    for module in (fields, sheet, shape_pairs):
        monkeypatch.setattr(
            module,
            "draw",
            lambda shape, camera, **_: views.append(camera.rotation) or draw(BALL, camera),
        )
    figure_segments(mesh, np.zeros(mesh.n_faces, dtype=int), np.array([0]))
    figure_field(mesh, mesh.vertices[:, 0], "x")
    figure_poses({"one": mesh})
    panel = Panel(mesh, "a", np.zeros(mesh.n_faces, dtype=int), np.array([0]))
    figure_contact_sheet(panel, [panel])
    assert len(views) == 5
    for rotation in views:
        assert np.array_equal(rotation, views[0])
        assert rotation[1] @ down > 0.8


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "up"), [("tosca_cat0", "z"), ("tosca_dog0", "z"), ("sumner_horse-10", "y")]
)
def test_real_animals_are_shown_on_their_feet(data, name, up):
    (path,) = (data / "retrieval").rglob(f"{name}.*")
    mesh = read_mesh(path)
    assert np.array_equal(aim_camera(mesh).rotation, aim_camera(mesh, up=up).rotation)


@pytest.mark.parametrize(
    ("view", "towards"),
    [
        ("front", [0, 0, 1]),
        ("back", [0, 0, -1]),
        ("left", [1, 0, 0]),
        ("right", [-1, 0, 0]),
        ("top", [0, 1, 0]),
        ("bottom", [0, -1, 0]),
        ([3, 0, 4], [0.6, 0, 0.8]),
        ([1e-300, 0, 0], [1, 0, 0]),
    ],
)
def test_named_views_look_at_their_side(view, towards):
    rotation = aim_camera(BALL, view=view, up="y").rotation
    assert rotation[2] == pytest.approx(towards, abs=1e-12)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.cross(rotation[0], rotation[2]) == pytest.approx(rotation[1], abs=1e-12)


def test_views_along_the_upward_direction_keep_the_front_at_the_viewers_side():
    assert aim_camera(BALL, view="top", up="y").rotation[1] == pytest.approx([0, 0, 1])
    assert aim_camera(BALL, view="bottom", up="y").rotation[1] == pytest.approx([0, 0, -1])


@pytest.mark.parametrize(
    ("up", "down"), [("-z", [0, 0, 1]), ("x", [-1, 0, 0]), ([0, 2, 0], [0, -1, 0])]
)
def test_the_upward_direction_points_up(up, down):
    assert aim_camera(BALL, view="front", up=up).rotation[1] == pytest.approx(down, abs=1e-12)
    assert aim_camera(BALL, up=up).rotation[1] @ down > 0.8


def test_the_usual_view_is_from_the_front_left():
    for up in ("auto", "x", "-y"):
        named = aim_camera(BALL, view="front-left", up=up).rotation
        assert aim_camera(BALL, up=up).rotation == pytest.approx(named, abs=1e-12)


@pytest.mark.parametrize("bad", ["behind", "y", [0, 0, 0], [1, 2], [1, 0, np.nan]])
def test_a_view_that_is_none_is_refused(bad):
    match = "view must be one of" if isinstance(bad, str) else "view must be a direction"
    with pytest.raises(InvalidParameterError, match=match):
        aim_camera(BALL, view=bad)


def test_an_upward_direction_that_is_none_is_refused():
    with pytest.raises(InvalidParameterError, match="up must be one of auto, x, y, z, -x, -y, -z"):
        aim_camera(BALL, up="front")


def test_figures_take_a_view_or_a_camera_but_not_both():
    camera = aim_camera(BALL, view="left", up="z", size=50)
    with pytest.raises(InvalidParameterError, match="view and up must not be passed with it"):
        figure_field(BALL, BALL.vertices[:, 0], camera=camera, up="z")


@pytest.mark.long
def test_every_figure_of_shapes_passes_its_view_on(monkeypatch):
    views = []
    for module in (fields, sheet):
        monkeypatch.setattr(
            module,
            "draw",
            lambda shape, camera, **_: views.append(camera.rotation) or draw(BALL, camera),
        )
    side = {"view": "right", "up": "z"}
    labels = np.zeros(BALL.n_faces, dtype=int)
    figure_segments(BALL, labels, **side)
    figure_field(BALL, BALL.vertices[:, 0], **side)
    figure_poses({"one": BALL}, **side)
    panel = Panel(BALL, "a", labels, np.array([0]))
    figure_contact_sheet(panel, [panel], **side)
    assert len(views) == 5
    for rotation in views:
        assert rotation == pytest.approx(aim_camera(BALL, **side).rotation)
