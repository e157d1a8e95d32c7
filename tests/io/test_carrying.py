"""Attributes on repaired and decimated meshes: charts of textures, exact values, fields, and files of exporters."""

import base64
import io
from dataclasses import replace

import numpy as np
import pygltflib
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.cli import app
from eigenshape.io.attributes import Material, MeshAttributes
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.mesh_files import save_mesh

GRAIN = Image.fromarray(np.arange(192, dtype=np.uint8).reshape(8, 8, 3))
PNG = io.BytesIO()
GRAIN.save(PNG, "PNG")
PNG = PNG.getvalue()
BALL = es.icosphere(3)
OAK = Material("oak", image=PNG, image_name="grain.png")


def longitudes(mesh):
    """Return longitude and latitude from 0 to 1 at corners; faces at the seam go on beyond 1."""
    x, y, z = np.moveaxis(mesh.vertices[mesh.faces], 2, 0)
    u = np.arctan2(y, x) / (2 * np.pi) + 0.5
    u += (np.ptp(u, axis=1, keepdims=True) > 0.5) & (u < 0.5)
    return np.stack([u, np.arcsin(z.clip(-1, 1)) / np.pi + 0.5], axis=2)


def textured_ball():
    return replace(
        MeshAttributes.plain(BALL), texture_coordinates=longitudes(BALL), normals=BALL.vertices[BALL.faces],
        materials=(OAK,), face_materials=np.zeros(BALL.n_faces, dtype=int),
    )  # fmt: skip


def test_no_face_of_a_decimated_ball_runs_over_the_seam():
    done = es.geometry.decimate(BALL, 300).mesh
    found = carry_attributes(textured_ball(), done)
    corners = done.vertices[done.faces]
    away = np.abs(corners[..., 2]).max(axis=1) < 0.85  # longitudes jump at the poles
    assert np.ptp(found.texture_coordinates[away, :, 0], axis=1).max() < 0.25
    wanted = np.arctan2(corners[..., 1], corners[..., 0]) / (2 * np.pi) + 0.5
    gaps = np.abs((found.texture_coordinates[..., 0] - wanted + 0.5) % 1 - 0.5)
    # Faces at the seam end there, at most their own size away.
    assert gaps[away].max() < 0.1
    assert np.median(gaps[away]) < 0.003
    assert np.linalg.norm(found.normals, axis=2) == pytest.approx(1)
    assert not found.from_file.any()


@pytest.mark.parametrize(
    ("suffix", "target"),
    [(".glb", ".glb"), (".obj", ".obj"), (".ply", ".ply"), (".glb", ".obj"), (".obj", ".ply")],
)
def test_decimate_keeps_textures(tmp_path, suffix, target):
    save_mesh(BALL, tmp_path / f"a{suffix}", attributes=textured_ball())
    path = tmp_path / f"b{target}"
    done = run("decimate", tmp_path / f"a{suffix}", "-n", 300, "-o", path)
    assert ("materials" in done.stderr) == (target == ".ply" != suffix)
    assert "images" not in done.stderr
    mesh, found = es.read_mesh(path, attributes=True)
    # In GLB vertices are double along the seam; the surface itself has not come apart there.
    assert es.geometry.is_closed(es.repair(mesh, ["weld"]).mesh)
    assert mesh.n_faces == 300
    away = np.abs(mesh.vertices[mesh.faces][..., 2]).max(axis=1) < 0.85
    assert np.ptp(found.texture_coordinates[away, :, 0], axis=1).max() < 0.25
    assert found.normals is not None
    if ".ply" not in (suffix, target):
        assert [(m.name, m.image) for m in found.materials] == [("oak", PNG)]


def test_a_kept_face_gets_back_the_very_values():
    rng = np.random.default_rng(0)
    attributes = replace(textured_ball(), texture_coordinates=rng.random((BALL.n_faces, 3, 2)))
    kept = rng.permutation(BALL.n_faces)[:700]
    turns = (np.arange(3) + rng.integers(0, 3, (700, 1))) % 3
    turns[::2] = turns[::2, ::-1]  # turned over
    faces = np.take_along_axis(BALL.faces[kept], turns, axis=1)
    found = carry_attributes(attributes, es.TriangleMesh(BALL.vertices, faces))
    for name in ("texture_coordinates", "normals"):
        wanted = np.take_along_axis(getattr(attributes, name)[kept], turns[..., None], axis=1)
        np.testing.assert_array_equal(getattr(found, name), wanted)
    assert found.from_file.all()


def test_carried_twice_is_carried_once():
    attributes = textured_ball()
    shuffled = es.TriangleMesh(BALL.vertices, BALL.faces[::-1])
    small = es.geometry.decimate(BALL, 300).mesh
    once = carry_attributes(attributes, small)
    twice = carry_attributes(carry_attributes(attributes, shuffled), small)
    np.testing.assert_allclose(twice.texture_coordinates, once.texture_coordinates, atol=1e-9)
    sums = twice.corners @ attributes.texture_coordinates.reshape(-1, 2)
    np.testing.assert_allclose(sums, twice.texture_coordinates.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".npz", ".ply"])
def test_fields_go_along(tmp_path, suffix):
    fields = {
        "height": BALL.vertices[:, 2], "top": (BALL.vertices[:, 2] > 0).astype(np.int32),
        "side": (BALL.vertices[BALL.faces].mean(axis=1)[:, 0] > 0).astype(np.int32),
    }  # fmt: skip
    es.io.write_fields(BALL, tmp_path / "a.vtu", fields)
    fewer, smaller, last = (tmp_path / f"{name}{suffix}" for name in "bcd")
    run("repair", tmp_path / "a.vtu", "--repair", "orient", "-o", fewer)
    run("decimate", fewer, "-n", 300, "-o", smaller)
    run("repair", smaller, "-o", last)
    mesh, found = es.read_mesh(last, attributes=True)
    np.testing.assert_allclose(found.fields["height"], mesh.vertices[:, 2], atol=0.03)
    clear = np.abs(mesh.vertices[:, 2]) > 0.2
    assert np.array_equal(found.fields["top"][clear], mesh.vertices[clear, 2] > 0)
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    clear = np.abs(middle) > 0.2
    assert np.array_equal(found.fields["side"][clear], middle[clear] > 0)
    lost = run("repair", last, "-o", tmp_path / "e.obj").stderr
    assert "e.obj does not keep: fields" in lost


PLY = """ply
format ascii 1.0
comment TextureFile grain.png
element vertex 4
property float x
property float y
property float z
property float s
property float t
property float quality
element face 2
property list uchar int vertex_indices
property uchar red
property uchar green
property uchar blue
property uchar alpha
property int label
property list uchar int flags
end_header
0 0 0 0 0 0.5
1 0 0 1 0 1.5
1 1 0 1 1 2.5
0 1 0 0 1 3.5
3 0 1 2 9 8 7 99 -4 1 3
3 0 2 3 1 2 3 255 6 1 3
"""


@pytest.mark.parametrize("binary", [False, True])
def test_ply_keeps_its_columns(tmp_path, binary):
    (tmp_path / "a.ply").write_text(PLY)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    assert attributes.others == ("flags of face", "the image 'grain.png', which a comment names")
    for name in "bc":  # what is written is read again as it is
        with_losses = save_mesh(
            mesh, tmp_path / f"{name}.ply", binary=binary, attributes=attributes
        )
        assert ("flags of face" in with_losses) == (name == "b")
        mesh, attributes = es.read_mesh(tmp_path / f"{name}.ply", attributes=True)
    assert attributes.colors[:, 0].tolist() == [[9, 8, 7, 99], [1, 2, 3, 255]]
    assert attributes.groups == ("-4", "6")
    assert attributes.face_groups.tolist() == [0, 1]
    assert attributes.fields["quality"].tolist() == [0.5, 1.5, 2.5, 3.5]
    assert attributes.texture_coordinates[1].tolist() == [[0, 0], [1, 1], [0, 1]]


def test_ply_takes_its_image_along(tmp_path):
    (tmp_path / "a.ply").write_text(PLY)
    (tmp_path / "grain.png").write_bytes(PNG)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    assert attributes.others == ("flags of face",)
    save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    assert es.read_mesh(tmp_path / "b.glb", attributes=True)[1].materials[0].image == PNG


def test_ply_in_another_folder_takes_its_image_along(tmp_path):
    (tmp_path / "a.ply").write_text(PLY)
    (tmp_path / "grain.png").write_bytes(PNG)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    far = tmp_path / "far"
    far.mkdir()
    for folder in (tmp_path, far):
        lost = save_mesh(mesh, folder / "b.ply", attributes=attributes)
        assert lost == "b.ply does not keep: flags of face."
        again = es.read_mesh(folder / "b.ply", attributes=True)[1]
        assert again.materials == attributes.materials
    assert sorted(path.name for path in far.iterdir()) == ["b.ply", "grain.png"]
    (far / "grain.png").write_bytes(b"another image")  # which stays as it is
    save_mesh(mesh, far / "b.ply", binary=False, attributes=attributes)
    assert es.read_mesh(far / "b.ply", attributes=True)[1].materials[0].image == PNG
    assert (far / "grain.png").read_bytes() == b"another image"
    named = replace(attributes, materials=(Material("oak", image=PNG, image_name="x.png"),))
    assert "keep: flags of face, materials." in save_mesh(mesh, far / "c.ply", attributes=named)
    mixed = replace(named, face_materials=np.array([0, -1]))
    assert "materials, images." in save_mesh(mesh, far / "d.ply", attributes=mixed)


def test_ply_wedges(tmp_path):
    text = PLY.replace("int flags", "float texcoord").replace(
        "property float s\n", "property float S\n"
    )
    rows = text.replace("-4 1 3", "-4 6 0 0 1 0 1 1").replace("6 1 3", "6 6 0 0 1 1 0 0.5")
    (tmp_path / "a.ply").write_text(rows)
    mesh, attributes = es.read_mesh(tmp_path / "a.ply", attributes=True)
    assert attributes.texture_coordinates[1].tolist() == [[0, 0], [1, 1], [0, 0.5]]
    save_mesh(mesh, tmp_path / "b.ply", attributes=attributes)
    found = es.read_mesh(tmp_path / "b.ply", attributes=True)[1]
    np.testing.assert_array_equal(found.texture_coordinates, attributes.texture_coordinates)
    (tmp_path / "a.ply").write_text(text)
    with pytest.raises(FileFormatError, match="texcoord of a face must hold two numbers"):
        es.read_mesh(tmp_path / "a.ply", attributes=True)


def test_obj_names_points_and_polylines_and_fills_holes_with_texture(tmp_path):
    save_mesh(BALL, tmp_path / "a.obj", attributes=textured_ball())
    rows = (tmp_path / "a.obj").read_text().splitlines()
    first = next(number for number, row in enumerate(rows) if row.startswith("f "))
    (tmp_path / "a.obj").write_text("\n".join([*rows[:first], *rows[first + 1 :], "p 1", "l 1 2"]))
    done = run("repair", tmp_path / "a.obj", "--repair", "fill_holes", "-o", tmp_path / "b.obj")
    assert "b.obj does not keep: points, polylines." in " ".join(done.stderr.split())
    mesh, found = es.read_mesh(tmp_path / "b.obj", attributes=True)
    assert mesh.n_faces == BALL.n_faces
    assert (found.face_materials == 0).all()
    assert np.ptp(found.texture_coordinates[-1], axis=0).max() < 0.2  # of the face that fills it


def by_trimesh(path, kind):
    """Export a textured ball by trimesh, alone or in a scene with a colored box."""
    mesh = trimesh.Trimesh(*bare(), process=False)
    uv = longitudes(BALL).reshape(-1, 2) % 1.0
    material = trimesh.visual.material.PBRMaterial(name="oak", baseColorTexture=GRAIN)
    if kind == "simple":
        material = trimesh.visual.material.SimpleMaterial(name="oak", image=GRAIN)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    if kind == "scene":
        box = trimesh.creation.box(extents=[0.5, 0.5, 0.5]).subdivide()
        box.apply_translation([3, 0, 0])
        box.visual.vertex_colors = np.tile([9, 99, 199, 255], (len(box.vertices), 1))
        mesh = trimesh.Scene({"ball": mesh, "box": box})
    mesh.export(path)


def bare():
    return BALL.vertices[BALL.faces].reshape(-1, 3), np.arange(3 * BALL.n_faces).reshape(-1, 3)


def by_pygltflib(path, kind):
    """Export a textured ball by pygltflib: with the image in its buffer, or in its text."""
    places, faces = bare()
    tables = [
        places.astype("<f4"),
        (longitudes(BALL).reshape(-1, 2)).astype("<f4"),
        faces.ravel().astype("<u2"),
    ]
    gltf = pygltflib.GLTF2(
        scene=0, scenes=[pygltflib.Scene(nodes=[0])], nodes=[pygltflib.Node(mesh=0, name="ball")],
        materials=[pygltflib.Material(name="oak", doubleSided=True, pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
            baseColorTexture=pygltflib.TextureInfo(index=0), roughnessFactor=0.3))],
        textures=[pygltflib.Texture(source=0)], images=[pygltflib.Image(name="grain", mimeType="image/png")],
        meshes=[pygltflib.Mesh(primitives=[pygltflib.Primitive(
            attributes=pygltflib.Attributes(POSITION=0, TEXCOORD_0=1), indices=2, material=0)])],
    )  # fmt: skip
    binary = b""
    for table, kind_of in zip(tables, ("VEC3", "VEC2", "SCALAR"), strict=True):
        view = pygltflib.BufferView(buffer=0, byteOffset=len(binary), byteLength=table.nbytes)
        component = pygltflib.UNSIGNED_SHORT if kind_of == "SCALAR" else pygltflib.FLOAT
        bounds = {"min": table.min(axis=0).tolist(), "max": table.max(axis=0).tolist()}
        gltf.accessors.append(
            pygltflib.Accessor(
                bufferView=len(gltf.bufferViews),
                componentType=component,
                count=len(table),
                type=kind_of,
                **(bounds if kind_of == "VEC3" else {}),
            )
        )
        gltf.bufferViews.append(view)
        binary += table.tobytes() + b"\0" * (-table.nbytes % 4)
    if kind == "text":
        gltf.images[0].uri = "data:image/png;base64," + base64.b64encode(PNG).decode()
    else:
        gltf.images[0].bufferView = 3
        gltf.bufferViews.append(
            pygltflib.BufferView(buffer=0, byteOffset=len(binary), byteLength=len(PNG))
        )
        binary += PNG
    gltf.buffers = [pygltflib.Buffer(byteLength=len(binary))]
    gltf.set_binary_blob(binary)
    gltf.save(str(path))


VERBS = {
    "repair": ("--repair", "weld_seams"),
    "decimate": ("--ratio", "0.5"),
    "deform": ("--region", "z>0.7", "--move", "0,0,0.2", "--repair", "weld,largest_component"),
    "segment": ("--repair", "weld,largest_component", "--method", "thesis", "-n", "2"),
}  # fmt: skip
EXPORTS = [
    ("a.glb", by_trimesh, "pbr"), ("a.glb", by_trimesh, "scene"), ("a.obj", by_trimesh, "simple"),
    ("a.glb", by_pygltflib, "binary"), ("a.glb", by_pygltflib, "text"),
]  # fmt: skip


# Bending and cutting write files in the same way as repairs, so two files are enough there.
PAIRS = [(verb, *file) for verb in ("repair", "decimate") for file in EXPORTS]
PAIRS += [(verb, *file) for verb in ("deform", "segment") for file in EXPORTS[:3:2]]


@pytest.mark.parametrize(
    ("verb", "name", "export", "kind"), PAIRS, ids=lambda value: getattr(value, "__name__", value)
)
def test_files_of_exporters_keep_their_looks(tmp_path, verb, name, export, kind):
    path = tmp_path / name
    export(path, kind)
    before = es.read_mesh(path, attributes=True)[1]
    output = path.with_stem("b")
    done = run(verb, path, *VERBS[verb], "-o", output)
    mesh, found = es.read_mesh(output, attributes=True)
    lost = " ".join(done.stderr.split()).partition("lost: ")[2]
    if verb == "segment":
        assert "materials and images, since each part has a material of its own" in lost
    else:
        assert not lost.replace("polygons", "") or name.endswith(".obj")
        assert [m.image for m in found.materials] == [m.image for m in before.materials]
        if name.endswith(".glb"):  # also what is read by nothing here
            old, new = (pygltflib.GLTF2().load(str(p)) for p in (path, output))
            assert new.materials == old.materials
    away = np.abs(mesh.vertices[mesh.faces][..., 2]).max(axis=1) < 0.8
    u = found.texture_coordinates[away, :, 0]
    assert np.quantile(np.ptp(u, axis=1), 0.8) < 0.2
    assert u.max() > 0.9
    assert u.min() < 0.1
    trimesh.load(output)  # another reader takes it


def run(*arguments):
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.output
    return done
