"""Lines and tags that no real file has are refused before they are split."""

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.files import LONGEST_LINE

LONG = b"1 " * (LONGEST_LINE // 2 + 9)
FILES = {
    "a.obj": b"v 0 0 0\nv " + LONG,
    "a.off": b"OFF\n3 1 0\n0 0 0\n" + LONG,
    "a.stl": b"solid a\nfacet normal 0 0 1\nouter loop\nvertex " + LONG,
    "a.swc": b"1 1 0 0 0 1 -1\n2 1 0 0 1 1 " + LONG,
    "a.xyz": b"0 0 0\n1 0 0\n" + LONG,
    "a.ply": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    b"property float z\nend_header\n" + LONG,
}
LANDMARKS = {
    "a.fcsv": b"# Markups fiducial file version = 4.11\n1," + LONG,
    "a.csv": b"specimen,landmark,x,y,z\n" + LONG,
    "a.tps": b"LM3=1\n0 0 " + LONG,
}


@pytest.mark.parametrize("ending", [b"", b"\n0 0 0\n", b"\r0 0 0\r"])
@pytest.mark.parametrize("name", FILES)
def test_a_line_that_no_shape_has_is_refused(name, ending):
    with pytest.raises(es.FileFormatError, match=r"line \d+ has \d+. Save the file again"):
        es.io.read_shape(FILES[name] + ending, file_format=name[1:])


@pytest.mark.parametrize("name", LANDMARKS)
def test_a_line_that_no_landmarks_have_is_refused(name, tmp_path):
    (tmp_path / name).write_bytes(LANDMARKS[name])
    with pytest.raises(es.FileFormatError, match=r"line \d has \d+. Save the file again"):
        es.morphometrics.read_landmarks(tmp_path / name)


def test_a_long_line_of_a_table_is_refused(tmp_path):
    es.write_mesh(es.icosphere(1), tmp_path / "a.ply")
    (tmp_path / "labels.csv").write_bytes(b"name,label\na," + LONG)
    with pytest.raises(es.FileFormatError, match="line 2 has"):
        es.io.find_items(tmp_path, labels=tmp_path / "labels.csv")


def test_the_longest_line_is_read():
    spaces = b" " * (LONGEST_LINE - 9)
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3" + spaces + b"\n"
    assert es.io.read_shape(text, file_format="obj").n_faces == 1


@pytest.mark.parametrize("suffix", ["vtp", "vtu", "gii"])
@pytest.mark.parametrize("text", [b"<a b='" + LONG + b"'/>", b"<a/>" * 200_001])
def test_tags_that_no_file_has_are_refused(suffix, text):
    with pytest.raises(es.FileFormatError, match="at most 200000 tags"):
        es.io.read_shape(b"<x>" + text + b"</x>", file_format=suffix)


@pytest.mark.parametrize("uri", ["sub\\b.bin", "sub%5Cb.bin", "sub/b.bin"])
def test_a_buffer_with_a_backslash_in_its_path_is_found(uri, tmp_path):
    (tmp_path / "sub").mkdir()
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    (tmp_path / "sub" / "b.bin").write_bytes(points.tobytes())
    _write_gltf(tmp_path / "a.gltf", uri)
    assert es.read_mesh(tmp_path / "a.gltf").n_faces == 1


@pytest.mark.parametrize("uri", ["..\\b.bin", "C:\\b.bin", "x" * 300, "a\\", "x" * 5000])
def test_a_buffer_that_is_nowhere_is_named(uri, tmp_path):
    _write_gltf(tmp_path / "a.gltf", uri)
    with pytest.raises(
        es.FileFormatError, match=r"Buffers of a \.gltf file must lie in its folder"
    ):
        es.read_mesh(tmp_path / "a.gltf")


def _write_gltf(path, uri):
    accessor = '{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}'
    name = uri.replace("\\", "\\\\")
    path.write_text(
        '{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],'
        '"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],'
        f'"accessors":[{accessor}],"bufferViews":[{{"buffer":0,"byteLength":36}}],'
        f'"buffers":[{{"uri":"{name}","byteLength":36}}]}}'
    )
