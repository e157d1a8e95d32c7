"""OBJ files through repairs and bends: quads, textures and groups stay, and what is written reads back as the mesh."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from eigenshape import FileFormatError, TriangleMesh, read_mesh, write_mesh
from eigenshape.geometry.polygons import cut_polygons
from eigenshape.geometry.repairs.repair import REPAIRS, repair
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.formats.obj import parse, read_sheet
from eigenshape.io.formats.obj_attributes import format_sheet

CUBE = b"""# a cube, its last vertex twice, and one that nothing uses
mtllib cube#1.mtl
o cube
v 0 0 0 0.5 0.5 1
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
v 0 1 1
v 7 7 7
vn 0 0 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
g sides
usemtl wood
f 1/1 4/4 3/3 2/2
f 5/1/1 6/2/1 7/3/1 9/4/1
f 1//1 2//1 6//1 5//1
g rest
f -9/-4 -8/-3 -4/-2 -5/-1
f 3 4 8 7
f 4/1 1/2 5/3 9/4
p 1
"""
L_SHAPE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]


def rewrite(data, mesh, moved=None):
    read = MeshAttributes.plain(TriangleMesh(*parse(data)))
    written = mesh if moved is None else TriangleMesh(moved, mesh.faces)
    return format_sheet(read_sheet(data), carry_attributes(read, mesh), written)


def turned(faces):
    """Return the faces in an order of their own, each begun so that its corners read lowest."""
    return sorted(min(np.roll(face, shift).tolist() for shift in range(3)) for face in faces)


def lines(data, keyword):
    return [line for line in data.decode().splitlines() if line.startswith(f"{keyword} ")]


def test_a_file_that_nothing_changes_keeps_what_it_says():
    vertices, faces = parse(CUBE)
    found = rewrite(CUBE, TriangleMesh(vertices, faces))
    assert lines(found, "f") == [
        "f 1/1 4/4 3/3 2/2", "f 5/1/1 6/2/2 7/3/3 9/4/4", "f 1//5 2//6 6//2 5//1",
        "f 2/1 3/2 7/3 6/4", "f 3 4 8 7", "f 4/1 1/2 5/3 9/4",
    ]  # fmt: skip
    assert lines(found, "v")[0] == "v 0.0 0.0 0.0 0.5 0.5 1"
    assert [line for line in found.decode().splitlines() if line[:2] not in ("v ", "f ", "vn")] == [
        "mtllib cube#1.mtl", "o cube", "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "g sides", "usemtl wood", "g rest",
    ]  # fmt: skip
    np.testing.assert_array_equal(parse(found)[0], vertices)
    np.testing.assert_array_equal(parse(found)[1], faces)


def test_vertices_move_and_polygons_stay():
    vertices, faces = parse(CUBE)
    moved = vertices * 2.5 + np.array([1, 2, 3])
    found = rewrite(CUBE, TriangleMesh(vertices, faces), moved)
    np.testing.assert_array_equal(parse(found)[0], moved)
    assert lines(found, "f")[0] == "f 1/1 4/4 3/3 2/2"


def test_polygons_that_a_reader_would_cut_in_another_way_become_triangles():
    square = b"v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n"
    mesh = TriangleMesh(*parse(square))
    for corner in ([0.5, 1.5, 0], [-1, 1, 0]):  # a dart, and a square that crosses itself
        moved = mesh.vertices.copy()
        moved[1] = corner
        found = rewrite(square, mesh, moved)
        assert lines(found, "f") == ["f 1 2 3", "f 1 3 4"]
        np.testing.assert_array_equal(parse(found)[1], mesh.faces)
    moved[1] = [1, 0.5, 0.1]
    assert lines(rewrite(square, mesh, moved), "f") == ["f 1 2 3 4"]


def test_an_l_shaped_polygon_keeps_its_textures_turned_or_not(tmp_path):
    text = "".join(f"v {x} {y} 0\nvt {x / 3} {y / 3}\n" for x, y in L_SHAPE)
    (tmp_path / "a.obj").write_text(text + "g l\nf 1/1 2/2 3/3 4/4 5/5 6/6\n")
    mesh, attributes = read_mesh(tmp_path / "a.obj", attributes=True)
    assert mesh.n_faces == 4
    np.testing.assert_allclose(
        attributes.texture_coordinates, mesh.vertices[mesh.faces][..., :2] / 3
    )
    write_mesh(mesh, tmp_path / "b.obj", attributes=attributes)
    assert lines((tmp_path / "b.obj").read_bytes(), "f") == ["f 1/1 2/2 3/3 4/4 5/5 6/6"]
    flipped = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    write_mesh(flipped, tmp_path / "b.obj", attributes=carry_attributes(attributes, flipped))
    assert lines((tmp_path / "b.obj").read_bytes(), "f") == ["f 1/1 6/6 5/5 4/4 3/3 2/2"]
    half = TriangleMesh(mesh.vertices, mesh.faces[1:])
    write_mesh(half, tmp_path / "b.obj", attributes=carry_attributes(attributes, half))
    assert len(lines((tmp_path / "b.obj").read_bytes(), "f")) == 3
    assert read_mesh(tmp_path / "b.obj").faces.tolist() == half.faces.tolist()


def test_welded_and_dropped_vertices_are_renumbered():
    mesh = repair(TriangleMesh(*parse(CUBE)), ["weld", "drop_unreferenced"]).mesh
    found = rewrite(CUBE, mesh)
    assert len(lines(found, "v")) == 8
    assert lines(found, "f") == [
        "f 1/1 4/4 3/3 2/2", "f 5/1/1 6/2/2 7/3/3 8/4/4", "f 1//5 2//6 6//2 5//1",
        "f 2/1 3/2 7/3 6/4", "f 3 4 8 7", "f 4/1 1/2 5/3 8/4",
    ]  # fmt: skip


def test_polygons_turn_over_shrink_to_triangles_and_holes_are_sealed():
    vertices, faces = parse(CUBE)
    flipped = np.vstack([faces[:2, ::-1], faces[2:]])
    assert lines(rewrite(CUBE, TriangleMesh(vertices, flipped)), "f")[0] == "f 1/1 2/2 3/3 4/4"
    half = rewrite(CUBE, TriangleMesh(vertices, np.vstack([faces[1:], [[0, 1, 9]]])))
    assert lines(half, "f")[0] == "f 1/1 3/3 2/2"
    assert lines(half, "f")[-1] == "f 1 2 10"
    one_turned = np.vstack([faces[:1, ::-1], faces[1:]])
    assert lines(rewrite(CUBE, TriangleMesh(vertices, one_turned)), "f")[:2] == [
        "f 1/1 3/3 4/4", "f 1/1 3/3 2/2",
    ]  # fmt: skip


def test_faces_at_one_place_keep_their_own_materials(tmp_path):
    """A label on a wall: two equal faces of two materials, beside a face that is dropped."""
    path = tmp_path / "wall.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl none\nf 2 4 3\nusemtl wall\nf 1 2 3\n"
        "usemtl label\nf 1 2 3\n"
    )
    mesh, attributes = read_mesh(path, attributes=True)
    kept = TriangleMesh(mesh.vertices[:3], mesh.faces[1:])
    write_mesh(kept, tmp_path / "b.obj", attributes=carry_attributes(attributes, kept))
    assert (tmp_path / "b.obj").read_text().splitlines()[3:] == [
        "usemtl none", "usemtl wall", "f 1 2 3", "usemtl label", "f 1 2 3",
    ]  # fmt: skip


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_what_is_written_reads_back_as_the_mesh_whatever_was_repaired(data):
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    n_points = data.draw(st.integers(3, 9))
    points = rng.integers(0, 3, size=(n_points, 3))  # many at the same place
    sizes = data.draw(st.lists(st.integers(3, 6), min_size=1, max_size=8))
    polygons = [rng.integers(1, n_points + 1, size=size) for size in sizes]
    starts = np.cumsum([0, *sizes])
    crossed = cut_polygons(points.astype(float), starts, np.concatenate(polygons) - 1)[2]
    polygons = [row for number, row in enumerate(polygons) if number not in crossed]
    assume(polygons)
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    text += "vt 0 0\nvt 1 0\n" + "".join(
        "f " + " ".join(f"{c}/{1 + c % 2}" for c in row) + "\n" for row in polygons
    )
    mesh = TriangleMesh(*parse(text.encode()))
    for name in data.draw(
        st.lists(st.sampled_from(sorted({*REPAIRS} - {"fill_holes"})), max_size=3)
    ):
        try:
            mesh = repair(mesh, [name]).mesh
        except ValueError:  # no face was left
            return
    found = rewrite(text.encode(), mesh)
    vertices, faces = parse(found)
    np.testing.assert_array_equal(vertices, mesh.vertices)
    assert turned(faces) == turned(mesh.faces)


@pytest.mark.data
def test_real_files_come_back(data):
    n_read = 0
    for path in sorted((data / "nasty").rglob("*.obj")):
        text = path.read_bytes()
        try:
            mesh = TriangleMesh(*parse(text))
        except ValueError:
            continue
        found = rewrite(text, mesh)
        np.testing.assert_array_equal(parse(found)[0], mesh.vertices)
        np.testing.assert_array_equal(parse(found)[1], mesh.faces)
        assert len(lines(found, "f")) == len(read_sheet(text).starts) - 1
        n_read += 1
    assert n_read > 30


def test_a_texture_that_is_no_number_is_named():
    with pytest.raises(
        FileFormatError, match="A texture coordinate must be a whole number; line 4 has 'x'"
    ):
        read_sheet(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/x 2 3\n")
