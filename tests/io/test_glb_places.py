"""Where glTF files say that geometry is: skins, instances, morph targets, scenes, sparse accessors."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_attributes import FACES, UV, VERTICES, Gltf

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.geometry import enclosed_volume, surface_area
from eigenshape.io.attributes import linear_colors
from eigenshape.io.formats.gltf import parse, read_gltf
from eigenshape.io.mesh_files import save_mesh

QUARTER = [0, 0, 0.5**0.5, 0.5**0.5]  # a turn about z, from x to y


def read(path, **options):
    """Read vertices, faces and notes."""
    vertices, faces, *notes = parse(path.read_bytes(), **options)
    return vertices, faces, notes


def skin(gltf, joints, weights, bind=None, **primitive):
    """Give a pyramid below a node of its own, which has no effect, a skin of two joints."""
    columns = {}
    for number in range(joints.shape[1] // 4):
        block = slice(4 * number, 4 * number + 4)
        columns[f"JOINTS_{number}"] = gltf.add(np.ascontiguousarray(joints[:, block]))
        share = {"normalized": True} if weights.dtype.kind == "u" else {}
        columns[f"WEIGHTS_{number}"] = gltf.add(np.ascontiguousarray(weights[:, block]), **share)
    gltf.primitive(**columns, **primitive)
    gltf.tree["nodes"] = [
        {"name": "armature", "scale": [0.01] * 3, "translation": [7, 8, 9], "children": [1, 2]},
        {"name": "body", "mesh": 0, "skin": 0, "translation": [50, 0, 0]},
        {"name": "hip", "scale": [100] * 3, "children": [3]},
        {"name": "spine", "translation": [0, 0, 1], "rotation": QUARTER},
    ]
    gltf.tree["skins"] = [{"joints": [2, 3]}]
    if bind is not None:
        columns = bind.transpose(0, 2, 1).reshape(-1, 16).astype("<f4")
        gltf.tree["skins"][0]["inverseBindMatrices"] = gltf.add(columns)


def weighted(count, *shares):
    """Return joints 0 and 1, and weights, for a pyramid whose top follows the second joint."""
    joints = np.zeros((6, count), "u1")
    joints[:, -1] = 1
    weights = np.zeros((6, count), "<f4")
    weights[:, 0], weights[4, 0], weights[4, -1] = 1, *shares
    return joints, weights


# The world matrices of the joints: a shift by the armature, and one more up with a quarter turn.
HIP = np.eye(4)
HIP[:3, 3] = [7, 8, 9]
SPINE = HIP.copy()
SPINE[:3, :3] = Rotation.from_quat(QUARTER).as_matrix()
SPINE[2, 3] = 10


@pytest.mark.parametrize(("kind", "count"), [("<f4", 4), ("u1", 4), ("<u2", 8)])
def test_joints_place_a_skin_and_its_node_does_not(tmp_path, kind, count):
    gltf = Gltf()
    joints, weights = weighted(count, 0.2, 0.8)
    if kind != "<f4":
        weights = (weights * np.iinfo(kind).max).round().astype(kind)
    bind = np.array([np.linalg.inv(HIP), np.linalg.inv(HIP)])
    skin(gltf, joints.astype("<u2" if count == 8 else "u1"), weights, bind)
    vertices, _, notes = read(gltf.save(tmp_path))
    wanted = VERTICES.astype(float)
    # About the axis x = 7, y = 8 the spine turns the top from (0.5, 0.5, 1) to (14.5, 1.5, 1), and
    # lifts it by 1.
    wanted[4] = 0.2 * wanted[4] + 0.8 * np.array([14.5, 1.5, 2])
    np.testing.assert_allclose(vertices, wanted, atol=1e-5)
    assert not notes


def test_a_skin_without_inverse_matrices_is_bound_at_the_origin(tmp_path):
    gltf = Gltf()
    skin(gltf, *weighted(4, 1, 0))
    np.testing.assert_allclose(read(gltf.save(tmp_path))[0], VERTICES + HIP[:3, 3], atol=1e-6)


def test_weights_that_do_not_sum_to_one(tmp_path):
    gltf = Gltf()
    joints, weights = weighted(4, 0.1, 0.3)
    weights[0] = 0.0
    skin(gltf, joints, weights)
    vertices, _, notes = read(gltf.save(tmp_path))
    np.testing.assert_allclose(vertices[0], VERTICES[0] + [7, 8, 9], atol=1e-6)
    spine = SPINE[:3, :3] @ VERTICES[4] + SPINE[:3, 3]
    np.testing.assert_allclose(
        vertices[4], 0.25 * (VERTICES[4] + [7, 8, 9]) + 0.75 * spine, atol=1e-6
    )
    assert notes == [
        "weights of 2 vertices of a skin do not sum to 1, and were divided by their sum; "
        "vertices without weights follow their first joint"
    ]


def test_a_joint_that_reflects_turns_triangles_back(tmp_path):
    gltf = Gltf()
    skin(gltf, *weighted(4, 1, 0))
    before = enclosed_volume(es.read_mesh(gltf.save(tmp_path)))
    gltf.tree["nodes"][2]["scale"] = [-100, 100, 100]
    assert enclosed_volume(es.read_mesh(gltf.save(tmp_path))) == pytest.approx(before)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": [2]}, r"Joints of vertices must be within 0\.\.0; vertex 4 has joint 1"),
        ({"joints": [2, 4]}, r"in the scene of its mesh; skins\[0\] names node 4, which does not"),
        ({"joints": [2, 9]}, r"it names nodes\[9\] and holds none"),
        ({"inverseBindMatrices": 4}, r"skins\[0\] has 1 for 2 joints"),
    ],
)
def test_broken_skins_are_refused(tmp_path, change, message):
    gltf = Gltf()
    skin(gltf, *weighted(4, 0, 1))
    gltf.tree["nodes"].append({"name": "elsewhere"})
    if "inverseBindMatrices" in change:
        change = {"inverseBindMatrices": gltf.add(np.eye(4, dtype="<f4").reshape(1, 16))}
    gltf.tree["skins"][0] |= change
    with pytest.raises(FileFormatError, match=message):
        read(gltf.save(tmp_path))


def test_a_skin_needs_joints(tmp_path):
    gltf = Gltf()
    gltf.primitive()
    gltf.tree["nodes"] = [{"mesh": 0, "skin": 0}]
    gltf.tree["skins"] = [{"joints": [0]}]
    with pytest.raises(FileFormatError, match="must have JOINTS_0, WEIGHTS_0; it has no JOINTS_0"):
        read(gltf.save(tmp_path))


def instances(gltf, **columns):
    gltf.primitive()
    gltf.tree["nodes"][0] |= {
        "translation": [0, 0, 100],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": columns}},
    }
    gltf.tree["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]


def test_all_instances_are_read(tmp_path):
    gltf = Gltf()
    turns = np.array([[0, 0, 0, 127], [0, 0, 90, 90], [0, 0, 0, 127]], "i1")
    instances(
        gltf,
        TRANSLATION=gltf.add(np.array([[0, 0, 0], [10, 0, 0], [20, 0, 0]], "<f4")),
        ROTATION=gltf.add(turns, normalized=True),
        SCALE=gltf.add(np.array([[1, 1, 1], [2, 2, 2], [-1, 1, 1]], "<f4")),
        _ID=gltf.add(np.arange(3, dtype="<f4")),
    )
    gltf.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    vertices, faces, notes = read(gltf.save(tmp_path))
    x, y, z = VERTICES.astype(float).T
    copies = [[x, y, z], [10 - 2 * y, 2 * x, 2 * z], [20 - x, y, z]]
    wanted = np.concatenate([np.column_stack(copy) for copy in copies]) + np.array([0, 0, 100])
    np.testing.assert_allclose(vertices, wanted, atol=1e-6)
    one = enclosed_volume((VERTICES.astype(float), FACES))
    # The reflected copy is not inside out.
    assert enclosed_volume((vertices, faces)) == pytest.approx((1 + 8 + 1) * one)
    assert not notes


def test_instances_agree_in_number(tmp_path):
    gltf = Gltf()
    instances(
        gltf,
        TRANSLATION=gltf.add(np.zeros((3, 3), "<f4")),
        SCALE=gltf.add(np.ones((2, 3), "<f4")),
    )
    with pytest.raises(
        FileFormatError,
        match="SCALE in a glTF file must have 3 rows, as what stands beside it; it has 2",
    ):
        read(gltf.save(tmp_path))


def test_bent_instances_become_one_mesh(tmp_path):
    gltf = Gltf()
    instances(gltf, TRANSLATION=gltf.add(np.array([[0, 0, 0], [10, 0, 0]], "<f4")))
    gltf.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    bent = es.TriangleMesh(mesh.vertices * [1, 1, 2], mesh.faces)
    lost = save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    assert lost == (
        "b.glb does not keep: the extension EXT_mesh_gpu_instancing, which is about the old geometry."
    )
    again, kept = es.read_mesh(tmp_path / "b.glb", attributes=True)
    same_corners(again, bent)
    assert kept.groups == ("pyramid",)
    tree = read_gltf((tmp_path / "b.glb").read_bytes()).tree
    assert not {"extensionsUsed", "extensionsRequired"} & set(tree)


def same_corners(one, other, atol=1e-5):
    assert one.n_faces == other.n_faces
    np.testing.assert_allclose(one.vertices[one.faces], other.vertices[other.faces], atol=atol)


def morph(gltf, **options):
    """Give a pyramid a target that lifts its top by 1, sparsely, and one that widens it."""
    part = gltf.primitive()
    lift = {
        "count": 1,
        "indices": {"bufferView": gltf.view(np.array([4], "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": gltf.view(np.array([0, 0, 1], "<f4").tobytes())},
    }
    gltf.tree["accessors"].append(
        {"componentType": 5126, "type": "VEC3", "count": 6, "sparse": lift}
    )
    sparse = len(gltf.tree["accessors"]) - 1
    turns = gltf.add(np.zeros((6, 3), "<f4"))
    wide = gltf.add((VERTICES * [1, 0, 0]).astype("<f4"))
    part["targets"] = [{"POSITION": sparse, "NORMAL": turns}, {"POSITION": wide}, {"NORMAL": turns}]
    gltf.tree["meshes"][0] |= options


@pytest.mark.parametrize(
    ("of_mesh", "of_node", "lift", "width"),
    [
        ({}, {}, 0, 0),
        ({"weights": [1, 0.5, 1]}, {}, 1, 0.5),
        ({"weights": [1, 0.5, 1]}, {"weights": [0, 2, 0]}, 0, 2),
        ({}, {"weights": [-0.5, 0, 0]}, -0.5, 0),
    ],
)
def test_default_weights_of_morph_targets(tmp_path, of_mesh, of_node, lift, width):
    gltf = Gltf()
    morph(gltf, **of_mesh)
    gltf.tree["nodes"][0] |= of_node
    wanted = VERTICES * [1 + width, 1, 1]
    wanted[4, 2] += lift
    path = gltf.save(tmp_path)
    np.testing.assert_allclose(read(path)[0], wanted, atol=1e-6)
    # What is written comes back bent, with its targets.
    mesh, attributes = es.read_mesh(path, attributes=True)
    bent = es.TriangleMesh(mesh.vertices + np.array([0, 0, 3]), mesh.faces)
    assert not save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "b.glb"), bent)


def test_two_nodes_show_one_mesh_in_two_ways(tmp_path):
    gltf = Gltf()
    morph(gltf)
    gltf.tree["nodes"] = [{"mesh": 0}, {"mesh": 0, "weights": [1, 0, 0]}]
    gltf.tree["scenes"][0]["nodes"] = [0, 1]
    assert read(gltf.save(tmp_path))[0][:, 2].reshape(2, 6)[:, 4].tolist() == [1, 2]


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([1], "weights of a node must be 3 finite numbers"),
        ([1, 0, 0], "POSITION in a glTF file must have 6 rows, as what stands beside it; it has 1"),
    ],
)
def test_broken_targets_are_refused(tmp_path, weights, message):
    gltf = Gltf()
    morph(gltf, weights=weights)
    short = gltf.add(np.zeros((1, 3), "<f4"))
    gltf.tree["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = short
    with pytest.raises(FileFormatError, match=message):
        read(gltf.save(tmp_path))


@pytest.mark.parametrize("scale", [[1, 1, 1], [1, -2, 1]])
def test_a_bent_character_comes_back_bent(tmp_path, scale):
    gltf = Gltf()
    skin(gltf, *weighted(8, 0.5, 0.5), np.array([np.linalg.inv(HIP), np.linalg.inv(SPINE)]))
    gltf.tree["nodes"][3]["scale"] = scale  # of the joint at the top
    gltf.tree["nodes"][1]["scale"] = [-1, 1, 1]  # of the skinned node, without effect
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    bent = es.TriangleMesh(mesh.vertices * [1, 1, 2] + [0, 5, 0], mesh.faces)
    assert not save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "b.glb"), bent)
    tree = read_gltf((tmp_path / "b.glb").read_bytes()).tree
    assert tree["skins"] == gltf.tree["skins"]
    assert {"JOINTS_1", "WEIGHTS_1"} <= set(tree["meshes"][0]["primitives"][0]["attributes"])


def test_what_a_joint_flattens_may_stay_and_may_not_move(tmp_path):
    gltf = Gltf()
    joints, weights = weighted(4, 0, 1)
    weights[:5] = [0, 0, 0, 1]
    skin(gltf, joints, weights)
    gltf.tree["nodes"][3]["scale"] = [1, 1, 0]
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    assert not save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "b.glb"), mesh)
    lifted = mesh.vertices + np.where(np.arange(6) == 4, 1.0, 0.0)[:, None] * [0, 0, 1]
    bent = es.TriangleMesh(lifted, mesh.faces)
    with pytest.raises(
        FileFormatError, match=r"a node that flattens, changes the area .* Write \.ply, which keeps"
    ):
        save_mesh(bent, tmp_path / "c.glb", attributes=attributes)
    save_mesh(bent, tmp_path / "c.ply", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "c.ply"), bent, atol=0)


def moving_file():
    """Return a file with all that moves geometry."""
    gltf = Gltf()
    skin(gltf, *weighted(8, 0.5, 0.5), np.array([HIP, SPINE]))
    morph(gltf, weights=[1, 0.5, 1])
    gltf.tree["meshes"].append({"primitives": [gltf.tree["meshes"][0]["primitives"].pop()]})
    gltf.tree["meshes"][1]["weights"] = gltf.tree["meshes"][0].pop("weights")
    copies = {"TRANSLATION": gltf.add(np.ones((2, 3), "<f4"))}
    gltf.tree["nodes"].append(
        {
            "mesh": 1,
            "weights": [1, 0, 0],
            "extensions": {
                "EXT_mesh_gpu_instancing": {"attributes": copies},
                "KHR_node_visibility": {"visible": True},
                "MSFT_lod": {"ids": []},
            },
        }
    )
    gltf.tree["scenes"] = [{"nodes": [0, 4], "name": "all"}, {"nodes": [4]}]
    gltf.tree["extensionsUsed"] = gltf.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    gltf.tree["buffers"] = [{"byteLength": len(gltf.binary)}]
    return gltf


def test_all_that_moves_geometry_comes_back_bent(tmp_path):
    gltf = moving_file()
    with pytest.warns(UserWarning, match="scene 0 is read of scenes 0 'all', 1; scene="):
        mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    assert mesh.n_vertices == 18
    bent = es.TriangleMesh(mesh.vertices * [1, 1, 2], mesh.faces)
    assert "EXT_mesh_gpu" in save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    with pytest.warns(UserWarning, match="scene 0 is read"):
        same_corners(es.read_mesh(tmp_path / "b.glb"), bent)


def two_scenes(gltf):
    gltf.primitive()
    gltf.tree["nodes"] = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}, {"name": "empty"}]
    gltf.tree["scenes"] = [
        {"nodes": [0]},
        {"nodes": [1], "name": "far"},
        {"nodes": [2], "name": "7"},
    ]
    gltf.tree["scene"] = 0


@pytest.mark.parametrize(("scene", "x"), [(None, 0), (0, 0), (1, 5), ("far", 5), ("1", 5)])
def test_scenes_are_chosen_by_name_or_number(tmp_path, scene, x):
    gltf = Gltf()
    two_scenes(gltf)
    vertices, _, notes = read(gltf.save(tmp_path), scene=scene)
    assert vertices[0].tolist() == [x, 0, 0]
    listed = "scene 0 is read of scenes 0, 1 'far', 2 '7'; scene= or --scene chooses"
    assert notes == ([listed] if scene is None else [])


def test_a_mesh_that_another_scene_shows_stays_as_it_was_there(tmp_path):
    gltf = Gltf()
    two_scenes(gltf)
    path = gltf.save(tmp_path)
    mesh, attributes = es.read_mesh(path, attributes=True, scene=0)
    bent = es.TriangleMesh(mesh.vertices * [1, 1, 2], mesh.faces)
    assert not save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "b.glb", scene=0), bent)
    same_corners(es.read_mesh(tmp_path / "b.glb", scene=1), es.read_mesh(path, scene=1))


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        ("near", r"must be one that it holds, 0, 1 'far', 2 '7'; it is 'near'"),
        (3, r"must be one that it holds, 0, 1 'far', 2 '7'; it is '3'"),
        ("7", "must hold triangles; it holds none"),
    ],
)
def test_unknown_and_empty_scenes_are_refused(tmp_path, scene, message):
    gltf = Gltf()
    two_scenes(gltf)
    with pytest.raises(FileFormatError, match=message):
        read(gltf.save(tmp_path), scene=scene)


def test_an_error_about_no_triangles_names_what_there_is(tmp_path):
    gltf = Gltf()
    two_scenes(gltf)
    gltf.tree["scene"] = 2
    with pytest.raises(
        FileFormatError, match="holds none; scene 2 is read of scenes 0, 1 'far', 2 '7'; scene= or"
    ):
        read(gltf.save(tmp_path))


def test_hidden_nodes_and_coarse_levels_are_left_out(tmp_path):
    gltf = Gltf()
    gltf.primitive()
    levels = {"MSFT_lod": {"ids": [3]}}
    hidden = {"KHR_node_visibility": {"visible": False}}
    gltf.tree["nodes"] = [
        {"mesh": 0, "children": [1], "extensions": levels},
        {"children": [2], "extensions": hidden},
        {"mesh": 0},
        {"mesh": 0},
    ]
    gltf.tree["extensionsUsed"] = ["MSFT_lod", "KHR_node_visibility"]
    gltf.tree["scenes"][0]["nodes"] = [0, 3]
    vertices, _, notes = read(gltf.save(tmp_path))
    assert len(vertices) == 6
    assert notes == ["1 nodes with a mesh are hidden by KHR_node_visibility, and left out"]


def test_extensions_that_are_not_read_are_named(tmp_path):
    gltf = Gltf()
    gltf.primitive()
    gltf.tree["extensionsUsed"] = ["KHR_materials_ior", "CESIUM_RTC", "AGI_articulations"]
    path = gltf.save(tmp_path)
    note = "extensions that are not read may move, add or select parts of the shape: 'CESIUM_RTC', 'AGI_articulations'"
    assert read(path)[2] == [note]
    with pytest.warns(UserWarning, match=rf"a\.glb: {note}"):
        es.read_mesh(path)


def test_compressed_copies_of_geometry_are_passed_over(tmp_path):
    gltf = Gltf()
    part = gltf.primitive()
    part["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    gltf.tree["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    gltf.tree["extensionsUsed"] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"]
    path = gltf.save(tmp_path)
    mesh, attributes = es.read_mesh(path, attributes=True)
    assert not save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    assert b"compression" not in (tmp_path / "b.glb").read_bytes()
    # A file that holds nothing else is refused, although it does not say that it must be.
    del gltf.tree["accessors"][part["attributes"]["POSITION"]]["bufferView"]
    with pytest.raises(FileFormatError, match="must hold its geometry plainly; it is compressed"):
        read(gltf.save(tmp_path))


def test_sparse_accessors_replace_rows(tmp_path):
    gltf = Gltf()
    part = gltf.primitive()
    rows = gltf.view(np.array([0, 4], "u1").tobytes())
    values = gltf.view(np.array([[-1, -1, 0], [0.5, 0.5, 7]], "<f4").tobytes())
    sparse = {
        "count": 2,
        "indices": {"bufferView": rows, "componentType": 5121},
        "values": {"bufferView": values},
    }
    accessor = gltf.tree["accessors"][part["attributes"]["POSITION"]]
    accessor["sparse"] = sparse
    wanted = VERTICES.copy()
    wanted[[0, 4]] = [[-1, -1, 0], [0.5, 0.5, 7]]
    path = gltf.save(tmp_path)
    np.testing.assert_array_equal(read(path)[0], wanted)
    mesh, attributes = es.read_mesh(path, attributes=True)
    assert not save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    same_corners(es.read_mesh(tmp_path / "b.glb"), mesh, atol=0)
    del accessor["bufferView"]  # the other rows are zeros
    wanted[[1, 2, 3, 5]] = 0
    np.testing.assert_array_equal(read(gltf.save(tmp_path))[0], wanted)
    accessor["count"] = 2**31
    with pytest.raises(FileFormatError, match="must stay within 4194304 vertices and faces"):
        read(gltf.save(tmp_path))
    accessor["count"] = 4
    with pytest.raises(
        FileFormatError,
        match=r"accessors\[0\] must replace rows that it has, 0\.\.3; it replaces \[0 4\]",
    ):
        read(gltf.save(tmp_path))


def test_the_text_of_a_gltf_file_is_read_without_a_folder():
    gltf = Gltf()
    gltf.primitive()
    with pytest.raises(FileFormatError, match="6 rows do not fit 0 bytes"):
        parse(json.dumps({**gltf.tree, "buffers": [{"byteLength": 1}]}).encode())


@pytest.mark.parametrize("coordinates", [0, 1])
def test_texture_transforms_are_applied_in_other_formats_and_stay_in_glb(tmp_path, coordinates):
    gltf = Gltf()
    gltf.primitive(TEXCOORD_1=gltf.add(2 * UV))
    transform = {"offset": [0.25, 0.5], "rotation": np.pi / 2, "scale": [2, 3]}
    transform |= {"texCoord": 1} if coordinates else {}
    texture = gltf.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    texture["extensions"] = {"KHR_texture_transform": transform}
    mesh, attributes = es.read_mesh(gltf.save(tmp_path), attributes=True)
    # u and v are scaled, then u becomes v and v becomes -u, then they are shifted; v goes up here.
    u, v = (1 + coordinates) * UV.T.astype(float)
    wanted = np.column_stack([0.25 + 3 * v, 1 - (0.5 - 2 * u)])
    np.testing.assert_allclose(attributes.texture_coordinates, wanted[mesh.faces], atol=1e-6)
    save_mesh(mesh, tmp_path / "b.obj", attributes=attributes)
    kept = es.read_mesh(tmp_path / "b.obj", attributes=True)[1]
    np.testing.assert_allclose(kept.texture_coordinates, wanted[mesh.faces], atol=1e-6)
    assert not save_mesh(mesh, tmp_path / "b.glb", attributes=attributes)
    tree = read_gltf((tmp_path / "b.glb").read_bytes()).tree
    assert tree["materials"] == gltf.tree["materials"]
    again = es.read_mesh(tmp_path / "b.glb", attributes=True)[1]
    np.testing.assert_allclose(again.texture_coordinates, attributes.texture_coordinates, atol=1e-6)


def test_images_of_newer_formats_are_carried(tmp_path):
    gltf = Gltf()
    gltf.primitive()
    gltf.tree["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    gltf.tree["images"][0]["uri"] = "data:image/webp;base64,UklGRg=="
    material = es.read_mesh(gltf.save(tmp_path), attributes=True)[1].materials[0]
    assert (material.image, material.image_name) == (b"RIFF", "grain.webp")


def test_colors_are_written_as_floats_in_linear_light(tmp_path):
    colors = np.array([[255, 188, 137], [0, 1, 2], [99, 250, 5], [7, 7, 7]], np.uint8)
    mesh = es.TriangleMesh(VERTICES[1:5].astype(float), [[0, 1, 2], [0, 2, 3]])
    es.write_mesh(mesh, tmp_path / "a.glb", colors=colors)
    gltf = read_gltf((tmp_path / "a.glb").read_bytes())
    accessor = gltf.tree["accessors"][1]
    assert (accessor["componentType"], accessor["type"]) == (5126, "VEC4")
    assert "normalized" not in accessor
    stored = np.frombuffer(gltf.buffers[0], "<f4", 16, offset=48).reshape(4, 4)
    assert {tuple(row) for row in stored[:, :3].round(5).tolist()} == {
        tuple(row) for row in linear_colors(colors / 255).astype("<f4").round(5).tolist()
    }
    again, kept = es.read_mesh(tmp_path / "a.glb", attributes=True)
    assert (again.vertices == mesh.vertices).all()
    np.testing.assert_array_equal(kept.colors[..., :3], colors[mesh.faces])


def test_a_shape_far_from_the_origin_keeps_its_digits(tmp_path):
    ball = es.icosphere(3)
    far = es.TriangleMesh(ball.vertices + np.array([500_000, 4_000_000, 100]), ball.faces)
    assert not save_mesh(far, tmp_path / "a.glb")
    again = es.read_mesh(tmp_path / "a.glb")
    np.testing.assert_allclose(again.vertices, far.vertices, rtol=0, atol=1e-7)
    assert surface_area(again) == pytest.approx(surface_area(ball), rel=1e-7)
    tree = read_gltf((tmp_path / "a.glb").read_bytes()).tree
    assert tree["nodes"][0]["translation"] == [500_000, 4_000_000, 100]
    # The node keeps the offset when the file is written again.
    mesh, attributes = es.read_mesh(tmp_path / "a.glb", attributes=True)
    bent = es.TriangleMesh(mesh.vertices + np.array([0.25, 0, 0]), mesh.faces)
    assert not save_mesh(bent, tmp_path / "b.glb", attributes=attributes)
    np.testing.assert_allclose(es.read_mesh(tmp_path / "b.glb").vertices, bent.vertices, atol=1e-7)


def test_what_single_precision_holds_stays_about_the_origin(tmp_path):
    far = es.TriangleMesh(VERTICES[:5] + np.array([4096.0, 0, 0]), FACES[:3])
    es.write_mesh(far, tmp_path / "a.glb")
    assert "translation" not in read_gltf((tmp_path / "a.glb").read_bytes()).tree["nodes"][0]


@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_rounding_of_small_parts_of_a_large_shape_is_named_or_refused(tmp_path, size):
    ball = es.icosphere(1)
    small = size * ball.vertices
    points = np.concatenate([small, small + np.array([1e6, 0, 0])])
    mesh = es.TriangleMesh(points, np.concatenate([ball.faces, ball.faces + ball.n_vertices]))
    if size == 1.0:
        lost = save_mesh(mesh, tmp_path / "a.glb")
        assert "the exact shape of 40 faces, of which 0 lose their area" in lost
        assert "single precision (.ply keeps all digits)" in lost
        return
    with pytest.raises(
        FileFormatError, match=r"rounding, or a node that flattens, changes the area"
    ):
        save_mesh(mesh, tmp_path / "a.glb")
    save_mesh(mesh, tmp_path / "a.ply")
    assert (es.read_mesh(tmp_path / "a.ply").vertices == points).all()
