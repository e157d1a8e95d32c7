import numpy as np
import pytest
import trimesh
from tetrahedra import TETRAHEDRON

import eigenshape as es
from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.io.label_files import read_labels, write_labels
from eigenshape.io.mesh_files import read_mesh, write_mesh


def read(tmp_path, text, name="a.seg"):
    path = tmp_path / name
    path.write_text(text)
    return read_labels(path)


@pytest.mark.parametrize(
    "text", ["3\n-1\n7\n", " 3 \r\n-1\r\n\r\n7", "# parts\n3 # head\n-1\n+7\n"]
)
def test_a_whole_number_a_line(tmp_path, text):
    found = read(tmp_path, text)
    assert found.dtype == np.int64
    assert found.tolist() == [3, -1, 7]


def test_labels_come_back_as_they_were_written(tmp_path):
    labels = np.array([0, 5, -2, 2**62 + 1])
    write_labels(labels, tmp_path / "labels.txt")
    assert np.array_equal(read_labels(tmp_path / "labels.txt"), labels)


def test_labels_out_of_json(tmp_path):
    assert read(tmp_path, '{"parts": [], "face_labels": [2, 0, 2]}', "a.JSON").tolist() == [2, 0, 2]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "a.seg",
            "1\nhead\n",
            r"a\.seg: A label must be a whole number; line 2 has 'head' in 'head'",
        ),
        ("a.seg", "1\n\n2.5\n", r"a\.seg: A label must be a whole number; line 3 has '2\.5'"),
        ("a.seg", "1 2\n3 4\n", r"a\.seg: A label must be a whole number; line 1 has '1 2'"),
        ("a.seg", "1\n2 3\n", r"a\.seg: A label must be a whole number; line 2 has '2 3'"),
        (
            "a.seg",
            f"{2**63}\n",
            r"a\.seg: A label must fit into 64 bits; line 1 has '9223372036854775808'",
        ),
        ("a.seg", "", r"a\.seg must hold labels; it is empty"),
        (
            "a.json",
            "{",
            r"a\.json: A \.json file of labels must hold JSON; it does not: Expecting property name",
        ),
        ("a.json", "[" * 10**6, r"a\.json: A \.json file of labels must hold JSON"),
        ("a.json", "[1, 2]", r'a\.json: A \.json file of labels must have a list "face_labels"'),
        (
            "a.json",
            '{"face_labels": 3}',
            r'a\.json: A \.json file of labels must have a list "face_labels"',
        ),
        (
            "a.json",
            '{"face_labels": [1, "x"]}',
            r"a\.json: Labels must be whole numbers of 64 bits; that of face 1 is 'x'",
        ),
        ("a.json", '{"face_labels": [true]}', r"that of face 0 is True"),
        ("a.json", '{"face_labels": [1.0]}', r"that of face 0 is 1\.0"),
        ("a.json", f'{{"face_labels": [{2**63}]}}', r"that of face 0 is 9223372036854775808"),
    ],
)
def test_what_is_no_label_is_named(tmp_path, name, text, message):
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path, text, name)


@pytest.mark.parametrize("binary", [True, False])
def test_labels_in_a_mesh_file_read_back_with_colors_or_without(tmp_path, binary):
    labels = np.array([7, -1, 2**31 - 1, 0])
    colors = np.full((4, 3), 9, dtype=np.uint8)
    for options in ({}, {"colors": colors}):
        write_mesh(TETRAHEDRON, tmp_path / "a.ply", binary=binary, face_labels=labels, **options)
        assert read_labels(tmp_path / "a.ply").tolist() == labels.tolist()
        np.testing.assert_array_equal(read_mesh(tmp_path / "a.ply").faces, TETRAHEDRON.faces)
    other = trimesh.load(tmp_path / "a.ply", process=False)
    assert other.metadata["_ply_raw"]["face"]["data"]["label"].ravel().tolist() == labels.tolist()


def test_labels_of_polygons_are_those_of_their_triangles(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 5\n"
    head += "property float x\nproperty float y\nproperty float z\nelement face 2\n"
    rows = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n"
    for kind, of_faces in (
        ("int", "6 4 0 1 2 3\n9 3 0 1 4\n"),
        ("uchar", "6 4 0 1 2 3\n9 3 0 1 4\n"),
    ):
        columns = f"property {kind} label\nproperty list uchar int vertex_indices\nend_header\n"
        (tmp_path / "a.ply").write_text(head + columns + rows + of_faces)
        assert read_labels(tmp_path / "a.ply").tolist() == [6, 6, 9]
    columns = "property float label\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + columns + rows + "6.5 4 0 1 2 3\nnan 3 0 1 4\n")
    with pytest.raises(
        FileFormatError, match=r"a\.ply: The property label of faces must be a whole number"
    ):
        read_labels(tmp_path / "a.ply")


def test_labels_that_do_not_fit_are_refused(tmp_path):
    with pytest.raises(
        InvalidParameterError,
        match=r"face_labels must be \(4,\) and go to \.obj, \.ply, \.glb; .* go to \.off",
    ):
        write_mesh(TETRAHEDRON, tmp_path / "a.off", face_labels=np.zeros(4, int))
    with pytest.raises(
        InvalidParameterError, match=r"face_labels must be \(4,\) .* they are \(3,\)"
    ):
        write_mesh(TETRAHEDRON, tmp_path / "a.ply", face_labels=np.zeros(3, int))
    with pytest.raises(
        InvalidParameterError, match="must fit into 32 bits; that of face 1 is 2147483648"
    ):
        write_mesh(TETRAHEDRON, tmp_path / "a.ply", face_labels=np.array([0, 2**31, 0, 0]))
    write_mesh(TETRAHEDRON, tmp_path / "a.ply")
    with pytest.raises(FileFormatError, match="must have a property label; they have none"):
        read_labels(tmp_path / "a.ply")


def test_parcels_of_vertices_are_no_labels_of_faces(tmp_path):
    path = tmp_path / "lh.motor.label"
    path.write_text("#!ascii label\n2\n0 0 0 0 0\n3 0 0 0 0\n")
    for name in (path, tmp_path / "lh.aparc.annot", tmp_path / "a.label.gii"):
        with pytest.raises(
            FileFormatError, match=r"must be those of faces; .* parcels of vertices"
        ):
            read_labels(name)
    mesh = es.icosphere(0)  # what the message advises
    labels = es.io.read_parcellation(path, mesh).labels[mesh.faces[:, 0]]
    write_labels(labels, tmp_path / "labels.txt")
    assert read_labels(tmp_path / "labels.txt").tolist() == labels.tolist()
    assert set(labels.tolist()) == {-1, 0}
