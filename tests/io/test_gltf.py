"""glTF with its files beside it: read from its folder, and from nowhere else."""

import json
import os

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from test_glb import unpacked
from tetrahedra import FACES, VERTICES

from eigenshape import EigenshapeError, FileFormatError, read_mesh, read_shape
from eigenshape.io.formats.gltf import parse

TREE, BINARY = unpacked()


def text(uri="a.bin", size=None):
    size = len(BINARY) if size is None else size
    return json.dumps({**TREE, "buffers": [{"byteLength": size, "uri": uri}]}).encode()


@pytest.fixture
def folder(tmp_path):
    """Write numbers into a folder, below it and beside it."""
    inner = tmp_path / "model"
    (inner / "sub dir").mkdir(parents=True)
    for path in (inner / "a.bin", inner / "sub dir" / "b ü.bin", tmp_path / "outside.bin"):
        path.write_bytes(BINARY)
    return inner


@pytest.mark.parametrize(
    "uri", ["a.bin", "./a.bin", "sub%20dir/b%20%C3%BC.bin", "sub dir/../a.bin"]
)
def test_buffers_in_the_folder_and_below(folder, uri):
    (folder / "a.gltf").write_bytes(text(uri))
    for read in (read_mesh, read_shape):
        mesh = read(folder / "a.gltf")
        np.testing.assert_array_equal(mesh.vertices, VERTICES)
        np.testing.assert_array_equal(mesh.faces, FACES)


def test_what_another_program_writes(tmp_path):
    for name, data in trimesh.exchange.gltf.export_gltf(
        trimesh.Trimesh(VERTICES, FACES).scene()
    ).items():
        (tmp_path / name).write_bytes(data)
    path = next(tmp_path.glob("*.gltf"))
    other = trimesh.load_mesh(path, process=False)
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, other.vertices)
    np.testing.assert_array_equal(mesh.faces, other.faces)


@pytest.mark.parametrize(
    "uri",
    [
        "../outside.bin",
        "%2e%2e/outside.bin",
        "sub dir/../../outside.bin",
        "/etc/passwd",
        "{folder}/../outside.bin",
        "file:///etc/passwd",
        "http://x/y.bin",
        "C:/windows/x.bin",
        "link.bin",
        "loop.bin",
        "%00",
        "%ff",
        "data:text/plain,abc",
    ],
)
def test_nothing_outside_of_the_folder_is_opened(folder, uri):
    (folder / "link.bin").symlink_to(folder.parent / "outside.bin")
    (folder / "loop.bin").symlink_to(folder / "loop.bin")
    (folder / "a.gltf").write_bytes(text(uri.format(folder=folder)))
    expected = (
        "must lie in its folder" if uri != "loop.bin" else "must lie in its folder|Too many levels"
    )
    with pytest.raises((FileFormatError, OSError), match=expected):
        read_mesh(folder / "a.gltf")


def test_sizes_and_kinds_of_buffers(folder):
    (folder / "a.gltf").write_bytes(text(size=len(BINARY) + 1))
    with pytest.raises(
        FileFormatError,
        match=rf"buffers\[0\] must have {len(BINARY) + 1} bytes; the file 'a.bin' has",
    ):
        read_mesh(folder / "a.gltf")
    (folder / "a.gltf").write_bytes(text(size=-1))
    with pytest.raises(
        FileFormatError, match="byteLength in a glTF file must be a whole number from 0; it is '-1'"
    ):
        read_mesh(folder / "a.gltf")
    os.mkfifo(folder / "pipe.bin")
    (folder / "a.gltf").write_bytes(text("pipe.bin"))
    with pytest.raises(FileFormatError, match=r"pipe\.bin must be a file; it is a pipe"):
        read_mesh(folder / "a.gltf")
    (folder / "a.gltf").write_bytes(text("."))
    with pytest.raises(FileFormatError, match="lie in its folder"):
        read_mesh(folder / "a.gltf")
    (folder / "a.gltf").write_bytes(text("none.bin"))
    with pytest.raises(FileFormatError, match=r"none\.bin', is not there"):
        read_mesh(folder / "a.gltf")
    (folder / "a.gltf").write_bytes(b"{nodes")
    with pytest.raises(FileFormatError, match=r"and a \.gltf file, must be JSON"):
        read_mesh(folder / "a.gltf")


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_changed_bytes(tmp_path_factory, data):
    folder = tmp_path_factory.getbasetemp() / "changed"
    folder.mkdir(exist_ok=True)
    (folder / "a.bin").write_bytes(BINARY)
    bad = bytearray(text())
    for _ in range(data.draw(st.integers(1, 6))):
        bad[data.draw(st.integers(0, len(bad) - 1))] = data.draw(st.integers(0, 255))
    try:
        vertices, faces = parse(bytes(bad), folder)[:2]
    except (EigenshapeError, OSError):
        return
    assert vertices.shape[1] == faces.shape[1] == 3


def test_a_missing_buffer_is_named_without_the_folder(tmp_path):
    tree = {"asset": {"version": "2.0"}, "buffers": [{"uri": "scene.bin", "byteLength": 12}]}
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    with pytest.raises(FileFormatError, match=r"buffers\[0\], 'scene.bin', is not there") as caught:
        read_mesh(tmp_path / "a.gltf")
    assert str(caught.value).count(str(tmp_path)) == 1  # before the message, which the caller knows
    with pytest.raises(FileFormatError, match=r"the bytes: .*'scene.bin', is not there"):
        read_mesh((tmp_path / "a.gltf").read_bytes())
