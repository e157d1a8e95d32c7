"""Files as they come: packed, as bytes, open, or with another format inside than their name says."""

import gzip
from io import BytesIO, StringIO
from pathlib import Path

import numpy as np
import pytest
from tetrahedra import TETRAHEDRON

import eigenshape as es
from eigenshape.io.formats import gltf_attributes, off, ply, vtk
from eigenshape.io.formats.first_bytes import KINDS
from eigenshape.io.opening import unpack_gzip

PLY, OFF = ply.format_binary(TETRAHEDRON), off.format_text(TETRAHEDRON)
WRITTEN = {
    ".ply": PLY,
    ".off": OFF,
    ".obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
    ".vtk": vtk.format_fields(TETRAHEDRON, {}, {}),
}


def is_tetrahedron(mesh):
    return np.array_equal(mesh.vertices, TETRAHEDRON.vertices) and np.array_equal(
        mesh.faces, TETRAHEDRON.faces
    )


@pytest.mark.parametrize("suffix", WRITTEN)
def test_a_packed_file_is_unpacked(tmp_path, suffix):
    path = tmp_path / f"a{suffix}.gz"
    path.write_bytes(gzip.compress(WRITTEN[suffix]))
    assert is_tetrahedron(es.read_mesh(path))
    assert is_tetrahedron(es.io.read_surface(path).mesh)


def test_a_packed_file_may_have_several_members_and_a_plain_name(tmp_path):
    path = tmp_path / "a.off"
    path.write_bytes(gzip.compress(OFF[:20]) + gzip.compress(OFF[20:]))
    assert is_tetrahedron(es.read_mesh(path))


def test_packed_files_are_found_in_folders(tmp_path):
    (tmp_path / "cats").mkdir()
    (tmp_path / "cats" / "felix.ply.gz").write_bytes(gzip.compress(PLY))
    (item,) = es.io.find_items(tmp_path)
    assert (item.name, item.label) == ("cats/felix", "cats")


@pytest.mark.parametrize(
    "read", [es.read_mesh, es.read_shape, lambda f: es.io.read_surface(f).mesh]
)
def test_bytes_and_open_files_are_read(tmp_path, read):
    path = tmp_path / "a.ply"
    path.write_bytes(PLY)
    with path.open("rb") as file:
        assert is_tetrahedron(read(file))
    assert is_tetrahedron(read(PLY))
    assert is_tetrahedron(read(BytesIO(gzip.compress(OFF))))


def test_bytes_without_the_name_of_their_format_take_it(tmp_path):
    data = WRITTEN[".obj"]
    with pytest.raises(es.InvalidParameterError, match="file_format must be given"):
        es.read_mesh(data)
    assert is_tetrahedron(es.read_mesh(data, file_format=".obj"))  # the remedy
    path = tmp_path / "a.obj"
    path.write_bytes(data)
    with path.open("rb") as file:  # which has a name
        assert is_tetrahedron(es.read_mesh(file))


def test_materials_beside_bytes_are_not_looked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.mtl").write_text("newmtl bone\nKd 1 0 0\n")
    data = b"mtllib a.mtl\nusemtl bone\n" + WRITTEN[".obj"]
    _, attributes = es.read_mesh(data, file_format=".obj", attributes=True)
    assert attributes.materials[0].color == (1.0, 1.0, 1.0, 1.0)
    (tmp_path / "a.obj").write_bytes(data)
    _, attributes = es.read_mesh("a.obj", attributes=True)
    assert attributes.materials[0].color == (1.0, 0.0, 0.0, 1.0)


def test_a_text_file_and_nothing_are_refused():
    with pytest.raises(es.InvalidParameterError, match="opened for bytes"):
        es.read_mesh(StringIO("OFF"))
    with pytest.raises(es.FileFormatError, match="there are none"):
        es.read_mesh(b"")


def test_packed_data_must_be_whole():
    packed = gzip.compress(PLY)
    with pytest.raises(es.FileFormatError, match="ends too early"):
        unpack_gzip(packed[:-4])
    with pytest.raises(es.FileFormatError, match="damaged"):
        unpack_gzip(packed[:30] + b"\xff" * 30 + packed[60:])


def test_packed_data_have_a_limit():
    with pytest.raises(es.FileFormatError, match="at most 40 times"):
        unpack_gzip(gzip.compress(bytes(2**26)))


# The beginning of a file, and a word of the message that names it
OTHERS = {
    b"<!DOCTYPE html><html>": "a page of HTML",
    b"\n<html lang='en'>": "a page of HTML",
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode("utf-16"): "UTF-16",
    b"PK\x03\x04" + bytes(30): "ZIP",
    b"BZh91AY&SY": "packed",
    b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n": "git lfs pull",
    b"Kaydara FBX Binary  \x00": "FBX",
    b"; FBX 7.4.0 project file\n": "FBX",
    b"BLENDER-v402": "Blender",
    b"\x89HDF\r\n\x1a\n": "HDF5",
    b"\x89PNG\r\n\x1a\n": "picture",
    b'<?xml version="1.0"?>\n<COLLADA xmlns="x">': "COLLADA",
    b"#VRML V2.0 utf8\n": "VRML",
    b"ISO-10303-21;\n": "STEP",
}


@pytest.mark.parametrize("data", OTHERS)
def test_a_file_of_another_kind_is_named(tmp_path, data):
    path = tmp_path / "a.obj"
    path.write_bytes(data)
    with pytest.raises(es.FileFormatError, match=f"must hold that format; it is .*{OTHERS[data]}"):
        es.read_mesh(path)


def test_a_format_under_the_name_of_another_one_is_named_and_read_as_it_is(tmp_path):
    made = {suffix: data for suffix, data in WRITTEN.items() if suffix != ".obj"}
    made[".glb"] = gltf_attributes.write_new(es.read_mesh(PLY, attributes=True)[1], TETRAHEDRON)
    for suffix, data in made.items():
        path = tmp_path / "a.stl"
        path.write_bytes(data)
        with pytest.raises(es.FileFormatError, match=f"Let its name end in {suffix}"):
            es.read_mesh(path)
        assert is_tetrahedron(es.read_mesh(path, file_format=suffix))
        assert is_tetrahedron(es.read_mesh(path.rename(Path(tmp_path, f"a{suffix}"))))


def test_every_kind_is_tried():
    assert len(KINDS) == len({kind.noun for kind in KINDS.values()})


def test_a_file_is_not_written_packed(tmp_path):
    with pytest.raises(es.FileFormatError, match=r"written unpacked; .*a\.ply\.gz"):
        es.write_mesh(TETRAHEDRON, tmp_path / "a.ply.gz")
    es.write_mesh(TETRAHEDRON, tmp_path / "a.ply")  # the remedy
    (tmp_path / "a.ply.gz").write_bytes(gzip.compress((tmp_path / "a.ply").read_bytes()))
    assert is_tetrahedron(es.read_mesh(tmp_path / "a.ply.gz"))


def test_only_some_formats_have_scenes():
    with pytest.raises(es.InvalidParameterError, match=r"scene is for .* the suffix is \.ply"):
        es.read_mesh(PLY, scene="roof")


FAR = np.array([500000.0, 4000000.0, 0.0])


@pytest.mark.parametrize("name", ["a.stl", "a.gii", "a.surf"])
def test_what_single_precision_changes_is_refused_or_named(tmp_path, name):
    ball = es.icosphere(3)
    far = es.TriangleMesh(ball.vertices + FAR, ball.faces)
    with pytest.raises(es.FileFormatError, match=r"changes the area by .* Write \.ply"):
        es.write_mesh(far, tmp_path / name)
    assert not (tmp_path / name).exists()
    es.write_mesh(far, tmp_path / "a.ply")  # the remedy
    assert np.array_equal(es.read_mesh(tmp_path / "a.ply").vertices, far.vertices)
    near = es.TriangleMesh(far.vertices - far.vertices.mean(axis=0), far.faces)
    es.write_mesh(near, tmp_path / name)
    area = es.geometry.surface_area(es.read_mesh(tmp_path / name))
    assert area == pytest.approx(es.geometry.surface_area(ball), rel=1e-6)
    large = es.TriangleMesh(50 * ball.vertices + FAR, ball.faces)  # sides of 7, rounded to 0.25
    with pytest.warns(UserWarning, match="does not keep: the exact shape of .* faces"):
        es.write_mesh(large, tmp_path / name)


def test_text_and_double_precision_keep_a_shape_far_away(tmp_path):
    ball = es.icosphere(2)
    far = es.TriangleMesh(ball.vertices + FAR, ball.faces)
    for name in ("a.ply", "a.obj", "a.off", "a.vtk", "a.vtu"):
        es.write_mesh(far, tmp_path / name)
        assert np.array_equal(es.read_mesh(tmp_path / name).vertices, far.vertices)
