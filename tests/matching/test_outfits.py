"""What a character wears on another one: textures, skins, blend shapes, fields, landmarks."""

from dataclasses import replace

import numpy as np
import pytest
from characters import blend_shapes, rig, texture_error, unwrap, write_character
from scipy.spatial import cKDTree

import eigenshape as es
from eigenshape import InvalidParameterError
from eigenshape.io.formats.gltf import (
    pack,
    parse,
    read_accessor,
    read_gltf,
    world_matrices,
)

N_VERTICES = 800


@pytest.fixture(scope="module")
def hero(tmp_path_factory):
    path = tmp_path_factory.mktemp("hero") / "hero.glb"
    write_character(path, "biped", 2000)
    return path


@pytest.fixture(scope="module")
def worn(hero):
    return es.read_mesh(hero, attributes=True)[1]


def read_back(path):
    """Return the parts of a written character: positions, weights by joint, targets, joints, coordinates."""
    gltf = read_gltf(path.read_bytes())
    (part,) = gltf.tree["meshes"][0]["primitives"]
    table = part["attributes"]
    points = read_accessor(gltf, table["POSITION"], 3)
    joints = read_accessor(gltf, table["JOINTS_0"], 4).astype(int)
    names = gltf.tree["skins"][0]["joints"]
    weights = np.zeros((len(points), len(names)))
    np.add.at(
        weights,
        (np.arange(len(points))[:, None], joints),
        read_accessor(gltf, table["WEIGHTS_0"], 4),
    )
    matrices = world_matrices(gltf, 0)[0]
    faces = read_accessor(gltf, part["indices"], 1).astype(int).reshape(-1, 3)
    return {
        "points": points,
        "weights": weights,
        "targets": [read_accessor(gltf, target["POSITION"], 3) for target in part["targets"]],
        "joints": np.array([matrices[node][:3, 3] for node in names]),
        "matrices": np.array([matrices[node] for node in names]),
        "coordinates": read_accessor(gltf, table["TEXCOORD_0"], 2)[faces],
        "gltf": gltf,
    }


@pytest.mark.long
def test_the_same_character_remeshed(worn, tmp_path):
    mesh, joints, _, weights = rig("biped", 2600)
    outfit = es.matching.transfer(worn, mesh)
    assert "surface of the source with other triangles" in outfit.report[0]
    assert (outfit.confidence == 1).all()
    es.write_mesh(mesh, tmp_path / "a.glb", attributes=outfit.attributes)
    found = read_back(tmp_path / "a.glb")
    distances, nearest = cKDTree(mesh.vertices).query(found["points"])
    assert distances.max() < 1e-6
    # The creature's own weights depend a little on its triangles, by which they are diffused.
    assert np.abs(found["weights"] - weights[nearest]).mean() < 0.01
    np.testing.assert_allclose(found["weights"].sum(axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(found["joints"], joints, atol=1e-3)
    for moves, wanted in zip(found["targets"], blend_shapes(mesh.vertices).values(), strict=True):
        errors = np.linalg.norm(moves - wanted[nearest], axis=1)
        assert errors.mean() < 0.01 * np.linalg.norm(wanted, axis=1).max()
    assert max(texture_error(tmp_path / "a.glb", mesh, unwrap(mesh))) < 0.02


def test_no_face_spans_the_texture(hero, worn, tmp_path):
    mesh = rig("biped", 2600)[0]
    outfit = es.matching.transfer(worn, mesh)
    widths = np.ptp(outfit.attributes.texture_coordinates[:, :, 0], axis=1)
    # On the axis, at the crown, all coordinates meet.
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    beside = np.hypot(middles[:, 0], middles[:, 2]) > 0.05
    assert widths[beside].max() < 0.3
    seam = (np.ptp(unwrap(mesh)[:, :, 0] % 1.0, axis=1) > 0.7).sum()
    assert seam > 30  # faces that lie across it


@pytest.fixture(scope="module")
def moved(worn):
    """A target that is the source turned, enlarged and shifted, and the match that says so."""
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    source = worn.mesh
    target = es.TriangleMesh(3.0 * source.vertices @ turn.T + [5, 6, 7], source.faces)
    return turn, target, identity_match(source)


def identity_match(mesh, confidence=None):
    n = mesh.n_vertices
    faces = np.zeros(n, dtype=np.int64)
    faces[mesh.faces.ravel()] = np.repeat(np.arange(mesh.n_faces), 3)
    corners = mesh.faces[faces]
    weights = (corners == np.arange(n)[:, None]).astype(float)
    sure = np.ones(n) if confidence is None else confidence
    return es.matching.ShapeMatch(
        np.arange(n),
        faces,
        corners,
        weights,
        sure,
        np.zeros((n, 12)),
        1.0,
        1.0,
        1.0,
        True,
        1,
        1.0,
        (),
    )


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_joints_and_blend_shapes_turn_and_grow_with_the_shape(worn, moved, hero, tmp_path):
    turn, target, match = moved
    outfit = es.matching.transfer(worn, target, match=match)
    es.write_mesh(target, tmp_path / "a.glb", attributes=outfit.attributes)
    before, after = read_back(hero), read_back(tmp_path / "a.glb")
    np.testing.assert_allclose(
        after["joints"], 3 * before["joints"] @ turn.T + [5, 6, 7], atol=1e-4
    )
    np.testing.assert_allclose(
        after["matrices"][:, :3, :3], turn @ before["matrices"][:, :3, :3], atol=1e-4
    )
    nearest = cKDTree(3 * before["points"] @ turn.T + [5, 6, 7]).query(after["points"])[1]
    for one, two in zip(before["targets"], after["targets"], strict=True):
        np.testing.assert_allclose(two, 3 * one[nearest] @ turn.T, atol=2e-4)
    np.testing.assert_allclose(after["weights"], before["weights"][nearest], atol=1e-6)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_the_target_is_the_rest_pose(worn, moved, tmp_path):
    _, target, match = moved
    outfit = es.matching.transfer(worn, target, match=match)
    es.write_mesh(target, tmp_path / "a.glb", attributes=outfit.attributes)
    vertices, _, *notes = parse((tmp_path / "a.glb").read_bytes())
    assert not notes
    assert cKDTree(target.vertices).query(vertices)[0].max() < 1e-5


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_animations_move_joints_about_their_new_places(worn, moved, tmp_path):
    _, target, match = moved
    outfit = es.matching.transfer(worn, target, match=match)
    es.write_mesh(target, tmp_path / "a.glb", attributes=outfit.attributes)
    gltf = read_back(tmp_path / "a.glb")["gltf"]
    (animation,) = gltf.tree["animations"]
    (sampler,) = animation["samplers"]
    rest = gltf.tree["nodes"][0]["translation"]
    steps = read_accessor(gltf, sampler["output"], 3)
    # A hop of 0.1 in the file of the source is one of 0.3 of a target of three times its size.
    np.testing.assert_allclose(steps, [rest, np.add(rest, [0, 0.3, 0])], atol=1e-4)


def test_places_in_doubt_are_filled_and_named(worn, moved):
    _, target, _ = moved
    mesh = worn.mesh
    head = mesh.vertices[:, 1] > np.quantile(mesh.vertices[:, 1], 0.97)
    match = identity_match(mesh, np.where(head, 0.1, 0.9))
    # What the map says of the head is wrong: it lies on a foot.
    foot = int(mesh.vertices[:, 1].argmin())
    for name in ("faces", "corners", "weights"):
        values = getattr(match, name).copy()
        values[head] = values[foot]
        match = replace(match, **{name: values})
    outfit = es.matching.transfer(worn, target, match=match)
    np.testing.assert_array_equal(outfit.filled, head)
    sizes = np.linalg.norm(outfit.places[head] - mesh.vertices[head], axis=1)
    assert sizes.max() < 0.3  # the foot is 2 away
    (sentence,) = outfit.report
    assert f"{len(np.unique(mesh.vertices[head], axis=0))} vertices" in sentence
    assert any(f"about vertex {vertex} at" in sentence for vertex in np.flatnonzero(head))
    assert "mean confidence of 0.10: taken from the surface around" in sentence
    np.testing.assert_array_equal(outfit.attributes.fields["confidence"], outfit.confidence)


def test_a_piece_in_doubt_goes_along_with_what_is_nearest(tmp_path):
    ball, eye = es.icosphere(3), es.icosphere(1)
    eye = es.TriangleMesh(0.1 * eye.vertices + np.array([0, 0, 1.05]), eye.faces)
    both = es.geometry.disjoint_union(ball, eye)
    sure = np.r_[np.full(ball.n_vertices, 0.9), np.full(eye.n_vertices, 0.1)]
    worn = fields_of(both, {"height": both.vertices[:, 2]}, tmp_path)
    match = identity_match(both, sure)
    # The map puts the eye at one point on the other side.
    far = int(both.vertices[:, 2].argmin())
    for name in ("faces", "corners", "weights"):
        values = getattr(match, name).copy()
        values[ball.n_vertices :] = values[far]
        match = replace(match, **{name: values})
    moved = es.TriangleMesh(2 * both.vertices, both.faces)
    outfit = es.matching.transfer(worn, moved, match=match)
    np.testing.assert_array_equal(outfit.filled, sure < 0.5)
    assert "taken from the surface around" in outfit.report[0]
    np.testing.assert_allclose(outfit.places, both.vertices, atol=0.01)
    np.testing.assert_allclose(outfit.attributes.fields["height"], both.vertices[:, 2], atol=0.01)


def test_the_same_faces_correspond_by_number(tmp_path):
    mesh = es.shapes.grid(3, 2)
    worn = fields_of(mesh, {"x": mesh.vertices[:, 0]}, tmp_path)
    rolled = es.TriangleMesh(mesh.vertices[:, [2, 0, 1]] + 5.0, mesh.faces)
    outfit = es.matching.transfer(worn, rolled)
    assert outfit.report == ("both have the same faces: vertices of one number correspond",)
    np.testing.assert_array_equal(outfit.attributes.fields["x"], mesh.vertices[:, 0])


def test_nothing_is_sure(tmp_path):
    ball = es.icosphere(2)
    worn = fields_of(ball, {"height": ball.vertices[:, 2]}, tmp_path)
    match = identity_match(ball, np.zeros(ball.n_vertices))
    outfit = es.matching.transfer(worn, ball, match=match)
    assert not outfit.filled.any()
    assert "100% of the area is in doubt" in outfit.report[0]
    assert "all is left as mapped" in outfit.report[0]


def fields_of(mesh, fields, folder):
    es.io.write_fields(mesh, folder / "fields.vtp", fields)
    return es.read_mesh(folder / "fields.vtp", attributes=True)[1]


def test_fields_labels_and_landmarks_go_along(tmp_path):
    ball, finer = es.icosphere(2), es.icosphere(3)
    upper = (ball.vertices[:, 2] > 0).astype(np.int32)
    worn = fields_of(ball, {"height": ball.vertices[:, 2], "label": upper}, tmp_path)
    landmarks = es.morphometrics.Landmarks(["pole", "none"], [[0, 0, 1.0], [np.nan] * 3])
    outfit = es.matching.transfer(worn, finer, landmarks=landmarks)
    fields = outfit.attributes.fields
    np.testing.assert_allclose(fields["height"], finer.vertices[:, 2], atol=0.02)
    assert fields["label"].dtype == np.int32
    clear = np.abs(finer.vertices[:, 2]) > 0.2  # farther from the border than an edge is long
    np.testing.assert_array_equal(fields["label"][clear], finer.vertices[clear, 2] > 0)
    np.testing.assert_allclose(outfit.landmarks.points[0], [0, 0, 1], atol=0.01)
    assert np.isnan(outfit.landmarks.points[1]).all()
    # In GLB they are attributes of vertices.
    es.write_mesh(finer, tmp_path / "a.glb", attributes=outfit.attributes)
    gltf = read_gltf((tmp_path / "a.glb").read_bytes())
    table = gltf.tree["meshes"][0]["primitives"][0]["attributes"]
    assert {"_HEIGHT", "_LABEL", "_CONFIDENCE"} < table.keys()
    heights = read_accessor(gltf, table["_HEIGHT"], 1)[:, 0]
    points = read_accessor(gltf, table["POSITION"], 3)
    np.testing.assert_allclose(heights, points[:, 2], atol=0.02)


def test_colors_groups_and_materials_of_obj(tmp_path):
    ball, finer = es.icosphere(2), es.icosphere(3)
    lines = [f"v {x} {y} {z} {(z + 1) / 2} 0.5 0" for x, y, z in ball.vertices.tolist()]
    upper = ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0
    for name, chosen in (("top", upper), ("bottom", ~upper)):
        lines += [f"g {name}", f"usemtl {name}"]
        lines += [f"f {a} {b} {c}" for a, b, c in (ball.faces[chosen] + 1).tolist()]
    (tmp_path / "a.obj").write_text("\n".join(["mtllib a.mtl", *lines, ""]))
    (tmp_path / "a.mtl").write_text("newmtl top\nKd 1 0 0\nnewmtl bottom\nKd 0 0 1\n")
    _, worn = es.read_mesh(tmp_path / "a.obj", attributes=True)
    outfit = es.matching.transfer(worn, finer)
    found = outfit.attributes
    middles = finer.vertices[finer.faces].mean(axis=1)[:, 2]
    clear = np.abs(middles) > 0.2
    names = np.array(found.groups)[found.face_groups]
    np.testing.assert_array_equal(names[clear] == "top", middles[clear] > 0)
    colors = np.array([found.materials[number].color for number in found.face_materials])
    np.testing.assert_array_equal(colors[clear, 0] == 1, middles[clear] > 0)
    wanted = 255 * (finer.vertices[finer.faces][:, :, 2] + 1) / 2
    assert np.abs(found.colors[:, :, 0] - wanted).max() < 4
    es.write_mesh(finer, tmp_path / "a.glb", attributes=found)
    again, read = es.read_mesh(tmp_path / "a.glb", attributes=True)
    assert set(read.groups) == {"top", "bottom"}
    assert again.n_faces == finer.n_faces


def test_a_map_of_other_shapes_is_refused(worn, moved):
    match = moved[2]
    ball = es.icosphere(1)
    with pytest.raises(
        InvalidParameterError, match=f"has {match.n_vertices} vertices, and the target has 42"
    ):
        es.matching.transfer(worn, ball, match=match)
    with pytest.raises(
        InvalidParameterError, match=r"puts vertex \d+ into face \d+ .* no such face. Pass"
    ):
        es.matching.transfer(worn, ball, match=identity_match(ball))


def test_a_source_without_anything_is_refused(tmp_path):
    ball = es.icosphere(1)
    es.write_mesh(ball, tmp_path / "a.off")
    _, bare = es.read_mesh(tmp_path / "a.off", attributes=True)
    with pytest.raises(
        InvalidParameterError,
        match=r"no texture coordinates, vertex colors, .* skins or morph targets",
    ):
        es.matching.transfer(bare, ball)
    # Landmarks alone are something.
    pole = es.morphometrics.Landmarks(["pole"], [[0, 0, 1.0]])
    assert es.matching.transfer(bare, ball, landmarks=pole).landmarks.points.shape == (1, 3)


def test_a_skin_without_weights_is_named(hero, tmp_path):
    gltf = read_gltf(hero.read_bytes())
    del gltf.tree["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    (tmp_path / "a.glb").write_bytes(pack(gltf.tree, gltf.buffers[0]))
    with pytest.raises(
        es.FileFormatError, match="must have JOINTS_0, WEIGHTS_0; it has no WEIGHTS_0"
    ):
        es.read_mesh(tmp_path / "a.glb", attributes=True)


@pytest.mark.long
def test_another_individual_in_its_own_pose(tmp_path):
    write_character(tmp_path / "a.glb", "quadruped", 1500)
    _, worn = es.read_mesh(tmp_path / "a.glb", attributes=True)
    weights = rig("quadruped", 1000, 3)[3]
    target = es.make_creature("quadruped", 2, n_vertices=1000, individual=3)
    outfit = es.matching.transfer(worn, target)
    es.write_mesh(target, tmp_path / "b.glb", attributes=outfit.attributes)
    found = read_back(tmp_path / "b.glb")
    nearest = cKDTree(target.vertices).query(found["points"])[1]
    assert np.abs(found["weights"] - weights[nearest]).mean() < 0.02
    # All joints but the root, which is not in the body of each creature, lie within.
    assert (es.geometry.winding_numbers(target, found["joints"][1:]) > 0.5).mean() > 0.8
