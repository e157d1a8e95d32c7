"""The operators of the extension, run without a window: what they write, undo and refuse."""

import importlib.util
import re
import subprocess
import sys
import tomllib
import zipfile
from itertools import combinations
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

import eigenshape as es

bpy = pytest.importorskip("bpy", reason="needs Blender as a module: pip install 'bpy==4.5.*'")

# Load the folder as Blender does, under a name of its own: `eigenshape` is the library.
FOLDER = Path(__file__).parent.parent
spec = importlib.util.spec_from_file_location("eigenshape_extension", FOLDER / "__init__.py")
extension = importlib.util.module_from_spec(spec)
sys.modules["eigenshape_extension"] = extension
spec.loader.exec_module(extension)

from eigenshape_extension import bending, build, matching, operation, panel, surface  # noqa: E402
from eigenshape_extension.surface import read_surface  # noqa: E402
from mathutils import Matrix, Quaternion  # noqa: E402

FINISHED = {"FINISHED"}
SINGLE = 1e-6  # relative rounding of Blender's coordinates, in single precision


@pytest.fixture(scope="session", autouse=True)
def _registered():
    extension.register()
    yield
    extension.unregister()


@pytest.fixture(autouse=True)
def _empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture
def add():
    """Return a function that adds a mesh to the scene, selected and active."""

    def add_object(name, vertices, faces):
        data = bpy.data.meshes.new(name)
        data.from_pydata(vertices, [], faces)
        made = bpy.data.objects.new(name, data)
        bpy.context.collection.objects.link(made)
        made.select_set(True)
        bpy.context.view_layer.objects.active = made
        return made

    return add_object


@pytest.fixture(scope="session")
def creature():
    """Return a quadruped with 1,000 vertices."""
    return es.make_creature("quadruped", n_vertices=1000)


def coordinates(owner):
    return np.array([vertex.co[:] for vertex in owner.data.vertices])


def seen_mesh(owner):
    """Return the triangles as Blender keeps them, in single precision."""
    owner.data.calc_loop_triangles()
    faces = [triangle.vertices[:] for triangle in owner.data.loop_triangles]
    return es.TriangleMesh(coordinates(owner), faces)


def raise_error(error):
    def fail(*_args, **_options):
        raise error

    return fail


def attribute(owner, name):
    return np.array([each.value for each in owner.data.attributes[name].data])


def groups(owner):
    """Return the vertices of each vertex group."""
    members = {group.name: set() for group in owner.vertex_groups}
    for vertex in owner.data.vertices:
        for entry in vertex.groups:
            members[owner.vertex_groups[entry.group].name].add(vertex.index)
    return members


def grid(n=12):
    """Return a wavy grid of n by n quads, the first two of which are one face of six corners."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    vertices = np.column_stack([x.ravel(), y.ravel(), 0.2 * np.sin(x.ravel())])
    first = np.arange((n + 1) * (n + 1)).reshape(n + 1, n + 1)[:-1, :-1].ravel()
    faces = [[i, i + 1, i + n + 2, i + n + 1] for i in first.tolist()]
    one, two = faces[:2]
    return vertices, [[one[0], one[1], two[1], two[2], one[2], one[3]], *faces[2:]]


@pytest.fixture
def animal(add, creature):
    return add("animal", creature.vertices, creature.faces.tolist())


def test_parts_are_groups_that_cover_each_vertex_once(animal):
    assert bpy.ops.eigenshape.find_parts() == FINISHED
    members = groups(animal)
    assert len(members) == len(es.find_parts(seen_mesh(animal)).parts.features.vertices) > 4
    assert all(not one & two for one, two in combinations(members.values(), 2))
    assert set().union(*members.values()) == set(range(1000))
    parts = attribute(animal, "part")
    for name, vertices in members.items():
        assert set(np.flatnonzero(parts == int(name.split()[1]))) == vertices


def test_parts_of_another_level_replace_the_groups(animal):
    animal.vertex_groups.new(name="mine")
    bpy.ops.eigenshape.find_parts(level=2)
    n_fine = len(animal.vertex_groups)
    bpy.ops.eigenshape.find_parts(level=-2)
    names = [group.name for group in animal.vertex_groups]
    assert names[0] == "mine"
    assert all(re.fullmatch(r"part \d+", name) for name in names[1:])
    assert len(names) < n_fine


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (100, 100, 100), (-1, 1, 1)])
def test_parts_do_not_depend_on_the_scale_of_the_object(animal, scale):
    bpy.ops.eigenshape.find_parts()
    before = groups(animal)
    animal.scale = scale
    animal.rotation_euler = (np.pi / 2, 0, 0)  # y up
    bpy.ops.eigenshape.find_parts()
    # Two legs are twins, whose numbers rounding decides.
    found = groups(animal)
    assert found.keys() == before.keys()
    assert sorted(map(sorted, found.values())) == sorted(map(sorted, before.values()))


def test_eigenfunctions_of_polygons_are_those_of_their_triangles(add):
    owner = add("grid", *grid())
    assert bpy.ops.eigenshape.eigenfunctions(count=6) == FINISHED
    mesh = seen_mesh(owner)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 6)
    for number, function in enumerate(spectrum.eigenvectors.T):
        found = attribute(owner, f"eigenfunction {number}")
        np.testing.assert_allclose(found, function, atol=SINGLE * abs(function).max())
    assert len(owner.data.polygons) == 143  # the n-gons are still there
    assert owner.data.color_attributes.active_color.name == "eigenshape"


def test_eigenfunctions_are_computed_in_the_world(add):
    owner = add("grid", *grid())
    owner.scale = (1, 3, 1)
    bpy.ops.eigenshape.eigenfunctions(count=3)
    mesh = seen_mesh(owner)
    stretched = es.TriangleMesh(mesh.vertices * [1, 3, 1], mesh.faces)
    function = es.solve_spectrum(es.cotangent_laplacian(stretched), 3).eigenvectors[:, 1]
    np.testing.assert_allclose(attribute(owner, "eigenfunction 1"), function, atol=SINGLE)


def test_heat_is_that_of_the_library(animal):
    assert bpy.ops.eigenshape.heat(n_times=3, n_modes=40) == FINISHED
    spectrum = es.solve_spectrum(es.cotangent_laplacian(seen_mesh(animal)), 40)
    heat = es.heat_kernel_signature(spectrum, es.spectral.default_times(spectrum, 3))
    for number, function in enumerate(heat.T):
        np.testing.assert_allclose(attribute(animal, f"heat {number}"), function, rtol=SINGLE)


def test_the_last_eigenfunction_is_shown_as_colors(animal):
    bpy.ops.eigenshape.eigenfunctions(count=3)
    shown = animal.data.color_attributes["eigenshape"].data
    expected = es.plot.value_colors(attribute(animal, "eigenfunction 2"), "RdBu_r")
    found = np.array([each.color_srgb[:3] for each in shown])
    np.testing.assert_allclose(found, expected / 255, atol=1 / 255)


def test_a_vertex_without_a_face_has_no_part(add, creature):
    lonely = np.vstack([[[9.0, 9.0, 9.0]], creature.vertices])
    owner = add("animal", lonely, (creature.faces + 1).tolist())
    bpy.ops.eigenshape.find_parts()
    assert set().union(*groups(owner).values()) == set(range(1, 1001))
    bpy.ops.eigenshape.heat(n_times=2, n_modes=10)
    assert attribute(owner, "heat 0")[0] == 0 < attribute(owner, "heat 0")[1:].min()


def test_a_double_vertex_is_refused_until_repair_is_ticked(add, creature):
    """A leg is cut off, with vertices of its own on both sides of the cut."""
    faces = creature.faces.copy()
    cut = creature.vertices[faces].mean(axis=1)[:, 0] > np.median(creature.vertices[:, 0])
    faces[cut] += creature.n_vertices
    owner = add("cut", np.vstack([creature.vertices] * 2), faces.tolist())
    with pytest.raises(RuntimeError, match=r"must share their vertices.*Here: tick Repair\."):
        bpy.ops.eigenshape.find_parts()
    assert not owner.vertex_groups
    assert bpy.ops.eigenshape.find_parts(repair=True) == FINISHED
    assert set().union(*groups(owner).values()) == set(np.unique(faces).tolist())
    parts = attribute(owner, "part")
    both = np.intersect1d(faces[cut] - creature.n_vertices, faces[~cut])
    assert len(both) > 5
    np.testing.assert_array_equal(parts[both], parts[both + creature.n_vertices])


def test_modifiers_are_applied_on_request_only(animal):
    animal.modifiers.new("finer", "SUBSURF").levels = 1
    bpy.ops.eigenshape.find_parts()
    assert (len(animal.data.vertices), len(animal.modifiers)) == (1000, 1)
    bpy.ops.eigenshape.find_parts(apply_modifiers=True)
    n_fine = len(animal.data.vertices)
    assert n_fine > 3900
    assert not animal.modifiers
    assert set().union(*groups(animal).values()) == set(range(n_fine))


def test_modifiers_stay_where_the_computation_fails(animal):
    animal.modifiers.new("finer", "SUBSURF").levels = 1
    with pytest.raises(RuntimeError, match="k must lie"):
        bpy.ops.eigenshape.eigenfunctions(count=9999, apply_modifiers=True)
    assert (len(animal.data.vertices), len(animal.modifiers)) == (1000, 1)


def test_modifiers_of_a_mesh_with_shape_keys_are_refused(animal):
    animal.shape_key_add(name="Basis")
    animal.modifiers.new("finer", "SUBSURF")
    with pytest.raises(RuntimeError, match="without shape keys; 'animal' has 1"):
        bpy.ops.eigenshape.find_parts(apply_modifiers=True)


def test_what_cannot_be_computed_is_named(add):
    with pytest.raises(RuntimeError, match="An object must be active; none is"):
        bpy.ops.eigenshape.find_parts()
    add("empty", [], [])
    with pytest.raises(RuntimeError, match="'empty' has 0 vertices and no face"):
        bpy.ops.eigenshape.find_parts()
    add("points", [[0, 0, 0], [1, 0, 0]], [])
    with pytest.raises(RuntimeError, match="'points' has 2 vertices and no face"):
        bpy.ops.eigenshape.heat()
    bpy.ops.object.camera_add()
    with pytest.raises(RuntimeError, match=r"'Camera' is of the type CAMERA\. Click a mesh"):
        bpy.ops.eigenshape.bend()


def test_an_object_of_another_file_is_refused_until_it_is_local(animal, tmp_path: Path):
    path = str(tmp_path / "other.blend")
    bpy.data.libraries.write(path, {animal})
    bpy.data.objects.remove(animal)
    with bpy.data.libraries.load(path, link=True) as (there, here):
        here.objects = there.objects
    (linked,) = here.objects
    bpy.context.collection.objects.link(linked)
    bpy.context.view_layer.objects.active = linked
    with pytest.raises(RuntimeError, match="'animal' is linked from another one"):
        bpy.ops.eigenshape.eigenfunctions(count=2)
    linked.select_set(True)
    bpy.ops.object.make_local(type="SELECT_OBDATA")
    assert bpy.ops.eigenshape.eigenfunctions(count=2) == FINISHED


def test_a_flat_object_is_refused(animal):
    animal.scale = (1, 1, 0)
    with pytest.raises(RuntimeError, match="not be 0 along an axis; that of 'animal' is"):
        bpy.ops.eigenshape.eigenfunctions(count=2)


def test_edit_mode_is_refused_with_its_key(animal):
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Change to Object Mode with Tab"):
        bpy.ops.eigenshape.find_parts()


def test_a_bend_turns_the_group_as_the_library_does(animal):
    animal.scale = (2, 2, 2)
    bpy.ops.eigenshape.find_parts()
    name = animal.vertex_groups[1].name
    mesh = read_surface(bpy.context, animal).mesh
    region = np.isin(np.arange(1000), list(groups(animal)[name]))
    pivot = mesh.vertices[es.deformation.region_boundary(mesh, region)].mean(axis=0)
    bent = es.deform(es.rig_shape(mesh), region, es.Rotation(pivot, [1, 0, 0], 0.5))
    assert bpy.ops.eigenshape.bend(group=name, axis=(1, 0, 0), angle=0.5) == FINISHED
    np.testing.assert_allclose(2 * coordinates(animal), bent.vertices, atol=1e-5)
    assert np.abs(bent.vertices - mesh.vertices).max() > 0.05


def test_a_bend_of_a_mesh_with_shape_keys_is_a_shape_key(animal):
    bpy.ops.eigenshape.find_parts()
    animal.shape_key_add(name="Basis")
    before = coordinates(animal)
    bpy.ops.eigenshape.bend(angle=0.5)
    key = animal.data.shape_keys.key_blocks["bent"]
    moved = np.array([point.co[:] for point in key.data])
    np.testing.assert_array_equal(coordinates(animal), before)
    assert key.value == 1
    assert np.abs(moved - before).max() > 0.05


def test_a_bend_needs_a_group(animal):
    with pytest.raises(RuntimeError, match=r"'animal' has the groups \[\], and not ''"):
        bpy.ops.eigenshape.bend()


def test_undo_takes_an_operator_back(animal):
    name = animal.name
    bpy.ops.ed.undo_push(message="begin")
    bpy.ops.eigenshape.find_parts("EXEC_DEFAULT", True)
    bpy.ops.eigenshape.bend("EXEC_DEFAULT", True, angle=0.5)
    bent = coordinates(bpy.data.objects[name])
    bpy.ops.ed.undo()
    owner = bpy.data.objects[name]
    assert len(owner.vertex_groups) > 4
    assert np.abs(coordinates(owner) - bent).max() > 0.05
    bpy.ops.ed.undo()
    assert not bpy.data.objects[name].vertex_groups


@pytest.fixture
def pair(add):
    """Return an animal with weights, a shape key and colors, and another pose of it, active."""
    creature, pose = (es.make_creature("quadruped", each, n_vertices=600) for each in (0, 1))
    whole = add("whole", creature.vertices, creature.faces.tolist())
    bpy.ops.eigenshape.find_parts()
    height = creature.vertices[:, 1]
    low = whole.vertex_groups.new(name="low")
    for vertex, weight in enumerate((height.max() - height) / np.ptp(height)):
        low.add([vertex], float(weight), "REPLACE")
    whole.shape_key_add(name="Basis")
    fat = whole.shape_key_add(name="fat")
    shift = creature.vertices + 0.05 * es.geometry.vertex_normals(creature)
    fat.data.foreach_set("co", shift.astype(np.float32).ravel())
    fat.value = 0.5
    other = add("other", pose.vertices, pose.faces.tolist())
    other.rotation_euler = (0.5, 0, 1)
    return whole, other


@pytest.mark.long
def test_a_match_transfers_weights_keys_and_colors(pair):
    whole, other = pair
    one, two = (read_surface(bpy.context, each).mesh for each in (other, whole))
    match = es.match_shapes(one, two, scale="known")
    everything = {"WEIGHTS", "KEYS", "COLORS"}
    assert bpy.ops.eigenshape.match(scale="known", transfer=everything) == FINISHED
    np.testing.assert_array_equal(attribute(other, "match vertex"), match.vertices)
    np.testing.assert_allclose(attribute(other, "match confidence"), match.confidence, atol=SINGLE)
    names, weights = read_surface(bpy.context, whole).group_weights()
    assert [group.name for group in other.vertex_groups] == names
    found = read_surface(bpy.context, other).group_weights()[1]
    np.testing.assert_allclose(found, match.pull(weights), atol=SINGLE)
    # Fatter is along the normals, in any pose.
    key = other.data.shape_keys.key_blocks["fat"]
    assert key.value == 0.5
    shift = np.array([point.co[:] for point in key.data]) - coordinates(other)
    normals = es.geometry.vertex_normals(seen_mesh(other))
    cosines = (shift * normals).sum(axis=1) / np.linalg.norm(shift, axis=1)
    assert np.median(cosines) > 0.95
    shown = other.data.color_attributes["eigenshape"].data
    colors = match.pull(read_surface(bpy.context, whole).read_colors())
    np.testing.assert_allclose([each.color_srgb[:3] for each in shown], colors / 255, atol=0.005)


@pytest.mark.long
def test_a_uv_map_is_cut_where_its_seams_are(pair):
    whole, other = pair
    around = whole.data.uv_layers.new(name="around")
    points = coordinates(whole)
    for face in whole.data.polygons:
        corners = points[face.vertices]
        angles = np.unwrap(np.arctan2(corners[:, 1], corners[:, 2]))
        for loop, angle, x in zip(face.loop_indices, angles, corners[:, 0], strict=True):
            around.uv[loop].vector = (angle / 7, x)
    match = es.match_shapes(*(read_surface(bpy.context, each).mesh for each in (other, whole)))
    assert bpy.ops.eigenshape.match(transfer={"UVS"}) == FINISHED
    found = other.data.uv_layers["around"]
    assert other.data.uv_layers.active == found
    sure = match.sure()
    where = match.pull(points)[:, 0]
    vertices = np.array([loop.vertex_index for loop in other.data.loops])
    uv = np.array([each.vector[:] for each in found.uv])
    np.testing.assert_allclose(
        uv[sure[vertices], 1], where[vertices][sure[vertices]], atol=0.02 * np.ptp(points[:, 0])
    )
    # At the seam, none goes back over the map: what spans half of it does so on the animal, at its ends.
    given = np.array([each.vector[:] for each in around.uv])
    wide, widest = (np.ptp(each[:, 0].reshape(-1, 3), axis=1) > 0.4 for each in (uv, given))
    assert wide.sum() <= 2 * widest.sum() < 10


def test_a_polygon_looks_into_one_chart():
    square = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1]], [[0, 1, 2], [0, 2, 3]])
    texture = square.vertices[square.faces][:, :, :2] / 4
    elsewhere = texture + np.array([0, 0.7])[:, None, None]
    for given, expected in ((texture, texture), (elsewhere, texture)):
        found = surface.one_chart_each(given, square, np.array([0, 0]))
        np.testing.assert_allclose(found, expected, atol=0.01)


def test_a_uv_map_must_be_there_to_be_transferred(animal, add, creature):
    add("other", creature.vertices, creature.faces.tolist())
    with pytest.raises(RuntimeError, match="must have a UV map; 'animal' has none"):
        bpy.ops.eigenshape.match(transfer={"UVS"})


def test_turns_between_two_poses_are_their_rotation():
    mesh = es.icosphere(2)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    turns = matching.turns_between(mesh, mesh.vertices @ turn)
    np.testing.assert_allclose(turns, np.broadcast_to(turn, (162, 3, 3)), atol=1e-12)


def test_a_match_needs_one_other_object(animal, add):
    with pytest.raises(RuntimeError, match=r"beside the active one; these are: \[\]"):
        bpy.ops.eigenshape.match()
    for name in "ab":
        add(name, [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(RuntimeError, match=r"these are: \['a', 'animal'\]"):
        bpy.ops.eigenshape.match()


def test_colors_must_be_there_to_be_transferred(animal, add, creature):
    add("other", creature.vertices, creature.faces.tolist())
    with pytest.raises(RuntimeError, match="'animal' has no color attribute"):
        bpy.ops.eigenshape.match(transfer={"COLORS"})


def test_colors_of_corners_are_averaged(add):
    owner = add("square", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 3, 2]])
    colors = owner.data.color_attributes.new("mine", "FLOAT_COLOR", "CORNER")
    for corner, loop in zip(colors.data, owner.data.loops, strict=True):
        corner.color_srgb = (loop.vertex_index / 10, 0, 1, 1)
    found = read_surface(bpy.context, owner).read_colors() / 255
    np.testing.assert_allclose(found, [[0, 0, 1], [0.1, 0, 1], [0.2, 0, 1], [0.3, 0, 1]], atol=1e-3)


def test_a_search_lists_what_was_added(animal, add, tmp_path: Path):
    folder = str(tmp_path / "index")
    assert bpy.ops.eigenshape.add_to_index(folder=folder, label="cow") == FINISHED
    fish = es.make_creature("fish", n_vertices=500)
    path = tmp_path / "fish.ply"
    es.write_mesh(fish, path)
    es.ShapeIndex.open(folder).add("a fish", fish, source=str(path), n_views=0)
    assert bpy.ops.eigenshape.search(folder=folder) == FINISHED
    found = bpy.context.window_manager.eigenshape_found
    assert [(each.name, each.label) for each in found] == [("animal", "cow"), ("a fish", "")]
    assert found[0].score < found[1].score
    assert bpy.ops.eigenshape.load(source=found[1].source) == FINISHED
    loaded = bpy.context.object
    assert loaded.name == "fish"
    upright = read_surface(bpy.context, loaded).mesh.vertices
    np.testing.assert_allclose(upright[:, 2], fish.vertices[:, 1], atol=1e-5)


def test_a_file_that_is_gone_is_named(tmp_path: Path):
    with pytest.raises(RuntimeError, match=r"Error: .*gone\.ply"):
        bpy.ops.eigenshape.load(source=str(tmp_path / "gone.ply"))
    assert not bpy.data.objects


def test_a_search_needs_an_index(animal, tmp_path: Path):
    with pytest.raises(RuntimeError, match="A folder must be chosen as the index; none is"):
        bpy.ops.eigenshape.search()
    with pytest.raises(RuntimeError, match=r"or press Add to Index: it makes one there\.$"):
        bpy.ops.eigenshape.search(folder=str(tmp_path))
    folder = str(tmp_path / "made")
    for again in ({}, {"replace": True}):  # what both messages advise
        assert bpy.ops.eigenshape.add_to_index(folder=folder, **again) == FINISHED
        assert bpy.ops.eigenshape.search(folder=folder) == FINISHED
        with pytest.raises(RuntimeError, match=r"Remove it first, or tick Replace\.$"):
            bpy.ops.eigenshape.add_to_index(folder=folder)


def test_a_loaded_shape_of_another_unit_is_noted(animal, creature, tmp_path: Path, capfd):
    path = tmp_path / "large.ply"
    for factor, is_noted in ((100.0, True), (1 / 25.4, True), (1.5, False)):
        es.write_mesh(es.TriangleMesh(creature.vertices * factor, creature.faces), path)
        bpy.context.view_layer.objects.active = animal
        assert bpy.ops.eigenshape.load(source=str(path)) == FINISHED
        text = f"is {factor:.3g} times as large as animal: perhaps its unit of length"
        assert (text in capfd.readouterr().out) == is_noted


@pytest.mark.parametrize(("scale", "factor"), [("auto", 10), ("auto", 0.01), ("known", 100)])
def test_a_match_to_another_unit_is_noted(animal, add, creature, scale, factor, capfd):
    whole = add("whole", creature.vertices, creature.faces.tolist())
    whole.scale = [factor] * 3
    bpy.context.view_layer.objects.active = animal
    assert bpy.ops.eigenshape.match(scale=scale) == FINISHED
    assert f"whole is {factor:.3g} times as large as animal" in capfd.readouterr().out


def test_a_match_to_a_smaller_unit_advises_what_blender_has(animal, add, creature):
    add("whole", creature.vertices / 10, creature.faces.tolist())
    bpy.context.view_layer.objects.active = animal
    with pytest.raises(RuntimeError, match=r"Exchange the two shapes, or set Scale to Unknown\.$"):
        bpy.ops.eigenshape.match(scale="known")


def test_a_piece_with_one_side_only_is_cut_as_the_message_advises(add):
    # A strip around a circle, two vertices across, which turns over once on its way
    turn = np.repeat(2 * np.pi * np.arange(24) / 24, 2)
    across = np.tile([-0.3, 0.3], 24)
    rim = 1 + across * np.cos(turn / 2)
    points = np.stack([rim * np.cos(turn), rim * np.sin(turn), across * np.sin(turn / 2)], axis=1)
    numbers = [*range(48), 1, 0]
    quads = [[numbers[at + side] for side in (0, 2, 3, 1)] for at in range(0, 48, 2)]
    owner = add("strip", points, quads)
    advice = r"Here: in Edit Mode, .* choose Mesh > Split > Faces by Edges\.$"
    with pytest.raises(RuntimeError, match=advice) as caught:
        bpy.ops.eigenshape.find_parts()
    assert "command line" not in str(caught.value)
    for part in (*owner.data.polygons, *owner.data.vertices, *owner.data.edges):
        part.select = False
    (across,) = [edge for edge in owner.data.edges if set(edge.vertices) == {0, 1}]
    across.select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type="EDGE")
    bpy.ops.mesh.edge_split(type="EDGE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.eigenshape.find_parts() == FINISHED


def test_pieces_that_a_spectrum_refuses_are_named_with_what_blender_does(add, monkeypatch):
    """What a spectrum of many pieces advises; thousands of pieces would be made to meet it."""
    sphere = es.icosphere(1)
    add("sphere", sphere.vertices, sphere.faces.tolist())
    advice = es.spectral.pencils.ADVICE
    for text in (advice.separate, advice.pieces, advice.scales):
        with monkeypatch.context() as patch:
            patch.setattr(es, "cotangent_laplacian", raise_error(es.InvalidShapeError(text)))
            with pytest.raises(RuntimeError, match="Here: tick Repair") as caught:
                bpy.ops.eigenshape.eigenfunctions()
        assert "command line" not in str(caught.value)


def test_a_job_ends_at_its_next_progress_after_cancel():
    begun, may_go_on = Event(), Event()

    def compute(progress):
        progress(0.5, "half")
        begun.set()
        may_go_on.wait()
        progress(0.6, "more")

    job = operation.Job(compute)
    begun.wait()
    assert (job.fraction, job.wait(0)) == (0.5, False)
    job.cancel()
    may_go_on.set()
    assert job.wait(60)
    with pytest.raises(operation.CancelledError):
        job.result()
    assert job.fraction == 0.5


def test_a_job_hands_on_warnings_and_any_error():
    def compute(progress):
        import warnings

        warnings.warn("careful", stacklevel=2)
        return progress(1.0, "done")

    job = operation.Job(compute)
    assert job.wait(60)
    assert (job.result(), job.notes) == (None, ["careful"])
    broken = operation.Job(lambda progress: 1 / 0)
    assert broken.wait(60)
    with pytest.raises(ZeroDivisionError):
        broken.result()


class Manager:
    """Stand in for the window manager, which has no windows to handle events here."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        def call(*args, **options):
            self.calls.append(name)
            return name

        return call


class Doubling(operation.Operation):
    """An operator that doubles a number in a thread, and then adds what is typed."""

    bl_label = "Double"
    repair = False

    def __init__(self):
        self.reports, self.go_on, self.total, self.closed = [], Event(), 0, False

    def report(self, kind, text):
        self.reports.append((*kind, text))

    def steps(self, context):
        try:
            self.total = yield self.compute
            if self.by_hand:
                self.total += int((yield None).type)
        finally:
            self.closed = True

    def compute(self, progress):
        self.go_on.wait()
        progress(0.5, "half")
        return 2 * 21


@pytest.fixture
def context():
    return SimpleNamespace(window_manager=Manager(), window=None)


def event(kind, value="PRESS", at=(0, 0)):
    x, y = at
    return SimpleNamespace(type=kind, value=value, mouse_region_x=x, mouse_region_y=y)


RUNNING, CANCELLED = {"RUNNING_MODAL"}, {"CANCELLED"}


def test_a_button_waits_for_the_thread_and_for_events(context):
    doubling = Doubling()
    assert doubling.invoke(context, event("LEFTMOUSE")) == RUNNING
    assert doubling.modal(context, event("TIMER")) == RUNNING
    doubling.go_on.set()
    assert doubling._job.wait(60)
    assert doubling.modal(context, event("7")) == RUNNING  # no event is for the thread
    assert doubling.modal(context, event("TIMER")) == RUNNING
    assert doubling.modal(context, event("7")) == FINISHED
    assert doubling.total == 49
    calls = context.window_manager.calls
    assert calls[:3] == ["progress_begin", "event_timer_add", "modal_handler_add"]
    assert calls[-2:] == ["progress_end", "event_timer_remove"]


def test_esc_ends_an_operator_without_its_result(context):
    doubling = Doubling()
    doubling.invoke(context, event("LEFTMOUSE"))
    job = doubling._job
    assert doubling.modal(context, event("ESC")) == CANCELLED
    doubling.go_on.set()
    assert job.wait(60)
    assert (doubling.total, doubling.closed) == (0, True)
    assert doubling.reports == [("INFO", "Double: cancelled")]


def test_a_fault_of_an_operator_is_shown_and_its_timer_ends(context):
    doubling = Doubling()
    doubling.compute = lambda progress: 1 / 0
    doubling.invoke(context, event("LEFTMOUSE"))
    assert doubling._job.wait(60)
    with pytest.raises(ZeroDivisionError):
        doubling.modal(context, event("TIMER"))
    assert context.window_manager.calls[-2:] == ["progress_end", "event_timer_remove"]


def test_a_script_waits_for_the_end(context):
    doubling = Doubling()
    doubling.go_on.set()
    assert doubling.execute(context) == FINISHED
    assert doubling.total == 42


@pytest.fixture
def drag(animal):
    """Return steps that follow the mouse over a part of the animal, what they set, and the part."""
    bpy.ops.eigenshape.find_parts()
    surface = read_surface(bpy.context, animal)
    region = bending.region_of_group(surface, animal.vertex_groups[1].name)
    binding = es.deformation.bind(es.rig_shape(surface.mesh), [region])
    # From above, 200 pixels wide and high; the pivot is in the middle.
    view = SimpleNamespace(perspective_matrix=Matrix(), view_rotation=Quaternion())
    window = SimpleNamespace(
        region=SimpleNamespace(width=200, height=200),
        region_data=view,
        collection=bpy.context.collection,
    )
    hand = SimpleNamespace(axis=None, angle=0.0, mode="graded")
    follow = bending.EIGENSHAPE_OT_bend._follow_mouse
    steps = follow(hand, window, surface, binding, np.zeros(3))
    next(steps)
    return steps, hand, binding


def test_the_mouse_turns_a_part_about_its_pivot(drag, animal):
    steps, hand, binding = drag
    assert animal.hide_get()
    steps.send(event("MOUSEMOVE", at=(150, 100)))
    steps.send(event("MOUSEMOVE", at=(100, 150)))
    assert hand.angle == pytest.approx(np.pi / 2)
    np.testing.assert_array_equal(hand.axis, [0, 0, 1])
    turn = es.Rotation([0, 0, 0], hand.axis, hand.angle)
    bent = es.deformation.bend(binding, [turn]).vertices
    np.testing.assert_allclose(coordinates(bpy.data.objects["bent"]), bent, atol=1e-6)
    steps.send(event("X"))
    steps.send(event("MOUSEMOVE", at=(150, 150)))
    np.testing.assert_array_equal(hand.axis, [1, 0, 0])
    with pytest.raises(StopIteration):
        steps.send(event("LEFTMOUSE"))
    assert hand.angle == pytest.approx(np.pi / 4)
    assert "bent" not in bpy.data.objects
    assert not animal.hide_get()


def test_esc_leaves_the_object_as_it_was(drag, animal):
    steps, _, _ = drag
    before = coordinates(animal)
    steps.send(event("MOUSEMOVE", at=(150, 100)))
    steps.send(event("MOUSEMOVE", at=(100, 150)))
    with pytest.raises(operation.CancelledError):
        steps.send(event("ESC"))
    np.testing.assert_array_equal(coordinates(animal), before)
    assert list(bpy.data.objects) == [animal]


def test_every_button_of_the_panel_is_an_operator():
    names = [name for row in panel.ROWS.values() for name in row]
    assert all(hasattr(bpy.types, f"EIGENSHAPE_OT_{name}") for name in names)


def test_the_manifest_is_what_blender_accepts(tmp_path: Path):
    for name in ("eigenshape-1.0-py3-none-any.whl", "scipy-1.17.1-cp311-cp311-win_amd64.whl"):
        (tmp_path / name).write_bytes(b"")
    path = build.zip_extension("windows-x64", tmp_path, tmp_path)
    manifest = tomllib.loads(zipfile.ZipFile(path).read("blender_manifest.toml").decode())
    assert manifest["platforms"] == ["windows-x64"]
    assert len(manifest["wheels"]) == 2
    assert set(manifest["permissions"]) == {"files"}
    scripts = Path(bpy.utils.resource_path("LOCAL")) / "scripts"
    command = scripts / "addons_core/bl_pkg/cli/blender_ext.py"
    checked = subprocess.run(
        [sys.executable, command, "validate", path], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
