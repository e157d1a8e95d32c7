"""What a file holds besides its shape comes through: 30 files of several writers, bent, repaired and labeled."""

import base64
import io
import json
import re
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

import eigenshape as es
from eigenshape import FileFormatError, InvalidParameterError
from eigenshape.io.attributes import MeshAttributes, linear_colors, screen_colors
from eigenshape.io.formats.gltf import pack, read_gltf
from eigenshape.io.formats.obj import read_sheet
from eigenshape.io.mesh_files import save_mesh

PNG = io.BytesIO()
Image.fromarray(np.arange(192, dtype=np.uint8).reshape(8, 8, 3)).save(PNG, "PNG")
PNG = PNG.getvalue()
JPEG = io.BytesIO()
Image.fromarray(np.arange(192, dtype=np.uint8).reshape(8, 8, 3)).save(JPEG, "JPEG")
JPEG = JPEG.getvalue()
# A square pyramid whose base has a seam: vertices 0 and 5 lie at one place.
VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1], [0, 0, 0]], "<f4")
FACES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 5, 4], [5, 3, 2], [5, 2, 1]])
UV = np.array([[0, 0], [0.25, 0], [0.5, 0], [0.75, 0], [0.5, 1], [1, 0]], "<f4")
NORMALS = (VERTICES - [0.5, 0.5, 0.25]) / np.linalg.norm(
    VERTICES - [0.5, 0.5, 0.25], axis=1, keepdims=True
)
KINDS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """A glTF file in the making."""

    def __init__(self):
        self.binary = b""
        self.tree = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "pyramid"}], "meshes": [{"primitives": []}],
            "accessors": [], "bufferViews": [], "buffers": [{}],
            "materials": [{"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}], "images": [{"name": "grain"}],
        }  # fmt: skip

    def view(self, data, **more):
        self.binary += b"\0" * (-len(self.binary) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        self.tree["bufferViews"].append(entry)
        self.binary += data
        return len(self.tree["bufferViews"]) - 1

    def add(self, rows, view=None, **more):
        rows = np.asarray(rows)
        rows = rows.reshape(len(rows), -1)
        entry = {
            "bufferView": self.view(rows.tobytes()) if view is None else view,
            "componentType": KINDS[rows.dtype.str[1:]], "count": len(rows), "type": TYPES[rows.shape[1]], **more,
        }  # fmt: skip
        self.tree["accessors"].append(entry)
        return len(self.tree["accessors"]) - 1

    def primitive(self, faces=FACES, kind="<u2", **attributes):
        table = {"POSITION": self.add(VERTICES), "NORMAL": self.add(NORMALS.astype("<f4"))}
        table |= {"TEXCOORD_0": self.add(UV)} | attributes
        indices = self.add(faces.ravel().astype(kind))
        part = {"attributes": table, "indices": indices, "material": 0}
        self.tree["meshes"][0]["primitives"].append(part)
        return part

    def save(self, folder, name="a.glb"):
        if "uri" not in self.tree["images"][0]:
            self.tree["images"][0] |= {"bufferView": self.view(PNG), "mimeType": "image/png"}
        self.tree["buffers"] = [{"byteLength": len(self.binary)}]
        path = folder / name
        if name.endswith(".glb"):
            path.write_bytes(pack(self.tree, self.binary))
        else:
            self.tree["buffers"][0]["uri"] = "a.bin"
            (folder / "a.bin").write_bytes(self.binary)
            path.write_text(json.dumps(self.tree))
        return path


def colored(rows, **more):
    def make(gltf):
        gltf.primitive(COLOR_0=gltf.add(rows, **more))

    return make


def plain(gltf):
    gltf.primitive()


def byte_indices(gltf):
    gltf.primitive(kind="u1")


def long_indices(gltf):
    gltf.primitive(kind="<u4")


def several_primitives(gltf):
    gltf.primitive(FACES[:3])
    gltf.primitive(FACES[3:])["material"] = 1
    gltf.tree["materials"].append({"name": "iron", "pbrMetallicRoughness": {"metallicFactor": 1.0}})


def shared_vertices(gltf):
    part = gltf.primitive(FACES[:3])
    indices = gltf.add(FACES[3:].ravel().astype("<u2"))
    gltf.tree["meshes"][0]["primitives"].append({**part, "indices": indices, "material": 1})
    gltf.tree["materials"].append({"name": "iron"})


def turned_nodes(gltf):
    gltf.primitive()
    turned = {"rotation": [0, 0.6, 0, 0.8], "scale": [2, 1, 3], "translation": [5, 0, 0]}
    gltf.tree["nodes"] = [
        {"name": "root", "children": [1, 2], **turned}, {"name": "left", "mesh": 0},
        {"name": "right", "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 0, 0, 1]},
    ]  # fmt: skip


def skinned(gltf):
    joints = np.zeros((6, 4), "u1")
    weights = np.tile(np.array([255, 0, 0, 0], "u1"), (6, 1))
    gltf.primitive(JOINTS_0=gltf.add(joints), WEIGHTS_0=gltf.add(weights, normalized=True))
    bind = gltf.add(np.eye(4, dtype="<f4").reshape(1, 16))
    times, turns = gltf.add(np.array([0, 1], "<f4")), gltf.add(np.array([[0, 0, 0, 1]] * 2, "<f4"))
    gltf.tree["nodes"] += [{"name": "joint"}]
    gltf.tree["nodes"][0]["skin"] = 0
    gltf.tree["scenes"][0]["nodes"].append(1)
    gltf.tree["skins"] = [{"joints": [1], "inverseBindMatrices": bind}]
    channel = {"sampler": 0, "target": {"node": 1, "path": "rotation"}}
    gltf.tree["animations"] = [
        {"channels": [channel], "samplers": [{"input": times, "output": turns}]}
    ]


def morphed(gltf):
    gltf.primitive()["targets"] = [{"POSITION": gltf.add(0.1 * NORMALS.astype("<f4"))}]
    gltf.tree["meshes"][0]["weights"] = [0.5]


def interleaved(gltf):
    block = np.hstack([VERTICES, NORMALS.astype("<f4"), UV])
    view = gltf.view(block.tobytes(), byteStride=32)
    table = {
        "POSITION": gltf.add(VERTICES, view), "NORMAL": gltf.add(VERTICES, view, byteOffset=12),
        "TEXCOORD_0": gltf.add(UV, view, byteOffset=24),
    }  # fmt: skip
    indices = gltf.add(FACES.ravel().astype("<u2"))
    gltf.tree["meshes"][0]["primitives"] = [
        {"attributes": table, "indices": indices, "material": 0}
    ]


def without_indices(gltf):
    corners = FACES.ravel()
    table = {"POSITION": gltf.add(VERTICES[corners]), "TEXCOORD_0": gltf.add(UV[corners])}
    gltf.tree["meshes"][0]["primitives"] = [{"attributes": table, "material": 0}]


def quantized(gltf):
    table = {"POSITION": gltf.add(np.pad((VERTICES * 2).astype("<i2"), ((0, 0), (0, 0))))}
    table["TEXCOORD_0"] = gltf.add((UV * 65535).astype("<u2"), normalized=True)
    indices = gltf.add(FACES.ravel().astype("u1"))
    gltf.tree["meshes"][0]["primitives"] = [
        {"attributes": table, "indices": indices, "material": 0}
    ]
    gltf.tree["nodes"][0]["scale"] = [0.5, 0.5, 0.5]
    gltf.tree["extensionsUsed"] = gltf.tree["extensionsRequired"] = ["KHR_mesh_quantization"]


def extended(gltf):
    gltf.primitive(_HEAT=gltf.add(np.arange(6, dtype="<f4")), TEXCOORD_1=gltf.add(UV[::-1].copy()))
    gltf.tree["materials"][0] |= {
        "doubleSided": True, "emissiveFactor": [0.1, 0.2, 0.3],
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.7}},
    }  # fmt: skip
    gltf.tree["extensionsUsed"] = ["KHR_materials_clearcoat"]
    gltf.tree["extras"] = {"author": "someone"}


def data_uri(gltf):
    gltf.primitive()
    gltf.tree["images"][0]["uri"] = "data:image/png;base64," + base64.b64encode(PNG).decode()


def strip(gltf):
    gltf.primitive(np.array([[0, 1, 4], [2, 3, 5]]))["mode"] = 5


def with_lines(gltf):
    part = gltf.primitive()
    lines = gltf.add(np.array([0, 1], "<u2"))
    gltf.tree["meshes"][0]["primitives"].append(
        {"attributes": {"POSITION": part["attributes"]["POSITION"]}, "indices": lines, "mode": 1}
    )


def camera_and_scene(gltf):
    gltf.primitive()
    gltf.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]
    gltf.tree["nodes"].append({"name": "eye", "camera": 0})
    gltf.tree["nodes"].append({"name": "elsewhere", "mesh": 0})
    gltf.tree["scenes"][0]["nodes"].append(1)
    gltf.tree["scenes"].append({"nodes": [2]})


# Of these, reading says that there is more than the surface that is read.
READ_WITH_NOTES = {
    with_lines: "1 primitives of points or lines are left out",
    camera_and_scene: "scene 0 is read of scenes 0, 1; scene= or --scene chooses",
}
GLTF = [
    plain, byte_indices, long_indices, several_primitives, shared_vertices, turned_nodes, skinned, morphed,
    interleaved, without_indices, quantized, extended, data_uri, strip, with_lines, camera_and_scene,
    colored(np.full((6, 3), 99, "u1"), normalized=True), colored(np.full((6, 4), 999, "<u2"), normalized=True),
    colored(np.full((6, 4), 0.25, "<f4")),
]  # fmt: skip


def read_noted(make, path):
    """Read a file with its attributes; if its maker adds more than a surface, a note says so."""
    note = READ_WITH_NOTES.get(make)
    with pytest.warns(UserWarning, match=re.escape(note)) if note else nullcontext():
        return es.read_mesh(path, attributes=True)


def names_of(path):
    tree = read_gltf(path.read_bytes(), path.parent if path.suffix == ".gltf" else None).tree
    kinds = ("nodes", "materials", "textures", "images", "animations", "skins", "cameras", "scenes")
    names = {kind: [entry.get("name") for entry in tree.get(kind, [])] for kind in kinds}
    return tree, names


def looks(attributes):
    """Sort what each corner shows, so that the order of faces and corners does not count."""
    mesh = attributes.mesh
    columns = [mesh.vertices[mesh.faces]]
    for values in (attributes.texture_coordinates, attributes.normals, attributes.colors):
        columns += [] if values is None else [values.astype(float)]
    material = np.array([m.name for m in attributes.materials] + [""])[attributes.face_materials]
    group = np.array([*attributes.groups, ""])[attributes.face_groups]
    rows = np.concatenate(columns, axis=2).round(3) + 0.0
    faces = [sorted(corners) for corners in rows.tolist()]
    return sorted(zip(faces, material.tolist(), group.tolist(), strict=True), key=str)


def same_looks(one, other):
    assert [row[1:] for row in looks(one)] == [row[1:] for row in looks(other)]
    np.testing.assert_allclose(
        np.array([row[0] for row in looks(one)]),
        np.array([row[0] for row in looks(other)]),
        atol=2e-3,
    )


@pytest.mark.parametrize("make", GLTF, ids=lambda make: make.__name__)
def test_a_glb_file_keeps_everything_when_it_is_bent(tmp_path, make, recwarn):
    gltf = Gltf()
    make(gltf)
    path = gltf.save(tmp_path)
    mesh, attributes = read_noted(make, path)
    bent = es.TriangleMesh(mesh.vertices * [1, 1, 2], mesh.faces)
    es.write_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    assert not recwarn
    again, kept = read_noted(make, tmp_path / "b.glb")
    assert again.n_faces == mesh.n_faces
    np.testing.assert_allclose(
        again.vertices[again.faces].sum(0), bent.vertices[bent.faces].sum(0), rtol=1e-5
    )
    (old, old_names), (new, new_names) = names_of(path), names_of(tmp_path / "b.glb")
    assert old_names == new_names
    assert new["materials"] == old["materials"]
    assert new.get("extras") == old.get("extras")
    assert kept.materials[0].image == PNG
    for name in ("texture_coordinates", "colors"):
        one, other = getattr(kept, name), getattr(attributes, name)
        if other is not None:
            np.testing.assert_allclose(np.sort(one.ravel()), np.sort(other.ravel()), atol=1e-6)
    keys = {key for m in old["meshes"] for part in m["primitives"] for key in part["attributes"]}
    assert keys == {
        key for m in new["meshes"] for part in m["primitives"] for key in part["attributes"]
    }
    if attributes.normals is not None and make is not strip:
        # The top of a pyramid twice as high looks up; its walls turn away from it.
        assert np.abs(kept.normals - attributes.normals).max() > 0.05
    trimesh.load_scene(tmp_path / "b.glb")  # another reader takes it


@pytest.mark.parametrize("make", GLTF, ids=lambda make: make.__name__)
def test_a_glb_file_keeps_its_looks_when_it_is_repaired(tmp_path, make):
    gltf = Gltf()
    make(gltf)
    mesh, attributes = read_noted(make, gltf.save(tmp_path))
    fewer = es.TriangleMesh(mesh.vertices, np.roll(mesh.faces[:-1], 1, axis=1)[::-1])
    done = es.repair(fewer, ["weld", "drop_unreferenced"]).mesh
    carried = es.io.carry_attributes(attributes, done)
    es.write_mesh(done, tmp_path / "b.glb", attributes=carried)
    found = read_noted(make, tmp_path / "b.glb")[1]
    wanted, whole = looks(carried), looks(attributes)
    assert all(row in whole for row in wanted)
    if attributes.normals is None:
        assert looks(found) == wanted
    np.testing.assert_allclose(
        np.sort(found.texture_coordinates.ravel()),
        np.sort(carried.texture_coordinates.ravel()),
        atol=1e-6,
    )


@pytest.mark.parametrize("make", GLTF, ids=lambda make: make.__name__)
def test_glb_to_obj_and_back(tmp_path, make):
    gltf = Gltf()
    make(gltf)
    mesh, attributes = read_noted(make, gltf.save(tmp_path))
    if attributes.others:
        with pytest.warns(UserWarning, match=rf"b\.obj does not keep: {attributes.others[0]}"):
            es.write_mesh(mesh, tmp_path / "b.obj", attributes=attributes)
    else:
        es.write_mesh(mesh, tmp_path / "b.obj", attributes=attributes)
    middle_mesh, middle = es.read_mesh(tmp_path / "b.obj", attributes=True)
    assert {m.image for m in middle.materials} == {m.image for m in attributes.materials}
    es.write_mesh(middle_mesh, tmp_path / "c.glb", attributes=middle)
    found = es.read_mesh(tmp_path / "c.glb", attributes=True)[1]
    same_looks(middle, found)
    assert found.materials[0].image == PNG
    np.testing.assert_allclose(
        np.sort(found.texture_coordinates.ravel()),
        np.sort(attributes.texture_coordinates.ravel()),
        atol=1e-6,
    )


def test_a_gltf_file_with_files_beside_it_becomes_one_glb_file(tmp_path):
    gltf = Gltf()
    plain(gltf)
    gltf.tree["images"] = [{"uri": "grain.jpg"}, {"uri": "gone.png"}]
    (tmp_path / "grain.jpg").write_bytes(JPEG)
    mesh, attributes = es.read_mesh(gltf.save(tmp_path, "a.gltf"), attributes=True)
    (tmp_path / "far").mkdir()
    with pytest.warns(
        UserWarning, match=r"b\.glb does not keep: the image 'gone.png', which is not in"
    ):
        es.write_mesh(mesh, tmp_path / "far/b.glb", attributes=attributes)
    assert es.read_mesh(tmp_path / "far/b.glb", attributes=True)[1].materials[0].image == JPEG


def test_tangents_are_named(tmp_path):
    gltf = Gltf()
    gltf.primitive(TANGENT=gltf.add(np.tile(np.array([1, 0, 0, 1], "<f4"), (6, 1))))
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    with pytest.warns(
        UserWarning, match=r"b\.glb does not keep: tangents, which viewers compute anew"
    ):
        es.write_mesh(mesh, tmp_path / "b.glb", attributes=attributes)


def test_what_cannot_be_read_is_refused_by_name(tmp_path):
    gltf = Gltf()
    gltf.primitive()
    gltf.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    with pytest.raises(
        FileFormatError, match="compressed by the extension 'KHR_draco_mesh_compression'"
    ):
        es.read_mesh(gltf.save(tmp_path), attributes=True)
    gltf = Gltf()
    part = gltf.primitive()
    gltf.tree["accessors"][part["attributes"]["TEXCOORD_0"]]["type"] = "MAT2"
    with pytest.raises(
        FileFormatError,
        match=r"accessors\[2\] must have rows of 1 to 4, or 16 numbers of a known type",
    ):
        es.read_mesh(gltf.save(tmp_path), attributes=True)
    gltf = Gltf()
    gltf.primitive(TEXCOORD_0=gltf.add(UV[:3]))
    with pytest.raises(
        FileFormatError, match="TEXCOORD_0 of a primitive must have a row for each position"
    ):
        es.read_mesh(gltf.save(tmp_path), attributes=True)
    gltf = Gltf()
    gltf.primitive(NORMAL=gltf.add(UV))
    with pytest.raises(
        FileFormatError, match="NORMAL of a primitive must have 3 numbers each; it has 2"
    ):
        es.read_mesh(gltf.save(tmp_path), attributes=True)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/9 3/1\n")
    with pytest.raises(
        FileFormatError, match="must name one of 1 texture coordinates; one names 9"
    ):
        es.read_mesh(tmp_path / "a.obj", attributes=True)


OBJ = """mtllib wood.mtl
o house
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0.5 0.5 1
vt 0 0
vt 1 0
vt 1 1
vn 0 0 -1
vn 0 -0.7 0.7
g base
usemtl oak
f 4/1/1 3/2/1 2/3/1 1/1/1
g roof
usemtl tin
s 1
f 1/1/2 2/2/2 5/3/2
f 2//2 3//2 5//2
f 3 4 5
f 4 1 5
"""
MTL = "newmtl oak\nKd 0.5 0.25 0.125\nmap_Kd -s 1 1 1 grain.png\nnewmtl tin\nKd 0.1 0.2 0.3\nd 0.5\nPr 0.3\n"


def obj_file(folder):
    (folder / "wood.mtl").write_text(MTL)
    (folder / "grain.png").write_bytes(PNG)
    (folder / "house.obj").write_text(OBJ)
    return folder / "house.obj"


def test_an_obj_file_in_another_folder_takes_its_materials_along(tmp_path, recwarn):
    mesh, attributes = es.read_mesh(obj_file(tmp_path), attributes=True)
    far = tmp_path / "far"
    far.mkdir()
    (far / "grain.png").write_bytes(JPEG)  # something else has that name already
    es.write_mesh(
        es.TriangleMesh(mesh.vertices * 2, mesh.faces), far / "b.obj", attributes=attributes
    )
    assert not recwarn
    assert (far / "grain.png").read_bytes() == JPEG
    text = (far / "b.obj").read_text()
    assert "f 4/1/1 3/2/2 2/3/3 1/1/4" in text
    assert "g base\nusemtl oak" in text
    assert "s 1" in text
    found = es.read_mesh(far / "b.obj", attributes=True)[1]
    assert [m.name for m in found.materials] == ["oak", "tin"]
    assert found.materials[0].image == PNG
    assert found.materials[1].color == (0.1, 0.2, 0.3, 0.5)
    assert "Pr 0.3" in (far / "b.mtl").read_text()
    assert (
        read_sheet((tmp_path / "house.obj").read_bytes()).rows[1:]
        == read_sheet(text.encode()).rows[1:]
    )
    # The base is flat as before: its normals still look down, and do not mix with those of the roof.
    np.testing.assert_allclose(found.normals[0], [[0, 0, -1]] * 3, atol=1e-12)


def test_obj_to_glb_and_back(tmp_path):
    mesh, attributes = es.read_mesh(obj_file(tmp_path), attributes=True)
    assert attributes.groups == ("house", "base", "roof")
    with pytest.warns(
        UserWarning, match=r"b\.glb does not keep: properties of materials other than color"
    ) as seen:
        es.write_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    assert (
        "polygons, of which triangles are made, names of objects beside those of groups, smoothing groups"
        in str(seen[0].message)
    )
    found = es.read_mesh(tmp_path / "b.glb", attributes=True)[1]
    np.testing.assert_allclose(found.materials[1].color, (0.1, 0.2, 0.3, 0.5))
    assert [m.image for m in found.materials] == [PNG, None]
    assert found.groups == ("base", "roof")
    assert looks(found)[0][1:] in [("oak", "base"), ("tin", "roof")]
    tree = names_of(tmp_path / "b.glb")[0]
    assert tree["materials"][1]["alphaMode"] == "BLEND"


def test_missing_materials_and_images_are_named(tmp_path):
    path = obj_file(tmp_path)
    (tmp_path / "grain.png").unlink()
    mesh, attributes = es.read_mesh(path, attributes=True)
    with pytest.warns(
        UserWarning, match="the image '-s 1 1 1 grain.png', which is not in the folder"
    ):
        es.write_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    (tmp_path / "far").mkdir()
    with pytest.warns(
        UserWarning, match="the image '-s 1 1 1 grain.png', which is not in the folder"
    ):
        es.write_mesh(mesh, tmp_path / "far/b.obj", attributes=attributes)
    path.write_text(OBJ.replace("wood.mtl", "../secret.mtl"))
    mesh, attributes = es.read_mesh(path, attributes=True)
    with pytest.warns(
        UserWarning, match="the materials of '../secret.mtl', which is not in the folder"
    ):
        es.write_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    with pytest.warns(
        UserWarning, match="the materials of '../secret.mtl', which is not in the folder"
    ):
        es.write_mesh(mesh, tmp_path / "far/b.obj", attributes=attributes)


def test_colors_of_ply_go_everywhere(tmp_path, recwarn):
    ball = es.icosphere(1)
    colors = np.arange(3 * ball.n_vertices, dtype=np.uint8).reshape(-1, 3)
    es.write_mesh(ball, tmp_path / "a.ply", colors=colors)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    for name in ("b.ply", "b.obj", "b.glb"):
        es.write_mesh(mesh, tmp_path / name, attributes=attributes)
        again, found = es.read_mesh(tmp_path / name, attributes=True)
        assert again.n_vertices == ball.n_vertices
        np.testing.assert_array_equal(found.colors[..., :3], colors[ball.faces])
    es.write_mesh(mesh, tmp_path / "b.ply", attributes=attributes, binary=False)
    assert not recwarn
    with pytest.warns(UserWarning, match=r"b\.stl does not keep: vertex colors\."):
        es.write_mesh(mesh, tmp_path / "b.stl", attributes=attributes)


def test_parts_are_materials(tmp_path):
    mesh, attributes = es.read_mesh(obj_file(tmp_path), attributes=True)
    labels = np.array([4, 4, 4, 7, 7, 7])
    colors = np.where(mesh.vertices[:, :1] > 0.7, 250, 10).repeat(3, axis=1).astype(np.uint8)
    for name in ("b.glb", "b.obj"):
        with pytest.warns(
            UserWarning, match="materials and images, since each part has a material"
        ):
            es.write_mesh(
                mesh, tmp_path / name, colors=colors, face_labels=labels, attributes=attributes
            )
        again, found = es.read_mesh(tmp_path / name, attributes=True)
        assert {m.name for m in found.materials} == {"part_4", "part_7"}
        assert found.texture_coordinates is not None
        assert again.n_faces == 6
    es.write_mesh(mesh, tmp_path / "c.glb", face_labels=labels)
    assert es.read_mesh(tmp_path / "c.glb").n_vertices == mesh.n_vertices  # borders are not torn


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_vertex_colors_that_parts_replace_are_named(tmp_path, suffix):
    ball = es.icosphere(1)
    own = np.arange(3 * ball.n_vertices, dtype=np.uint8).reshape(-1, 3)
    es.write_mesh(ball, tmp_path / "a.ply", colors=own)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    labels = np.arange(mesh.n_faces) % 2
    lost = save_mesh(
        mesh,
        tmp_path / f"b{suffix}",
        colors=np.zeros_like(own),
        face_labels=labels,
        attributes=attributes,
    )
    assert lost == (
        f"b{suffix} does not keep: vertex colors, since each part has a color of its own."
    )


def test_further_values_of_vertices_are_named(tmp_path):
    gltf = Gltf()
    gltf.primitive(TEXCOORD_1=gltf.add(UV), _WARMTH=gltf.add(UV[:, :1].copy()))
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    assert not save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    lost = save_mesh(mesh, tmp_path / "b.obj", attributes=attributes)
    assert "the values TEXCOORD_1 of vertices, the values _WARMTH of vertices" in lost


def test_attributes_of_other_faces_are_refused(tmp_path):
    mesh, attributes = es.read_mesh(obj_file(tmp_path), attributes=True)
    with pytest.raises(
        InvalidParameterError, match=r"attributes must belong to the 5 faces .* es\.io\.carry"
    ):
        es.write_mesh((mesh.vertices, mesh.faces[:5]), tmp_path / "b.obj", attributes=attributes)


def test_faces_of_a_filled_hole_look_as_their_neighbors(tmp_path):
    mesh, attributes = es.read_mesh(obj_file(tmp_path), attributes=True)
    opened = es.TriangleMesh(mesh.vertices, mesh.faces[2:])
    closed = es.repair(opened, ["fill_holes"]).mesh
    carried = es.io.carry_attributes(es.io.carry_attributes(attributes, opened), closed)
    assert carried.face_materials.tolist() == [1] * closed.n_faces
    with pytest.raises(ValueError, match="read-only"):
        carried.face_materials[0] = 3


def test_both_sides_of_a_sheet_keep_their_own_looks():
    faces = np.array([[0, 1, 2], [2, 1, 0]])
    mesh = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces)
    sides = replace(
        MeshAttributes.plain(mesh), face_groups=np.array([0, 1]), groups=("front", "back")
    )
    swapped = es.TriangleMesh(mesh.vertices, faces[::-1])
    assert es.io.carry_attributes(sides, swapped).face_groups.tolist() == [1, 0]


def test_light_and_screen_are_inverse():
    values = np.linspace(0, 1, 256)
    np.testing.assert_array_equal(
        np.rint(255 * screen_colors(linear_colors(values))), np.arange(256)
    )


@pytest.mark.data
def test_real_obj_and_ply_files_keep_their_looks(data, tmp_path):
    n_read = 0
    for path in sorted([*(data / "nasty").rglob("*.obj"), *(data / "nasty").rglob("*.ply")]):
        try:
            mesh, attributes = es.read_mesh(path, attributes=True)
        except ValueError:
            continue
        lost = save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
        found = es.read_mesh(tmp_path / "b.glb", attributes=True)[1]
        assert found.mesh.n_faces == mesh.n_faces
        for name in ("texture_coordinates", "colors"):
            assert (getattr(found, name) is None) == (getattr(attributes, name) is None)
        assert not attributes.others or attributes.others[0] in lost
        if path.suffix.lower() == ".obj":
            save_mesh(mesh, tmp_path / "c.obj", attributes=attributes)
            again, kept = es.read_mesh(tmp_path / "c.obj", attributes=True)
            np.testing.assert_array_equal(again.faces, mesh.faces)
            assert kept.groups == attributes.groups
            assert [m.name for m in kept.materials] == [m.name for m in attributes.materials]
        n_read += 1
    assert n_read > 50


def test_attributes_stay_where_vertices_are_left_out(tmp_path):
    text = "v nan 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\n"
    (tmp_path / "a.obj").write_text(
        f"{text}usemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 2/2 4/4 3/3\n"
    )
    mesh, held = es.read_mesh(tmp_path / "a.obj", attributes=True, drop_missing=True)
    assert mesh.faces.tolist() == [[0, 2, 1]]
    assert held.texture_coordinates[0].tolist() == [[1, 0], [1, 1], [0, 1]]
    assert [held.materials[i].name for i in held.face_materials] == ["blue"]
