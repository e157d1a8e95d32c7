import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_loops, disjoint_union, vertex_components
from eigenshape.scans.partial import (
    cut_by_planes,
    partial_scan,
    random_planes,
    rotation_towards,
    viewpoint,
)
from eigenshape.shapes.surfaces import grid, icosphere

BALL = icosphere(4)


def require_part_of(part, whole):
    np.testing.assert_array_equal(part.mesh.vertices, whole.vertices[part.source_vertices])
    np.testing.assert_array_equal(
        part.source_vertices[part.mesh.faces], whole.faces[part.source_faces]
    )


@pytest.mark.parametrize("view", [[1, 0, 0], [0, 0, -1e-200], [1e200, -2e200, 5e199]])
def test_half_a_sphere_is_seen(view):
    part = partial_scan(BALL, view)
    require_part_of(part, BALL)
    assert 0.4 < surface_area(part.mesh) / surface_area(BALL) < 0.52
    direction = np.array(view) / np.abs(view).max()
    direction /= np.linalg.norm(direction)
    # At the rim the slack is 1.5 · 11 pixels of 510 across the sphere.
    assert (part.mesh.vertices @ direction).min() > -0.07
    seen = np.zeros(BALL.n_vertices, dtype=bool)
    seen[part.source_vertices] = True
    assert seen[BALL.vertices @ direction > 0.25].all()
    assert len(boundary_loops(part.mesh)) == 1


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_scans_do_not_depend_on_the_unit(scale):
    far = partial_scan(TriangleMesh(BALL.vertices * scale, BALL.faces), [1, 2, 3])
    near = partial_scan(BALL, [1, 2, 3])
    assert len(np.setxor1d(far.source_faces, near.source_faces)) <= 0.002 * BALL.n_faces


def test_what_is_behind_is_hidden():
    front = TriangleMesh(grid(8, 8).vertices + np.array([0, 0, 1.0]), grid(8, 8).faces)
    both = disjoint_union(grid(8, 8), front)
    assert partial_scan(both, [0, 0, 1]).source_faces.tolist() == list(range(128, 256))
    assert partial_scan(both, [0, 0, -1]).source_faces.tolist() == list(range(128))


def test_all_pieces_or_the_largest():
    beside = TriangleMesh(grid(4, 4).vertices * 0.5 + np.array([2, 0, 0]), grid(4, 4).faces)
    both = disjoint_union(beside, grid(4, 4))
    assert partial_scan(both, [0, 0, 1]).source_faces.tolist() == list(range(32, 64))
    pieces = partial_scan(both, [0, 0, 1], all_pieces=True)
    assert vertex_components(pieces.mesh)[0] == 2
    require_part_of(pieces, both)


def test_a_generator_draws_the_direction():
    one, two, three = (
        partial_scan(BALL, np.random.default_rng(seed)).source_faces for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, three)


@pytest.mark.parametrize("view", [[0.0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [1, 2], [[1, 2, 3]]])
def test_a_direction_that_is_none_is_refused(view):
    with pytest.raises(
        InvalidParameterError,
        match="view must be three finite numbers that are not all zero; it is ",
    ):
        partial_scan(BALL, np.array(view, dtype=float))


@pytest.mark.parametrize("resolution", [15, 8193])
def test_a_resolution_out_of_range_is_refused(resolution):
    with pytest.raises(
        InvalidParameterError, match=rf"resolution must lie in 16\.\.8192; it is {resolution}"
    ):
        partial_scan(BALL, [0, 0, 1], resolution=resolution)


def test_a_shape_in_one_line_of_sight_is_refused():
    line = TriangleMesh([[0, 0, 0], [0, 0, 1], [0, 0, 2]], [[0, 1, 2]])
    with pytest.raises(
        InvalidShapeError,
        match="a size as seen by the viewer; all its vertices lie on one line of sight",
    ):
        partial_scan(line, [0, 0, 1])


def test_no_whole_face_visible_is_refused():
    # Three blades around the axis, each with its high base over the low tip of the one before.
    angles = np.radians([-40, 40, 130])[None, :] + np.radians([0, 120, 240])[:, None]
    radii, heights = np.array([2.0, 2.0, 1.35]), np.broadcast_to([1.0, 1.0, -3.0], (3, 3))
    corners = np.stack([radii * np.cos(angles), radii * np.sin(angles), heights], axis=2)
    blades = TriangleMesh(corners.reshape(9, 3), np.arange(9).reshape(3, 3))
    for all_pieces in (False, True):
        with pytest.raises(
            InvalidShapeError, match=r"A part must have a face\. No face is visible as a whole from"
        ):
            partial_scan(blades, [0, 0, 1], all_pieces=all_pieces)
    assert partial_scan(blades, [0, 0, -1], all_pieces=True).mesh.n_faces >= 1


@pytest.mark.parametrize("number", [0, 1, 17, 1000])
def test_viewpoints_are_unit_directions(number):
    assert np.linalg.norm(viewpoint(number)) == pytest.approx(1, rel=1e-14)


def test_viewpoints_lie_evenly():
    views = np.array([viewpoint(number) for number in range(60)])
    assert np.linalg.norm(views.mean(axis=0)) < 0.05
    np.testing.assert_allclose(views.T @ views / 60, np.eye(3) / 3, atol=0.04)
    nearest = np.sort(np.arccos(np.clip(views @ views.T, -1, 1)), axis=1)[:, 1]
    assert np.degrees(nearest.min()) > 8  # sixty random ones come within about 2 degrees


@pytest.mark.parametrize("view", [[1.0, 0, 0], [0.0, -1, 0], [0.6, 0, -0.8]])
def test_a_rotation_brings_the_view_to_the_third_axis(view):
    turn = rotation_towards(np.array(view))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_allclose(turn @ view, [0, 0, 1], atol=1e-15)


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_a_plane_halves_a_sphere(scale):
    ball = TriangleMesh(BALL.vertices * scale, BALL.faces)
    part = cut_by_planes(ball, [0, 0, 1, 0])
    require_part_of(part, ball)
    assert part.mesh.vertices[:, 2].max() <= 0
    assert surface_area(part.mesh) / surface_area(ball) == pytest.approx(0.5, abs=0.03)


def test_planes_cut_together():
    part = cut_by_planes(grid(4, 4), [[1.0, 0, 0, 0.5], [0, 2, 0, 1]])
    assert surface_area(part.mesh) == pytest.approx(0.25)
    require_part_of(part, grid(4, 4))


@pytest.mark.parametrize(
    ("planes", "match"),
    [
        (np.zeros((2, 3)), r"planes must have shape \(p, 4\); the shape is \(2, 3\)"),
        (np.zeros((1, 2, 4)), r"planes must have shape \(p, 4\); the shape is \(1, 2, 4\)"),
        (
            np.array([[1.0, 0, 0, 0], [0, 0, 0, 1]]),
            r"a normal other than zero; row 1 is \[0\.0, 0\.0, 0\.0, 1\.0\]",
        ),
        (
            np.array([[1.0, 0, np.nan, 0]]),
            r"planes must be finite .*; row 0 is \[1\.0, 0\.0, nan, 0\.0\]",
        ),
        (np.array([[1.0, 0, 0, np.inf]]), r"planes must be finite .*; row 0 is .* inf\]"),
    ],
)
def test_planes_that_are_none_are_refused(planes, match):
    with pytest.raises(InvalidParameterError, match=match):
        cut_by_planes(BALL, planes)


def test_planes_that_leave_nothing_are_refused():
    with pytest.raises(
        InvalidShapeError, match=r"A part must have a face\. The planes leave no face"
    ):
        cut_by_planes(BALL, [0, 0, 1, -2])


def test_random_planes_cut_off_their_share():
    for seed in range(5):
        planes = random_planes(BALL, np.random.default_rng(seed), share=0.3)
        beyond = (BALL.vertices @ planes[0, :3] > planes[0, 3]).mean()
        assert beyond == pytest.approx(0.3, abs=0.002)
    assert random_planes(BALL, np.random.default_rng(0), n_planes=3).shape == (3, 4)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.5, float("nan")])
def test_a_share_out_of_range_is_refused(share):
    with pytest.raises(
        InvalidParameterError, match=rf"share must lie between 0 and 1; it is {share}"
    ):
        random_planes(BALL, np.random.default_rng(0), share=share)


def test_no_plane_to_draw_is_refused():
    with pytest.raises(InvalidParameterError, match=r"n_planes must lie in 1\.\.100; it is 0"):
        random_planes(BALL, np.random.default_rng(0), n_planes=0)
