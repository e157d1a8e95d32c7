import numpy as np
import pytest

from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.label_files import write_labels
from eigenshape.io.labeled_shapes import read_label_names, read_labeled_shape, read_labeled_shapes
from eigenshape.io.mesh_files import write_mesh
from eigenshape.shapes.surfaces import icosphere

BALL = icosphere(1)
LABELS = np.arange(80) % 3


def test_labels_lie_beside_a_mesh_in_it_or_elsewhere(tmp_path):
    write_mesh(BALL, tmp_path / "ball.off")
    write_labels(LABELS, tmp_path / "ball.seg")
    write_mesh(BALL, tmp_path / "inside.ply", face_labels=LABELS + 1)
    write_labels(LABELS + 2, tmp_path / "elsewhere.txt")
    beside = read_labeled_shape(tmp_path / "ball.off")
    assert np.array_equal(beside.labels, LABELS)
    assert np.array_equal(beside.mesh.faces, BALL.faces)
    assert np.array_equal(read_labeled_shape(tmp_path / "inside.ply").labels, LABELS + 1)
    given = read_labeled_shape(tmp_path / "ball.off", tmp_path / "elsewhere.txt")
    assert np.array_equal(given.labels, LABELS + 2)
    both = read_labeled_shapes(tmp_path)
    assert list(both) == ["ball", "inside"]


def test_faces_that_are_left_after_repairs_keep_their_labels(tmp_path):
    ball = icosphere(2)
    low, _, high = ball.faces[0]
    vertices = np.vstack([ball.vertices, ball.vertices[[low, high]].mean(axis=0)])
    # Without area: two corners and the point halfway between
    faces = np.vstack([ball.faces, [low, len(vertices) - 1, high]])
    labels = np.append((ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0).astype(int), 7)
    write_mesh(TriangleMesh(vertices, faces), tmp_path / "ball.off")
    write_labels(labels, tmp_path / "ball.seg")
    found = read_labeled_shape(tmp_path / "ball.off", repair=["auto"])
    assert any("without area" in line or "needle" in line for line in found.report), found.report
    assert face_areas(found.mesh).min() > 0
    kept = found.mesh.vertices[found.mesh.faces].mean(axis=1)[:, 2] > 0
    assert np.array_equal(found.labels, kept)


def test_a_mesh_without_labels_is_named_with_the_files_that_would_do(tmp_path):
    write_mesh(BALL, tmp_path / "ball.off")
    with pytest.raises(
        FileFormatError, match=r"ball.off must have labels .* ball.seg, ball.txt, ball.json"
    ):
        read_labeled_shapes(tmp_path)
    write_labels(LABELS[1:], tmp_path / "ball.seg")
    with pytest.raises(InvalidParameterError, match=r"one whole number per face, shape \(80,\)"):
        read_labeled_shapes(tmp_path)


def test_a_folder_without_meshes_is_named(tmp_path):
    with pytest.raises(FileFormatError, match=r"must hold a mesh; .* holds none"):
        read_labeled_shapes(tmp_path)


def test_names_of_labels_are_lines_of_a_file(tmp_path):
    assert read_label_names(tmp_path) == []
    (tmp_path / "names.txt").write_text(" torso\nleg \n", encoding="utf-8")
    assert read_label_names(tmp_path) == ["torso", "leg"]
