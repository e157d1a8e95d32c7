"""eigenshape decimate: fewer faces, and what a PLY file holds goes along."""

import numpy as np
import pytest
from running import run, run_json

from eigenshape.io.label_files import read_labels
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.shapes.surfaces import icosphere

BALL = icosphere(3)


@pytest.fixture
def ball(tmp_path):
    colors = np.full((BALL.n_vertices, 3), 40, dtype=np.uint8)
    colors[BALL.vertices[:, 2] > 0, 0] = 240
    labels = (BALL.vertices[BALL.faces].mean(axis=1)[:, 2] > 0).astype(int)
    write_mesh(BALL, tmp_path / "ball.ply", colors=colors, face_labels=labels)
    return tmp_path / "ball.ply"


def test_colors_and_labels_go_along(ball, tmp_path):
    output = tmp_path / "small.ply"
    done = run("decimate", ball, "-n", 200, "-o", output)
    assert "decimate kept 200 of 1,280 faces and 102 of 642 vertices" in done.stdout
    small, attributes = read_mesh(output, attributes=True)
    red = np.zeros(small.n_vertices, dtype=np.uint8)
    red[small.faces] = attributes.colors[..., 0]
    height = small.vertices[:, 2]
    assert (red[height > 0.2] == 240).all()
    assert (red[height < -0.2] == 40).all()
    middle = small.vertices[small.faces].mean(axis=1)[:, 2]
    clear = np.abs(middle) > 0.1
    assert np.array_equal(read_labels(output)[clear], middle[clear] > 0)


def test_the_report_is_json_too(ball, tmp_path):
    found = run_json("decimate", ball, "--ratio", 0.5, "-o", tmp_path / "small.off")
    assert found["n_faces"] == 640
    assert read_mesh(tmp_path / "small.off").n_faces == 640


def test_what_is_asked_must_be_one_number(ball, tmp_path):
    for options in ((), ("-n", 9, "--ratio", 0.5)):
        done = run("decimate", ball, *options, "-o", tmp_path / "small.ply", code=2)
        assert "must be given by one of --n-faces and --ratio" in done.stderr
    done = run("decimate", ball, "-n", 5000, "-o", tmp_path / "small.ply", code=2)
    assert "n_faces must lie in 4..1279; it is 5000" in done.stderr
