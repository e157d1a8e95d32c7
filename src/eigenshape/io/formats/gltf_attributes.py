"""Attributes of glTF files: read, written again beside all else that a file holds, or written anew."""

import copy
import json
import mimetypes
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from certeig.kit.errors import FileFormatError
from eigenshape._vectors import unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import (
    Material,
    MeshAttributes,
    WriteJob,
    corner_normals,
    linear_colors,
    screen_colors,
)
from eigenshape.io.carrying import interpolate, split_corners
from eigenshape.io.formats.gltf import (
    COMPRESSIONS,
    INSTANCES,
    LEVELS,
    SURFACES,
    Column,
    Entry,
    Gltf,
    Placement,
    Scene,
    decode,
    decode_buffer,
    extension,
    families,
    member,
    place_triangles,
    pose_matrices,
    raw_accessor,
    read_accessor,
    read_beside,
    read_gltf,
    sides,
    transform_points,
    turn_back,
    view_of,
)
from eigenshape.io.formats.gltf_document import Columns, Document
from eigenshape.io.formats.gltf_fit import fit_scene
from eigenshape.io.formats.rounding import rounding_loss
from eigenshape.io.formats.stl import single_precision
from eigenshape.io.opening import SourceFile

# What a document may hold besides a scene with materials.
EXTRAS = ("skins", "animations", "cameras", "extensions")
TANGENTS = "tangents, which viewers compute anew"
MADE_ANEW = ("POSITION", "NORMAL", "TANGENT")
# Attributes of vertices that are made anew, go to other formats or are named as skins.
CARRIED = {*MADE_ANEW, "COLOR_0", "JOINTS_0", "WEIGHTS_0"}
PBR = "pbrMetallicRoughness"
KEPT_OF_MATERIALS = {"name", PBR, "baseColorFactor", "baseColorTexture", "metallicFactor"}
# Extensions that copy, compress or replace the old geometry, or name its vertices by number.
OF_GEOMETRY = {
    *COMPRESSIONS, INSTANCES, LEVELS, "EXT_instance_features", "EXT_mesh_manifold", "EXT_mesh_polygon",
    "EXT_mesh_primitive_edge_visibility", "CESIUM_primitive_outline", "FB_ngon_encoding",
}  # fmt: skip
# A shape that lies this many times its size from the origin is written about its own middle: three
# of the 24 binary digits of single precision are worth a node that is moved.
FAR = 8


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the attributes of the triangles of a scene, by face as in the mesh that was read."""
    gltf, scene = _open(source)
    rows_of_corners = scene.piece.rows[scene.piece.faces]
    found: Entry = {}
    nodes = list(scene.placements)
    parts, face_parts = scene.parts()
    face_materials, face_groups = np.full((2, len(face_parts)), -1)
    for number, (node, place) in enumerate(parts):
        chosen = np.flatnonzero(face_parts == number)
        primitive = gltf.entry("meshes", scene.placements[node].mesh)["primitives"][place]
        face_materials[chosen] = primitive.get("material", -1)
        face_groups[chosen] = nodes.index(node)
        coordinates, transform = _base_coordinates(gltf, primitive)
        columns = {"normals": ("NORMAL", 3), "texture_coordinates": (coordinates, 2),
                   "colors": ("COLOR_0", 4)}  # fmt: skip
        for key, (name, width) in columns.items():
            if name not in primitive["attributes"]:
                continue
            rows = read_accessor(gltf, primitive["attributes"][name])
            if key == "colors" and rows.shape[1] == 3:
                rows = np.pad(rows, ((0, 0), (0, 1)), constant_values=1.0)
            if rows.shape[1] != width:
                raise FileFormatError(
                    f"{name} of a primitive must have {width} numbers each; it has {rows.shape[1]}."
                )
            if key == "texture_coordinates":
                rows = _upward_coordinates(rows, transform)
            default = 1.0 if key == "colors" else 0.0
            table = found.setdefault(key, np.full((*mesh.faces.shape, width), default))
            table[chosen] = _take(rows, rows_of_corners[chosen], name)
    if "colors" in found:
        found["colors"][..., :3] = screen_colors(found["colors"][..., :3])
        found["colors"] = np.rint(255 * found["colors"].clip(0, 1)).astype(np.uint8)
    names = [
        str(
            gltf.entry("nodes", node).get("name")
            or gltf.entry("meshes", place.mesh).get("name", "")
        )
        for node, place in scene.placements.items()
    ]
    return replace(
        MeshAttributes.plain(mesh),
        face_parts=face_parts,
        face_materials=face_materials,
        face_groups=face_groups,
        materials=tuple(_material(gltf, source, entry) for entry in gltf.entries("materials")),
        groups=tuple(names),
        others=_others(gltf),
        source=source,
        **found,
    )


def _open(source: SourceFile) -> tuple[Gltf, Scene]:
    gltf = read_gltf(source.data, source.folder if source.suffix == ".gltf" else None)
    return gltf, place_triangles(gltf, source.scene)


def _take(rows: np.ndarray, corners: np.ndarray, name: str) -> np.ndarray:
    if corners.max() >= len(rows):
        raise FileFormatError(
            f"{name} of a primitive must have a row for each position; it has {len(rows)}, and row "
            f"{corners.max()} is used."
        )
    return rows[corners]


def _base_coordinates(gltf: Gltf, primitive: Entry) -> tuple[str, Entry]:
    """Name the texture coordinates of the base color of a primitive, and what transforms them."""
    number = primitive.get("material", -1)
    pbr = {} if number < 0 else member(gltf.entry("materials", number), PBR)
    texture = pbr.get("baseColorTexture", {})
    transform = extension(texture, "KHR_texture_transform")
    return f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}", transform


def _upward_coordinates(rows: np.ndarray, transform: Entry) -> np.ndarray:
    """Scale, turn and shift texture coordinates (KHR_texture_transform), and let v go up."""
    angle = transform.get("rotation", 0.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    scaled = rows * transform.get("scale", [1.0, 1.0])
    moved = scaled @ turn + transform.get("offset", [0.0, 0.0])
    return moved * [1, -1] + [0, 1]


def _material(gltf: Gltf, source: SourceFile, entry: Entry) -> Material:
    pbr = member(entry, PBR)
    *light, alpha = pbr.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
    red, green, blue = screen_colors(np.array(light, dtype=np.float64)).tolist()
    image, image_name = None, ""
    texture: Entry = {}
    if "baseColorTexture" in pbr:
        texture = gltf.entry("textures", pbr["baseColorTexture"].get("index"))
    # Images of newer formats, such as WebP, are named by extensions.
    named = [texture, *texture.get("extensions", {}).values()]
    if numbers := [each["source"] for each in named if "source" in each]:
        held = gltf.entry("images", numbers[0])
        image, kind = _image(gltf, source, held)
        uri = held.get("uri", "data:")
        file = Path(str(held.get("name") or ("" if uri.startswith("data:") else uri)))
        ending = mimetypes.guess_extension(kind) or f".{kind.rpartition('/')[2]}"
        image_name = f"{file.stem or f'image{numbers[0]}'}{ending}"
    return Material(str(entry.get("name", "")), (red, green, blue, alpha), image, image_name)


def _image(gltf: Gltf, source: SourceFile, entry: Entry) -> tuple[bytes | None, str]:
    """Return the bytes of an image, None if its file is missing, and its type."""
    if "bufferView" in entry:
        return bytes(view_of(gltf, entry["bufferView"])[0]), entry.get("mimeType", "image/png")
    uri = str(entry.get("uri", ""))
    kind = entry.get("mimeType") or mimetypes.guess_type(uri)[0] or "image/png"
    if uri.startswith("data:"):
        return decode_buffer(0, entry, b"", None), kind
    try:
        return read_beside(0, uri, source.folder), kind
    except (OSError, FileFormatError):
        return None, kind


def _others(gltf: Gltf) -> tuple[str, ...]:
    """Name what only a glTF file keeps."""
    tree = gltf.tree
    names = [kind for kind in EXTRAS if tree.get(kind)]
    primitives = [part for mesh in tree.get("meshes", []) for part in mesh.get("primitives", [])]
    tables = [{*part["attributes"]} - {_base_coordinates(gltf, part)[0]} for part in primitives]
    further = set().union(*tables) - CARRIED
    names.extend(f"the values {name} of vertices" for name in sorted(further))
    if any("targets" in part for part in primitives):
        names.append("morph targets")
    if any(part.get("mode", 4) not in SURFACES for part in primitives):
        names.append("lines and points")
    for entry in tree.get("materials", []):
        pbr = member(entry, PBR)
        is_clear = pbr.get("baseColorFactor", [1.0])[-1] < 1
        further_keys = {*entry, *pbr} - KEPT_OF_MATERIALS - ({"alphaMode"} if is_clear else set())
        if further_keys or pbr.get("metallicFactor") != 0.0:  # our own files say 0
            names.append("properties of materials other than color and image")
            break
    if len(tree.get("nodes", [])) > len(tree.get("meshes", [])):
        names.append("nodes without a mesh")
    return tuple(names)


def write(job: WriteJob) -> dict[Path, bytes]:
    """Write a GLB file: that of the source with other positions and triangles, or a new one."""
    source = job.attributes.source
    if source and source.suffix in (".glb", ".gltf"):
        return {job.path: _rewrite(source, job)}
    fields = job.attributes.fields.values()
    all_fit = all(_is_column(values, job.attributes.mesh) for values in fields)
    job.lose([] if all_fit else ["fields"])
    places, offset = _local_places(job.mesh)
    job.lost.extend(rounding_loss(job.mesh, (places + offset)[job.mesh.faces]))
    return {job.path: write_new(job.attributes, job.mesh)}


def _rewrite(source: SourceFile, job: WriteJob) -> bytes:  # noqa: PLR0915 - a file from top to bottom
    """Write a glTF file again as GLB with other positions and triangles, and name what is lost.

    Everything else in the file stays as it is: nodes, materials, images, skins, animations and
    extensions. Every attribute of vertices is carried, whatever it means, but tangents. Positions
    are such that the nodes, skins and morph targets of the file put each vertex into its place.
    """
    mesh, attributes = job.mesh, job.attributes
    gltf, scene = _open(source)
    document = _copy_document(gltf, source, job.lost)
    file_rows = scene.piece.rows[scene.piece.faces.ravel()]
    nodes, primitive_numbers = np.array(scene.parts()[0])[attributes.face_parts].T
    places = mesh.vertices[mesh.faces]
    found = np.zeros_like(places)  # where the written file puts the corners
    normals = corner_normals(attributes, mesh)
    fit = None
    if attributes.places is not None:
        fit = fit_scene(document, gltf, scene, attributes, mesh)
    written: dict[int, list[Entry]] = {}
    for node, place in scene.placements.items():
        primitives = gltf.entry("meshes", place.mesh)["primitives"]
        written[node] = [part for part in primitives if part.get("mode", 4) not in SURFACES]
        for numbers in families(primitives):
            shared = primitives[numbers[0]]
            chosen = np.flatnonzero((nodes == node) & np.isin(primitive_numbers, numbers))
            if not chosen.size:
                continue
            # The rows of the file that the corners come from, and what each gives to each corner
            corners = (3 * chosen[:, None] + [0, 1, 2]).ravel()
            vertices = mesh.faces[chosen].ravel()
            blends = attributes.corners[corners]
            used, inverse = np.unique(blends.indices, return_inverse=True)
            rows = file_rows[used]
            blends = csr_array((blends.data, inverse.ravel(), blends.indptr))
            columns = _carry_columns(gltf, shared, rows, blends)
            old = decode(*columns[0].pop("POSITION"))
            normal = np.empty((blends.shape[0], 0))
            if normals is not None and ("NORMAL" in shared["attributes"] or fit):
                normal = normals[chosen].reshape(-1, 3)
            shown = fit.fit_columns(gltf, node, columns, corners, vertices) if fit else place
            columns[0] |= field_columns(attributes, vertices)
            # Corners of the file agree if their rows do, others if all their values do.
            keys = [rows[blends.indices]]
            if blends.nnz > 3 * len(chosen):
                keys = [values for table in columns for values, _ in table.values()]
            first, indices = split_corners([vertices, *keys, np.rint(normal * 1e5)])
            columns = [_choose_rows(table, first) for table in columns]
            wanted = places[chosen].reshape(-1, 3)[first]
            turned, put = _place_vertices(shown, columns, old[first], wanted, normal[first])
            triangles = indices.reshape(-1, 3)
            found[chosen] = put[triangles]
            triangles = turn_back(triangles, turned)  # as the reader does
            if "TANGENT" in shared["attributes"]:
                job.lost.append(TANGENTS)
            changed: Entry = {"attributes": document.add_columns(columns[0])}
            if columns[1:]:
                changed["targets"] = [document.add_columns(table) for table in columns[1:]]
            for number in np.unique(primitive_numbers[chosen]).tolist():
                of_part = triangles[primitive_numbers[chosen] == number]
                entry = copy.deepcopy(primitives[number]) | changed
                entry["indices"] = document.add_indices(of_part.ravel(), len(first))
                entry.pop("mode", None)
                written[node].append(entry)
    job.lost.extend(rounding_loss(mesh, found))
    document.tree |= {} if scene.number is None else {"scene": scene.number}
    _replace_meshes(document.tree, written)
    job.lost.extend(_drop_extensions(document.tree, written))
    return document.pack()


def field_columns(attributes: MeshAttributes, vertices: np.ndarray) -> Columns:
    """Return functions on vertices as attributes of corners; other programs find them by these names."""
    found: Columns = {}
    for name, values in attributes.fields.items():
        if _is_column(values, attributes.mesh):
            rows = values[vertices].reshape(len(vertices), -1).astype("<f4")
            found["_" + re.sub(r"\W", "_", name, flags=re.ASCII).upper()] = rows, False
    return found


def _is_column(values: np.ndarray, mesh: TriangleMesh) -> bool:
    """Return whether an attribute of vertices can hold a field: up to four numbers for each."""
    return len(values) == mesh.n_vertices and values.size <= 4 * len(values)


def _choose_rows(columns: Columns, chosen: np.ndarray) -> Columns:
    return {name: (values[chosen], flag) for name, (values, flag) in columns.items()}


def _carry_columns(gltf: Gltf, part: Entry, rows: np.ndarray, blends: csr_array) -> list[Columns]:
    """Return the attributes of a primitive at new corners, and those of each of its morph targets.

    Normals, but those of targets, and tangents are made anew.
    """
    tables = [part["attributes"], *part.get("targets", [])]
    return [
        {
            name: _blend(gltf, index, name, rows, blends)
            for name, index in table.items()
            if name != "TANGENT" and not (name == "NORMAL" and table is tables[0])
        }
        for table in tables
    ]


def _place_vertices(
    place: Placement,
    columns: list[Columns],
    old: np.ndarray,
    places: np.ndarray,
    normals: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Add the positions that a node moves into places, and normals if there are any, to the columns of vertices.

    What stays in its place keeps its old position, also below a node or joint of scale 0. Return
    the side that each vertex is turned to, and the place of its rounded position.
    """
    table, *targets = columns
    pose = place.matrix[None]
    if place.bones is not None:
        pose, _ = pose_matrices(table, lambda name: decode(*table[name]), place.bones)
    linear = pose[:, :3, :3]
    shifts, turns = (_morph(place, targets, name) for name in ("POSITION", "NORMAL"))
    moves = places - transform_points(pose, old + shifts)
    with np.errstate(over="ignore"):  # what is too large is found when places are compared
        local = (old + np.einsum("...ij,...j->...i", np.linalg.pinv(linear), moves)).astype("<f4")
    table["POSITION"] = local, False
    if normals.size:
        normals = unit_vectors(np.einsum("...ji,...j->...i", linear, normals))
        table["NORMAL"] = unit_vectors(normals - turns).astype("<f4"), False
    return np.broadcast_to(sides(pose), len(local)), transform_points(pose, local + shifts)


def _morph(place: Placement, targets: list[Columns], name: str) -> Any:
    """Return what the morph targets of a mesh add to an attribute by its default weights."""
    pairs = zip(place.weights, targets, strict=False)
    return sum(weight * decode(*target[name]) for weight, target in pairs if name in target)


def _drop_extensions(tree: Entry, nodes: Iterable[int]) -> list[str]:
    """Drop the extensions of some nodes and their meshes that belong to the old geometry, and name them."""
    owners = [tree["nodes"][node] for node in nodes]
    meshes = [tree["meshes"][owner["mesh"]] for owner in owners if "mesh" in owner]
    parts = [part for mesh in meshes for part in mesh["primitives"]]
    dropped = set()
    for entry in [*owners, *meshes, *parts, *tree["bufferViews"]]:
        extensions = entry.get("extensions", {})
        for name in extensions.keys() & OF_GEOMETRY:
            del extensions[name]
            dropped.add(name)
        if not extensions:
            entry.pop("extensions", None)
    text = json.dumps(tree)
    for key in ("extensionsUsed", "extensionsRequired"):
        names = tree.pop(key, [])
        still_used = [name for name in names if name not in dropped or f'"{name}":' in text]
        tree |= {key: still_used} if still_used else {}
    return [f"the extension {name}, which is about the old geometry"
            for name in sorted(dropped.difference(COMPRESSIONS))]  # fmt: skip


def _blend(gltf: Gltf, index: int, name: str, rows: np.ndarray, blends: csr_array) -> Column:
    """Interpolate an attribute; joints, whose weights go along, and numbers of things are only chosen."""
    values, is_normalized = raw_accessor(gltf, index)
    values = _take(values, rows, name)
    is_chosen = name.startswith(("JOINTS", "WEIGHTS"))
    is_chosen |= name.startswith("_") and values.dtype.kind in "iu"
    return interpolate(blends, values, blend=not is_chosen), is_normalized


def _copy_document(gltf: Gltf, source: SourceFile, lost: list[str]) -> Document:
    """Copy a tree, with the contents of its views, and images of other files as views."""
    tree = copy.deepcopy(gltf.tree)
    count = len(tree.get("bufferViews", []))
    document = Document(tree, [view_of(gltf, index)[0] for index in range(count)])
    for entry in tree.get("images", []):
        uri = str(entry.get("uri", "data:"))
        if uri.startswith("data:"):
            continue
        data_of_file, kind = _image(gltf, source, entry)
        if data_of_file is None:
            lost.append(f"the image {uri[:80]!r}, which is not in the folder of the file")
            continue
        del entry["uri"]
        entry.setdefault("name", Path(uri).name)
        entry |= {"bufferView": document.add_view(data_of_file), "mimeType": kind}
    return document


def _replace_meshes(tree: Entry, written: dict[int, list[Entry]]) -> None:
    """Give each node a mesh of its new primitives, and empty the accessors that they replace."""
    nodes, meshes = tree["nodes"], tree["meshes"]
    before = _accessors_of(meshes)
    users = Counter(node.get("mesh") for node in nodes)
    for node, primitives in written.items():
        index = nodes[node]["mesh"]
        users[index] -= 1
        mesh = {**meshes[index], "primitives": primitives}
        if not primitives:
            del nodes[node]["mesh"]  # all its faces were dropped
            nodes[node].pop("skin", None)
        elif not users[index]:
            meshes[index] = mesh
        else:  # several nodes share a mesh, and each has its own positions now
            nodes[node]["mesh"] = len(meshes)
            meshes.append(mesh)
    for index in before - _accessors_of(meshes):
        for key in ("bufferView", "byteOffset", "sparse", "min", "max"):
            tree["accessors"][index].pop(key, None)  # its data are left out when packed


def _accessors_of(meshes: list[Entry]) -> set[int]:
    parts = [part for mesh in meshes for part in mesh["primitives"]]
    tables = [table for part in parts for table in (part["attributes"], *part.get("targets", []))]
    indices = {part["indices"] for part in parts if "indices" in part}
    return indices.union(*(table.values() for table in tables))


def write_new(attributes: MeshAttributes, mesh: TriangleMesh) -> bytes:
    """Write a GLB file with a node for each group and a primitive for each of its materials."""
    document = Document({"asset": {"version": "2.0", "generator": "eigenshape"}, "scene": 0})
    nodes: list[Entry] = []
    meshes: list[Entry] = []
    places, offset = _local_places(mesh)
    if attributes.materials:
        document.tree["materials"] = [_write_material(document, m) for m in attributes.materials]
    tables = {}  # with rows for the corners of each face
    normals = corner_normals(attributes, mesh)
    if normals is not None:
        tables["NORMAL"] = normals
    if attributes.texture_coordinates is not None:
        tables["TEXCOORD_0"] = [0, 1] + attributes.texture_coordinates * [1, -1]
    if attributes.colors is not None:
        # Other programs keep the low byte of colors of 16 bits (trimesh 5.2, MeshLab).
        tables["COLOR_0"] = attributes.colors / 255
        tables["COLOR_0"][..., :3] = linear_colors(tables["COLOR_0"][..., :3])
    groups = np.unique(attributes.face_groups)
    for group in groups:
        in_group = np.flatnonzero(attributes.face_groups == group)
        corners = mesh.faces[in_group].ravel()
        rows = {
            name: table[in_group].reshape(len(corners), -1).astype("<f4")
            for name, table in tables.items()
        }
        if not tables and len(groups) == 1:  # vertices keep their order, also those without a face
            first = vertices = np.arange(mesh.n_vertices)
            indices = corners
        else:
            first, indices = split_corners([corners, *rows.values()])
            vertices = corners[first]
        table: Columns = {"POSITION": (places[vertices], False)}
        table |= {name: (values[first], False) for name, values in rows.items()}
        table |= field_columns(attributes, vertices)
        columns = document.add_columns(table)
        materials = attributes.face_materials[in_group]
        primitives: list[Entry] = []
        for material in np.unique(materials).tolist():
            of_part = indices[np.repeat(materials == material, 3)]
            part = {"attributes": columns, "indices": document.add_indices(of_part, len(first))}
            primitives.append(part | ({"material": material} if material >= 0 else {}))
        node = {"mesh": len(meshes), "name": attributes.groups[group] if group >= 0 else ""}
        nodes.append(node | ({"translation": offset.tolist()} if offset.any() else {}))
        meshes.append({"primitives": primitives})
    scenes = [{"nodes": list(range(len(nodes)))}]
    document.tree |= {"scenes": scenes, "nodes": nodes, "meshes": meshes}
    return document.pack()


def _local_places(
    mesh: TriangleMesh,
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices in single precision about a point: their middle if it is far away and helps."""
    places = single_precision(mesh, "GLB")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    # Of single precision too, as engines take it
    middle = (low / 2 + high / 2).astype(np.float32).astype(np.float64)
    is_exact = np.array_equal(places, mesh.vertices)
    if is_exact or np.abs(middle).max() <= FAR * (high - low).max():
        return places, np.zeros(3)
    return (mesh.vertices - middle).astype(np.float32), middle


def _write_material(document: Document, material: Material) -> Entry:
    *tint, alpha = material.color
    color = [*linear_colors(np.array(tint)).tolist(), alpha]
    pbr: Entry = {"baseColorFactor": color, "metallicFactor": 0.0}
    if material.image is not None:
        tree = document.tree
        images, textures = tree.setdefault("images", []), tree.setdefault("textures", [])
        kind = mimetypes.guess_type(material.image_name)[0] or "image/png"
        view = document.add_view(material.image)
        images.append({"bufferView": view, "mimeType": kind, "name": material.image_name})
        textures.append({"source": len(images) - 1})
        pbr["baseColorTexture"] = {"index": len(textures) - 1}
    see_through = {"alphaMode": "BLEND"} if alpha < 1 else {}
    return {"name": material.name, PBR: pbr, **see_through}
