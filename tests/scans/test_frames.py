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
def test_pixels_that_measured_nothing_are_holes(nothing):
    depth = np.full((7, 7), 2.0)
    depth[3, 3] = nothing
    made = triangulate_frame(frame(depth))
    assert 24 not in made.source_vertices
    assert made.mesh.n_vertices == 48
    assert len(es.geometry.boundary_loops(made.mesh)) == 2
    points = frame(depth).reshape(-1, 3)
    assert np.array_equal(made.mesh.vertices, points[made.source_vertices])


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
