"""Meshes as they are, and surfaces of clouds and frames, from files."""

import meshio
import numpy as np
import pytest

import eigenshape as es

HEADER = """# .PCD v0.7
VERSION 0.7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH {columns}
HEIGHT {rows}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {count}
DATA ascii
"""
BALL = es.icosphere(3)


def write_frame(path, rows=12, columns=16):
    """Write what a camera sees of a wavy wall; one pixel measured nothing."""
    across, down = np.meshgrid(np.arange(columns) - 7.5, np.arange(rows) - 5.5)
    depth = 2 + 0.01 * np.cos(across)
    points = np.stack([across * depth / 50, down * depth / 50, depth], axis=2).reshape(-1, 3)
    points[20] = np.nan
    head = HEADER.format(rows=rows, columns=columns, count=len(points))
    path.write_text(head + "\n".join(" ".join(map(str, point)) for point in points) + "\n")
    return points


def test_a_mesh_is_read_as_it_is(tmp_path):
    es.write_mesh(BALL, tmp_path / "ball.ply")
    made = es.io.read_surface(tmp_path / "ball.ply")
    assert np.array_equal(made.mesh.vertices, BALL.vertices)
    assert np.array_equal(made.mesh.faces, BALL.faces)
    assert made.report == ()
    assert np.array_equal(made.source_vertices, np.arange(BALL.n_vertices))


@pytest.mark.parametrize("suffix", [".xyz", ".pts", ".ply"])
def test_points_become_a_closed_surface(tmp_path, suffix):
    es.io.write_points(es.PointCloud(BALL.vertices), tmp_path / f"ball{suffix}")
    made = es.io.read_surface(tmp_path / f"ball{suffix}")
    assert es.geometry.is_closed(made.mesh)
    assert len(made.report) == 1
    with pytest.raises(es.FileFormatError, match=r"known format|read_surface makes a surface"):
        es.read_mesh(tmp_path / f"ball{suffix}")


def test_a_frame_is_triangulated_along_its_grid(tmp_path):
    points = write_frame(tmp_path / "frame.pcd")
    made = es.io.read_surface(tmp_path / "frame.pcd")
    assert made.report == (
        "triangulate_frame joined 191 pixels of a frame of 12 x 16 to 328 faces",
    )
    assert np.array_equal(made.mesh.vertices, points[made.source_vertices])


def test_points_that_measured_nothing_or_the_same_are_left_out_and_counted(tmp_path):
    points = np.concatenate([BALL.vertices[:5], [[np.nan] * 3], BALL.vertices])
    head = HEADER.format(rows=1, columns=len(points), count=len(points))
    lines = "\n".join(" ".join(map(str, point)) for point in points)
    (tmp_path / "ball.pcd").write_text(head + lines + "\n")
    made = es.io.read_surface(tmp_path / "ball.pcd")
    assert made.report[:2] == (
        "drop_missing left out 1 point without finite coordinates",
        "drop_duplicate_points removed 5 points at the places of others",
    )
    far = np.linalg.norm(made.mesh.vertices - points[made.source_vertices], axis=1)
    assert far.max() < 0.2


def test_what_is_no_surface_is_refused_by_the_name_of_its_file(tmp_path):
    (tmp_path / "few.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    with pytest.raises(es.InvalidShapeError, match=r"few\.xyz: A cloud must have at least 100"):
        es.io.read_surface(tmp_path / "few.xyz")
    write_frame(tmp_path / "frame.pcd")
    text = (tmp_path / "frame.pcd").read_text().replace("HEIGHT 12", "HEIGHT 11")
    (tmp_path / "frame.pcd").write_text(text)
    with pytest.raises(es.FileFormatError, match=r"as many points as pixels; .* 11 x 16 pixels"):
        es.io.read_surface(tmp_path / "frame.pcd")
    (tmp_path / "curve.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    with pytest.raises(es.FileFormatError, match="it holds 1 segments"):
        es.io.read_surface(tmp_path / "curve.obj")


def test_the_boundary_of_tetrahedra_is_their_surface(tmp_path):
    solid = es.shapes.box(2, 2, 2)
    meshio.write_points_cells(tmp_path / "box.vtu", solid.points, [("tetra", solid.simplices)])
    made = es.io.read_surface(tmp_path / "box.vtu")
    assert made.report == ("boundary_surface took the 48 triangles around 48 tetrahedra",)
    assert np.array_equal(made.mesh.vertices, solid.points[made.source_vertices])
