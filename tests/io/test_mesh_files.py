import os
import stat
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tetrahedra import FACES, FILES, TETRAHEDRON, VERTICES

from eigenshape import (
    FileFormatError,
    InvalidParameterError,
    InvalidShapeError,
    TriangleMesh,
    read_mesh,
    write_mesh,
)

EXACT = [("a.off", False), ("a.obj", False), ("a.ply", False), ("a.ply", True)]
ALL = [*EXACT, ("a.stl", False), ("a.stl", True), ("a.glb", True)]


def names(folder):
    return [path.name for path in folder.iterdir()]


@pytest.mark.parametrize("name", ["a.off", "a.OFF", "a.Obj", "a.PLY", "a.STL", "a.glb", "a.b.Glb"])
def test_suffix_names_the_format_in_any_case(tmp_path, name):
    write_mesh(TETRAHEDRON, tmp_path / name)
    assert read_mesh(str(tmp_path / name)).n_faces == 4
    assert names(tmp_path) == [name]  # nothing is left beside


@pytest.mark.parametrize("file_format", ["off", "OFF", ".off"])
def test_format_can_be_named(tmp_path, file_format):
    path = tmp_path / "mesh"
    path.write_bytes(FILES["off"][1])
    assert read_mesh(path, file_format=file_format).n_faces == 4


coordinates = arrays(
    np.float64, (4, 3), elements=st.floats(allow_nan=False, allow_infinity=False, width=64)
)


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(vertices=coordinates)
@pytest.mark.parametrize(("name", "binary"), EXACT)
def test_every_double_reads_back_exactly(tmp_path, name, binary, vertices):
    write_mesh(TriangleMesh(vertices, FACES), tmp_path / name, binary=binary)
    mesh = read_mesh(tmp_path / name)
    assert mesh.vertices.tobytes() == vertices.tobytes()
    assert mesh.faces.tolist() == FACES


@pytest.mark.parametrize(("name", "binary"), EXACT)
@pytest.mark.parametrize("factor", [1e-100, 0.1, 1e100])
def test_scaled_shapes_read_back_exactly(tmp_path, name, binary, factor):
    vertices = np.random.default_rng(0).normal(size=(2000, 3)) * factor
    faces = np.random.default_rng(1).integers(0, 2000, size=(4000, 3))
    write_mesh(TriangleMesh(vertices, faces), tmp_path / name, binary=binary)
    mesh = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.parametrize("name", ["a.stl", "a.glb"])
def test_single_precision_formats_read_back_in_single_precision(tmp_path, name):
    vertices = np.random.default_rng(0).normal(size=(30, 3))
    faces = np.arange(30).reshape(10, 3)
    write_mesh(TriangleMesh(vertices, faces), tmp_path / name)
    mesh = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(mesh.vertices, vertices.astype(np.float32))
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.parametrize(("name", "binary"), ALL)
def test_binary_or_text_as_asked(tmp_path, name, binary):
    write_mesh(TETRAHEDRON, tmp_path / name, binary=binary)
    assert (b"\0" in (tmp_path / name).read_bytes()) == binary


@pytest.mark.parametrize(("name", "binary"), [("a.off", True), ("a.obj", True), ("a.glb", False)])
def test_binary_where_there_is_none_is_refused(tmp_path, name, binary):
    with pytest.raises(
        InvalidParameterError, match=rf"binary={binary} is for .*; the suffix is \.{name[2:]}"
    ):
        write_mesh(TETRAHEDRON, tmp_path / name, binary=binary)


def test_colors(tmp_path):
    colors = np.full((4, 3), 200, dtype=np.uint8)
    for binary in (False, True):
        write_mesh(TETRAHEDRON, tmp_path / "a.ply", colors=colors, binary=binary)
        np.testing.assert_array_equal(read_mesh(tmp_path / "a.ply").vertices, VERTICES)
        assert b"property uchar green" in (tmp_path / "a.ply").read_bytes()
    with pytest.raises(
        InvalidParameterError,
        match=r"colors must be \(4, 3\) uint8 and go to \.obj, \.ply, \.glb; .* go to \.off",
    ):
        write_mesh(TETRAHEDRON, tmp_path / "a.off", colors=colors)
    with pytest.raises(
        InvalidParameterError, match=r"colors must be \(4, 3\) uint8 .* they are \(3, 3\) uint8"
    ):
        write_mesh(TETRAHEDRON, tmp_path / "a.ply", colors=colors[:3])


@pytest.mark.parametrize("name", ["a.xyz", "a", "a.gl", ".ply"])
def test_unknown_suffix_is_refused_with_the_list_of_known_ones(tmp_path, name):
    with pytest.raises(
        FileFormatError,
        match=r"must be of a known format, \.off, .*, \.glb, \.gltf, \.vtu, .*\.swc; it (is|has)",
    ):
        read_mesh(tmp_path / name)
    with pytest.raises(
        FileFormatError, match=r"known format, \.off, \.obj, \.ply, \.stl, \.glb, .*; it (is|has)"
    ):
        write_mesh(TETRAHEDRON, tmp_path / name)
    assert not names(tmp_path)


@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".stl", ".glb"])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path, suffix):
    (tmp_path / f"folder{suffix}").mkdir()
    (tmp_path / f"device{suffix}").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / f"empty{suffix}").touch()
    for kind in ("folder", "device", "pipe"):
        path = tmp_path / f"{kind}{suffix}"
        with pytest.raises(
            FileFormatError, match=rf"{kind}{suffix} must be a file; it is a {kind}"
        ):
            read_mesh(path)
        with pytest.raises(FileFormatError, match=f"must be a file; it is a {kind}"):
            write_mesh(TETRAHEDRON, path)
    with pytest.raises(FileFormatError, match=rf"empty{suffix} must hold a mesh; it is empty"):
        read_mesh(tmp_path / f"empty{suffix}")
    with pytest.raises(FileNotFoundError, match=f"missing{suffix}"):
        read_mesh(tmp_path / f"missing{suffix}")
    with pytest.raises(FileNotFoundError, match=r"nowhere"):
        write_mesh(TETRAHEDRON, tmp_path / "nowhere" / f"a{suffix}")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read everything")
def test_a_file_that_may_not_be_read(tmp_path):
    write_mesh(TETRAHEDRON, tmp_path / "a.off")
    (tmp_path / "a.off").chmod(0)
    with pytest.raises(PermissionError, match=r"a\.off"):
        read_mesh(tmp_path / "a.off")


def test_errors_name_the_file_and_keep_their_cause(tmp_path):
    path = tmp_path / "a.off"
    path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")
    with pytest.raises(
        InvalidShapeError, match=r"a\.off: faces must index vertices 0\.\.2; face 0 is"
    ) as caught:
        read_mesh(path)
    assert isinstance(caught.value.__cause__, InvalidShapeError)
    path.write_text("OFF\n3 1 0\n")
    with pytest.raises(
        FileFormatError, match=r"a\.off: An OFF file must hold the rows it declares"
    ) as caught:
        read_mesh(path)
    assert isinstance(caught.value.__cause__, FileFormatError)


@pytest.mark.parametrize("failure", [KeyboardInterrupt, OSError("no space")])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, failure):
    path = tmp_path / "a.ply"
    write_mesh(TETRAHEDRON, path)
    before = path.read_bytes()

    def fail(*_):
        raise failure

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(type(failure) if isinstance(failure, OSError) else failure):
        write_mesh(TriangleMesh(VERTICES, FACES[:1]), path)
    assert path.read_bytes() == before
    assert names(tmp_path) == ["a.ply"]


def test_what_does_not_fit_is_refused_and_the_old_file_stays(tmp_path):
    path = tmp_path / "a.stl"
    write_mesh(TETRAHEDRON, path)
    with pytest.raises(
        FileFormatError, match=r"a\.stl cannot hold the mesh\. Binary STL holds single precision"
    ):
        write_mesh(TriangleMesh(TETRAHEDRON.vertices * 1e39, FACES), path)
    assert read_mesh(path).n_faces == 4


def test_a_replaced_file_keeps_its_mode_and_a_new_one_follows_the_mask(tmp_path):
    path = tmp_path / "a.off"
    old = os.umask(0o027)
    try:
        write_mesh(TETRAHEDRON, path)
    finally:
        os.umask(old)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o600)
    write_mesh(TETRAHEDRON, path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
