"""Blender writes and reads, without a window. Coordinates are not turned: what is z here is z there."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from exchange import Shape, Writer, field_arrays, plain_fields, serve
from mathutils import Matrix, Quaternion, Vector

KINDS = {"f": "FLOAT", "i": "INT", "u": "INT", "b": "BOOLEAN"}
AS_IS = {"forward_axis": "Y", "up_axis": "Z"}


def clear() -> None:
    """Begin with an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def object_of(shape: Shape) -> bpy.types.Object:
    """Return a mesh in a scene of its own."""
    clear()
    mesh = bpy.data.meshes.new("shape")
    mesh.from_pydata(shape["points"], [], shape["polygons"])
    if "colors" in shape:
        colors = mesh.color_attributes.new("Color", "BYTE_COLOR", "POINT")
        for entry, color in zip(colors.data, shape["colors"], strict=True):
            entry.color_srgb = [*(part / 255 for part in color), 1.0]
    if "texture" in shape:
        layer = mesh.uv_layers.new(name="UVMap")
        for loop, entry in zip(mesh.loops, layer.data, strict=True):
            entry.uv = shape["texture"][loop.vertex_index]
        image = bpy.data.images.new("checker", 4, 4)
        image.pack()
        material = bpy.data.materials.new("textured")
        material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        target = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
        material.node_tree.links.new(node.outputs["Color"], target)
        mesh.materials.append(material)
    for domain, key in (("POINT", "point_fields"), ("FACE", "cell_fields")):
        for name, values in field_arrays(shape.get(key, {})).items():
            if values.ndim == 1 and values.dtype != np.int64:
                layer = mesh.attributes.new(name, KINDS[values.dtype.kind], domain)
                layer.data.foreach_set("value", values)
    thing = bpy.data.objects.new("shape", mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def place_copies(shape: Shape) -> None:
    """Let objects share one mesh."""
    thing = object_of(shape)
    for number, copy in enumerate(shape["copies"]):
        other = thing if number == 0 else bpy.data.objects.new(f"copy{number}", thing.data)
        if number:
            bpy.context.collection.objects.link(other)
        x, y, z, w = copy["rotation"]
        other.rotation_mode = "QUATERNION"
        other.location, other.scale = copy["translation"], copy["scale"]
        other.rotation_quaternion = Quaternion((w, x, y, z))


def place_skin(shape: Shape) -> None:
    """Let a scaled armature of two bones bend a mesh that hangs below it."""
    thing = object_of(shape)
    armature = bpy.data.armatures.new("Armature")
    rig = bpy.data.objects.new("Armature", armature)
    bpy.context.collection.objects.link(rig)
    rig.location, rig.scale = shape["armature"]["translation"], shape["armature"]["scale"]
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    low, high = armature.edit_bones.new("low"), armature.edit_bones.new("high")
    low.head, low.tail = (0, 0, 0), (0, 0, 200)
    high.head, high.tail = (0, 0, 200), (0, 0, 400)
    high.parent = low
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    # The stored points are those of the world at rest; below the armature they are in its unit.
    thing.data.transform(rig.matrix_world.inverted())
    thing.parent = rig
    for number, name in enumerate(("low", "high")):
        group = thing.vertex_groups.new(name=name)
        for vertex, weights in enumerate(shape["weights"]):
            group.add([vertex], weights[number], "REPLACE")
    thing.modifiers.new("Armature", "ARMATURE").object = rig
    x, y, z, w = shape["joint_nodes"][1]["rotation"]
    turn = Quaternion((w, x, y, z)).to_matrix().to_4x4()
    at_rest = armature.bones["high"].matrix_local
    head = Matrix.Translation(Vector((0, 0, 200)))
    rig.pose.bones["high"].matrix = head @ turn @ head.inverted() @ at_rest
    bpy.context.view_layer.update()


def place_targets(shape: Shape) -> None:
    """Give a mesh shape keys with values."""
    thing = object_of(shape)
    thing.shape_key_add(name="Basis")
    for number, (target, weight) in enumerate(zip(shape["targets"], shape["weights"], strict=True)):
        key = thing.shape_key_add(name=f"target{number}", from_mix=False)
        for entry, point, move in zip(key.data, shape["points"], target, strict=True):
            entry.co = Vector(point) + Vector(move)
        key.value = weight


def place(shape: Shape) -> None:
    """Make the scene that shows a shape."""
    if "copies" in shape:
        place_copies(shape)
    elif "joint_nodes" in shape:
        place_skin(shape)
    elif "targets" in shape:
        place_targets(shape)
    else:
        object_of(shape)


def writer_of(save: Callable[..., object], **options: object) -> Callable[[Shape, Path], None]:
    """Return a call that writes by one of Blender's operators."""

    def write(shape: Shape, path: Path) -> None:
        place(shape)
        save(filepath=str(path), **options)

    return write


def read(path: Path) -> Shape:
    """Read a file, and return all meshes as the scene shows them."""
    clear()
    name = str(path)
    if path.suffix == ".obj":
        bpy.ops.wm.obj_import(filepath=name, **AS_IS)
    elif path.suffix == ".ply":
        bpy.ops.wm.ply_import(filepath=name, **AS_IS)
    elif path.suffix == ".stl":
        bpy.ops.wm.stl_import(filepath=name, **AS_IS)
    else:
        bpy.ops.import_scene.gltf(filepath=name)
    # The importer of glTF turns y up into z up; here it is turned back.
    turn = Matrix.Rotation(-np.pi / 2, 4, "X") if path.suffix in (".glb", ".gltf") else Matrix()
    graph = bpy.context.evaluated_depsgraph_get()
    found: Shape = {"points": [], "polygons": [], "point_fields": {}, "cell_fields": {}}
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH" and thing.visible_get():  # the importer hides a shape for bones
            shown = thing.evaluated_get(graph)
            add_mesh(found, shown.to_mesh(), turn @ shown.matrix_world)
    return found


def add_mesh(found: Shape, mesh: bpy.types.Mesh, place: Matrix) -> None:
    """Add a mesh at its place to what was found."""
    start = len(found["points"])
    found["points"] += [tuple(place @ vertex.co) for vertex in mesh.vertices]
    order = -1 if place.determinant() < 0 else 1
    for face in mesh.polygons:
        corners = list(face.vertices)[::order]
        loops = list(face.loop_indices)[::order]
        found["polygons"].append([start + corner for corner in corners])
        if mesh.uv_layers:
            layer = mesh.uv_layers[0].data
            found.setdefault("corner_texture", []).append([tuple(layer[i].uv) for i in loops])
        if mesh.color_attributes:
            layer = mesh.color_attributes[0]
            places = corners if layer.domain == "POINT" else loops
            colors = [[255 * part for part in layer.data[i].color_srgb] for i in places]
            found.setdefault("corner_colors", []).append(colors)
    for layer in mesh.attributes:
        if layer.data_type in KINDS.values() and layer.domain in ("POINT", "FACE"):
            values = np.array([entry.value for entry in layer.data])
            key = "point_fields" if layer.domain == "POINT" else "cell_fields"
            found[key] |= plain_fields({layer.name: values})


if __name__ == "__main__":
    faces = ("prism", "hole", "seam", "colors", "far", "copies", "morph", "skin")
    gltf = bpy.ops.export_scene.gltf
    as_shown = {
        "export_rest_position_armature": False,
        "export_yup": False,
        "export_vertex_color": "ACTIVE",
    }
    serve(
        bpy.app.version_string,
        {
            "OBJ": Writer(
                ".obj", writer_of(bpy.ops.wm.obj_export, export_colors=True, **AS_IS), faces
            ),
            "PLY": Writer(
                ".ply",
                writer_of(bpy.ops.wm.ply_export, export_attributes=True, **AS_IS),
                (*faces, "fields"),
            ),
            "PLY, text": Writer(
                ".ply",
                writer_of(
                    bpy.ops.wm.ply_export, export_attributes=True, ascii_format=True, **AS_IS
                ),
                (*faces, "fields"),
            ),
            "STL": Writer(".stl", writer_of(bpy.ops.wm.stl_export, **AS_IS), faces),
            "STL, text": Writer(
                ".stl", writer_of(bpy.ops.wm.stl_export, ascii_format=True, **AS_IS), faces
            ),
            "GLB": Writer(".glb", writer_of(gltf, **as_shown), faces),
            "GLB, instances": Writer(
                ".glb", writer_of(gltf, export_gpu_instances=True, **as_shown), ("copies",)
            ),
            "glTF": Writer(
                ".gltf", writer_of(gltf, export_format="GLTF_SEPARATE", **as_shown), faces
            ),
        },
        dict.fromkeys((".obj", ".ply", ".stl", ".glb", ".gltf"), read),
    )
