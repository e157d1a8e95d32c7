"""Surfaces of frames of a depth camera, along the grid of the pixels."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.scans.frames import triangulate_frame


def frame(depth, focal=50.0):
    """Return what the pixels of a camera at the origin see, which looks along z."""
    n_rows, n_columns = depth.shape
    across = (np.arange(n_columns) + 0.5 - n_columns / 2) / focal
    down = (np.arange(n_rows) + 0.5 - n_rows / 2) / focal
    rays = np.stack([*np.meshgrid(across, down), np.ones(depth.shape)], axis=2)
    return rays * depth[:, :, None]


def test_a_wall_is_one_sheet_that_faces_the_camera():
    made = triangulate_frame(frame(np.full((6, 9), 2.0)))
    assert (made.mesh.n_vertices, made.mesh.n_faces) == (54, 2 * 5 * 8)
    assert made.report == ("triangulate_frame joined 54 pixels of a frame of 6 x 9 to 80 faces",)
    assert (es.geometry.face_normals(made.mesh)[:, 2] < 0).all()
    assert es.geometry.surface_area(made.mesh) == pytest.approx(5 * 8 * (2 / 50) ** 2)
    mirrored = triangulate_frame(frame(np.full((6, 9), 2.0))[::-1])
    assert (es.geometry.face_normals(mirrored.mesh)[:, 2] < 0).all()


def test_what_lies_behind_a_jump_is_not_joined():
    depth = np.full((6, 8), 2.0)
    depth[:, 4:] = 3.0
    made = triangulate_frame(frame(depth))
    count, labels = es.geometry.vertex_components(made.mesh)
    assert count == 2
    assert {tuple(np.unique(made.mesh.vertices[labels == part, 2])) for part in (0, 1)} == {
        (2.0,),
        (3.0,),
    }


@pytest.mark.parametrize("nothing", [np.nan, 0.0], ids=["not finite", "origin"])
def test_pixels_that_measured_nothing_are_no_vertices_and_many_are_a_hole(nothing):
    depth = np.full((12, 12), 2.0)
    depth[2, 2] = depth[2, 9:11] = nothing
    depth[6:9, 6:9] = nothing
    made = triangulate_frame(frame(depth))
    assert made.mesh.n_vertices == 144 - 1 - 2 - 9
    assert len(es.geometry.boundary_loops(made.mesh)) == 2  # the rim, and that of the nine pixels
    points = frame(depth).reshape(-1, 3)
    assert np.array_equal(made.mesh.vertices, points[made.source_vertices])


def test_any_pixels_of_a_wall_are_joined_once_and_face_the_camera():
    depth = np.where(np.random.default_rng(0).random((40, 60)) < 0.2, np.nan, 2.0)
    depth[0], depth[-1], depth[:, 0], depth[:, -1] = 2.0, 2.0, 2.0, 2.0
    made = triangulate_frame(frame(depth))
    assert es.geometry.surface_area(made.mesh) == pytest.approx(39 * 59 * (2 / 50) ** 2)
    assert (es.geometry.face_normals(made.mesh)[:, 2] < 0).all()
    assert len(es.geometry.boundary_loops(made.mesh)) == 1


def test_a_slope_is_one_surface_though_pixels_are_lost():
    depth = np.tile(2.0 + np.arange(12) * 4 * 2.0 / 50, (12, 1))  # four widths of a pixel a step
    depth[5, 5] = np.nan
    made = triangulate_frame(frame(depth))
    assert es.geometry.vertex_components(made.mesh)[0] == 1
    assert len(es.geometry.boundary_loops(made.mesh)) == 1


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_frames_scale(scale):
    points = frame(2 + 0.01 * np.random.default_rng(0).random((9, 9)))
    plain, scaled = triangulate_frame(points), triangulate_frame(scale * points)
    assert np.array_equal(plain.mesh.faces, scaled.mesh.faces)


@pytest.mark.parametrize(
    "points",
    [
        np.full((5, 5, 3), np.nan),
        np.ones((5, 5, 3)),
        np.random.default_rng(0).standard_normal((5, 1, 3)),
    ],
    ids=["nothing", "one point", "a column"],
)
def test_a_frame_without_a_surface_is_refused(points):
    with pytest.raises(es.InvalidShapeError, match="A frame must show a surface"):
        triangulate_frame(points)
