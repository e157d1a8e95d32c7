import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from tetrahedra import FACES, FILES, TETRAHEDRON, VERTICES, read

from eigenshape import FileFormatError, InvalidShapeError, read_mesh, write_mesh
from eigenshape.geometry import enclosed_volume
from eigenshape.io.formats.gltf import Gltf, parse, place_triangles

GOOD = FILES["glb"][1]


def packed(tree, binary=b"", extra=b""):
    text = json.dumps(tree).encode() if isinstance(tree, dict) else tree
    body = struct.pack("<I4s", len(text), b"JSON") + text + extra
    body += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def unpacked(data=GOOD):
    n_text = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + n_text]), data[28 + n_text :]


def changed(*path, to, binary=None):
    """Return a good file with one value of its tree changed."""
    tree, old = unpacked()
    place = tree
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return packed(tree, old if binary is None else binary)


def test_written_file_reads_back():
    mesh = read(parse, GOOD)
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.faces, FACES)


def test_another_reader_understands_ours(tmp_path):
    write_mesh(TETRAHEDRON, tmp_path / "a.glb")
    other = trimesh.load_mesh(tmp_path / "a.glb", process=False)
    np.testing.assert_array_equal(other.vertices, VERTICES)
    np.testing.assert_array_equal(other.faces, FACES)


def test_we_understand_another_writer():
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [1, 1, 1])
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    shape = trimesh.Trimesh(VERTICES, FACES, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(shape, node_name="a", geom_name="t", transform=turn)
    scene.add_geometry(shape, node_name="b", geom_name="t", parent_node_name="a", transform=mirror)
    mesh = read(parse, trimesh.exchange.gltf.export_glb(scene))
    assert (mesh.n_vertices, mesh.n_faces) == (8, 8)
    corners = np.column_stack([VERTICES, np.ones(4)])
    wanted = np.concatenate([corners @ turn.T, corners @ (turn @ mirror).T])[:, :3]
    np.testing.assert_allclose(mesh.vertices, wanted, atol=1e-6)
    assert enclosed_volume(mesh) == pytest.approx(2 / 6)  # the mirrored one is not inside out


def test_nodes_move_turn_and_scale_in_this_order():
    node = {
        "mesh": 0,
        "translation": [10, 0, 0],
        "rotation": [0, 0, 0.5**0.5, 0.5**0.5],
        "scale": [2, 1e-3, -3],
    }
    tree, binary = unpacked()
    tree["nodes"] = [{"children": [1], "translation": [0, 0, 100]}, node]
    mesh = read(parse, packed(tree, binary))
    # A quarter turn about z takes x to y and y to -x.
    wanted = [[10, 0, 100], [10, 2, 100], [10 - 1e-3, 0, 100], [10, 0, 97]]
    np.testing.assert_allclose(mesh.vertices, wanted, atol=1e-12)
    assert enclosed_volume(mesh) == pytest.approx(6e-3 / 6)
    tree["nodes"][1] = {"mesh": 0, "matrix": [0, 2, 0, 0, -1e-3, 0, 0, 0, 0, 0, -3, 0, 10, 0, 0, 1]}
    np.testing.assert_allclose(read(parse, packed(tree, binary)).vertices, wanted, atol=1e-12)


def test_mirror_is_seen_however_small():
    assert (
        read(parse, changed("nodes", 0, "scale", to=[-1e-120] * 3)).faces[0].tolist()
        == FACES[0][::-1]
    )


def test_without_scenes_all_nodes_count_and_with_them_those_of_the_chosen():
    tree, binary = unpacked()
    tree["nodes"] = [{"mesh": 0, "children": [1]}, {"mesh": 0}, {"mesh": 0}]
    tree["scenes"] = [{"nodes": [0]}, {"nodes": [2]}]
    assert read(parse, packed(tree, binary)).n_faces == 8
    assert read(parse, packed({**tree, "scene": 1}, binary)).n_faces == 4
    del tree["scenes"]
    assert read(parse, packed(tree, binary)).n_faces == 12


def primitive(mode, n_corners, indices=range(6)):
    """A file of six points on a line that is bent, and one primitive."""
    points = np.array([[i, i % 2, 0] for i in range(6)], "<f4")
    corners = np.array([*indices][:n_corners], "<u2")
    tree = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"},
            {
                "bufferView": 0,
                "byteOffset": 72,
                "componentType": 5123,
                "count": len(corners),
                "type": "SCALAR",
            },
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 72 + corners.nbytes}],
        "buffers": [{"byteLength": 72 + corners.nbytes}],
    }
    return tree, points.tobytes() + corners.tobytes()


@pytest.mark.parametrize(
    ("mode", "wanted"),
    [
        (4, [[0, 1, 2], [3, 4, 5]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]),
        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]]),
    ],
)
def test_triangles_strips_and_fans(mode, wanted):
    tree, binary = primitive(mode, 6)
    assert read(parse, packed(tree, binary)).faces.tolist() == wanted
    del tree["meshes"][0]["primitives"][0]["indices"]
    assert read(parse, packed(tree, binary)).faces.tolist() == wanted


def test_parts_of_one_mesh_share_the_vertices_they_share_in_the_file():
    tree, binary = primitive(4, 6)
    tree["meshes"][0]["primitives"] += [
        {"attributes": {"POSITION": 0}, "mode": 6},
        {"attributes": {"POSITION": 0}, "mode": 1},
    ]
    mesh = read(parse, packed(tree, binary))
    assert (mesh.n_vertices, mesh.n_faces) == (6, 6)


def test_interleaved_and_normalized_numbers_and_data_uris():
    rows = b"".join(
        struct.pack("<hhhH", *row, 77) for row in [(0, 0, 0), (32767, 0, 0), (0, -32768, 0)]
    )
    uri = "data:application/octet-stream;base64," + base64.b64encode(rows).decode()
    tree = {
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "accessors": [
            {"bufferView": 0, "componentType": 5122, "normalized": True, "count": 3, "type": "VEC3"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}],
        "buffers": [{"byteLength": 24, "uri": uri}],
        "extensionsRequired": ["KHR_mesh_quantization"],
    }
    assert read(parse, packed(tree)).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, -1, 0]]


def test_unknown_chunks_are_passed_over():
    tree, binary = unpacked()
    assert (
        read(parse, packed(tree, binary, extra=struct.pack("<I4s", 4, b"WHAT") + b"else")).n_faces
        == 4
    )


DEEP = b"[" * 100_000
CASES = {
    "no magic": (b"GLTF" + GOOD[4:], "must begin with glTF, version 2 and its length; it begins with 'GLTF'"),
    "short": (b"glTF", "must begin with glTF, version 2 and its length"),
    "version": (GOOD[:4] + b"\1" + GOOD[5:], "version 2 and its length; it begins with 'glTF', 1 and"),
    "cut": (GOOD[:-1], f"and {len(GOOD)}, and has {len(GOOD) - 1} bytes"),
    "chunk": (GOOD[:12] + b"\xff\xff\xff\x7f" + GOOD[16:], "must end within it; one ends at 2147483667"),
    "no chunk": (b"glTF" + struct.pack("<II", 2, 12), "The first chunk of a GLB file, and a .gltf file, must be JSON"),
    "no json": (packed(b"{nodes"), "The first chunk of a GLB file, and a .gltf file, must be JSON"),
    "deep json": (packed(DEEP), "The first chunk of a GLB file, and a .gltf file, must be JSON"),
    "no object": (packed(b"[1]"), "The JSON of a glTF file must be an object; it is a list"),
    "nothing": (packed({}), "A glTF file must hold triangles; it holds none"),
    "points": (packed(*primitive(0, 6)), "A glTF file must hold triangles; it holds none"),
    "five corners": (packed(*primitive(4, 5)), "Triangles must have three corners each; a primitive has 5 in all"),
    "corner": (packed(*primitive(4, 6, [0, 1, 6, 0, 1, 2])), r"must be whole and within 0\.\.5; index 2 is 6"),
    "outside": (changed("buffers", 0, "uri", to="/etc/passwd"), r"buffers\[0\] points outside, to '/etc/passwd'"),
    "far": (changed("buffers", 0, "uri", to="http://x/y"), r"buffers\[0\] points outside, to 'http://x/y'"),
    "base64": (changed("buffers", 0, "uri", to="data:a;base64,?"), r"must be in base64; buffers\[0\] is not"),
    "extension": (changed("extensionsRequired", to=["KHR_draco_mesh_compression"]), r"must hold its geometry plainly"),
    "unknown extension": (changed("extensionsRequired", to=["X_holes"]), "it requires the extension 'X_holes'"),
    "no such mesh": (changed("nodes", 0, "mesh", to=1), r"it names meshes\[1\] and holds none"),
    "odd mesh": (changed("nodes", 0, "mesh", to=[0]), r"it names meshes\[\[0\]\] and holds none"),
    "no such node": (changed("scenes", 0, "nodes", to=[7]), r"it names nodes\[7\] and holds none"),
    "odd list": (changed("scenes", 0, "nodes", to=7), "nodes of a glTF file must be a list; it is '7'"),
    "loop": (changed("nodes", 0, "children", to=[0]), "must form trees; node 0 is met twice"),
    "zero turn": (changed("nodes", 0, "rotation", to=[0, 0, 0, 0]), "must be a quaternion other than zero"),
    "odd scale": (changed("nodes", 0, "scale", to=[1, 1]), r"must be 3 finite numbers; it is '\[1, 1\]'"),
    "huge scale": (changed("nodes", 0, "scale", to=[1, 1, 10**400]), "scale of a node must be 3 finite numbers"),
    "nan": (changed("nodes", 0, "matrix", to=[float("nan")] * 16), "matrix of a node must be 16 finite numbers"),
    "type": (changed("accessors", 0, "type", to="VEC4"), r"rows of 3 numbers .*; it has 'VEC4' of type 5126"),
    "component": (changed("accessors", 0, "componentType", to=9), r"rows of 3 numbers .*; it has 'VEC3' of type 9"),
    "sparse": (changed("accessors", 0, "sparse", to={}), "count in a glTF file must be a whole number"),
    "extensions": (changed("nodes", 0, "extensions", to=[]), r"extensions of a glTF file must be an object"),
    "scene": (changed("scene", to=2), "must be one that it holds, 0; it is '2'"),
    "no view": (changed("accessors", 0, "bufferView", to=None), r"it names bufferViews\[None\] and holds none"),
    "many": (changed("accessors", 0, "count", to=2**31), "2147483648 rows do not fit 48 bytes"),
    "stride": (changed("bufferViews", 0, "byteStride", to=4), r"accessors\[0\] must lie in its buffer"),
    "true": (changed("accessors", 0, "count", to=True), "must be a whole number from 0; it is 'True'"),
    "negative": (changed("accessors", 0, "count", to=-1), "count in a glTF file must be a whole number from 0"),
    "no position": (changed("meshes", 0, "primitives", 0, "attributes", to={}), "POSITION in a glTF file must be"),
    "no buffer": (changed("bufferViews", 0, "buffer", to=3), "4 rows do not fit 0 bytes"),
    "no data": (changed("scene", to=0, binary=b""), "4 rows do not fit 0 bytes"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_broken_files_are_refused(name):
    data, message = CASES[name]
    with pytest.raises(FileFormatError, match=message):
        parse(data)


@pytest.mark.parametrize("copied", ["nodes", "primitives"])
def test_copies_are_bounded(copied):
    tree, binary = unpacked()
    del tree["scenes"]
    if copied == "nodes":
        tree["nodes"] *= 10
    else:
        tree["meshes"][0]["primitives"] *= 10
    assert len(place_triangles(Gltf(tree, [binary], most=100)).nodes) == 40
    with pytest.raises(
        FileFormatError, match="must stay within 50 vertices and faces; its copies make more"
    ):
        place_triangles(Gltf(tree, [binary], most=50))


def test_not_finite_coordinates_are_refused(tmp_path):
    tree, binary = unpacked()
    path = tmp_path / "a.glb"
    path.write_bytes(packed(tree, np.float32(np.inf).tobytes() + binary[4:]))
    with pytest.raises(InvalidShapeError, match=r"a\.glb: vertices must be finite; vertex 0"):
        read_mesh(path)


def test_single_precision_refuses_what_it_cannot_hold(tmp_path):
    with pytest.raises(
        FileFormatError, match=r"GLB holds single precision, up to 3.4e38; vertex 1"
    ):
        write_mesh((TETRAHEDRON.vertices * 1e39, FACES), tmp_path / "a.glb")
