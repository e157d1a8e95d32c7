"""Attributes of glTF files: read, written again beside all else that a file holds, or written anew."""

import copy
import json
import mimetypes
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int
from scipy.sparse import csr_array

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import (
    Material,
    MeshAttributes,
    WriteJob,
    corner_normals,
    linear_colors,
    plain_attributes,
    screen_colors,
    unit_rows,
)
from eigenshape.io.carrying import interpolate
from eigenshape.io.formats.gltf import (
    COMPRESSIONS,
    INSTANCES,
    LEVELS,
    SURFACES,
    Gltf,
    Placement,
    Scene,
    decode,
    decode_buffers,
    extension,
    file_beside,
    pack,
    pose_matrices,
    raw_accessor,
    read_accessor,
    read_gltf,
    read_scene,
    sides,
    transform_points,
    view_of,
)
from eigenshape.io.formats.rounding import rounding_loss
from eigenshape.io.formats.stl import single_precision
from eigenshape.io.opening import SourceFile

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
# What a document may hold besides a scene with materials.
EXTRAS = ("skins", "animations", "cameras", "extensions")
TANGENTS = "tangents, which viewers compute anew"
MADE_ANEW = ("POSITION", "NORMAL", "TANGENT")
# Attributes of vertices that are made anew, go to other formats or are named as skins.
CARRIED = {*MADE_ANEW, "COLOR_0", "JOINTS_0", "WEIGHTS_0"}
# Extensions that copy, compress or replace the old geometry, or name its vertices by number.
OF_GEOMETRY = (
    *COMPRESSIONS, INSTANCES, LEVELS, "EXT_instance_features", "EXT_mesh_manifold", "EXT_mesh_polygon",
    "EXT_mesh_primitive_edge_visibility", "CESIUM_primitive_outline", "FB_ngon_encoding",
)  # fmt: skip
# A shape that lies this many times its size from the origin is written about its own middle: three
# of the 24 binary digits of single precision are worth a node that is moved.
FAR = 8
Columns = dict[str, tuple[np.ndarray, bool]]  # numbers, and whether whole ones mean shares of one


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the attributes of the triangles of a scene, by face as in the mesh that was read."""
    gltf, scene = _open(source)
    n_faces = len(scene.piece.faces)
    corner_rows = scene.piece.rows[scene.piece.faces]
    found: dict[str, Any] = {}
    materials = [_material(gltf, source, entry) for entry in gltf.tree.get("materials", [])]
    nodes = list(scene.placements)
    face_materials, face_groups, face_parts = np.full((3, n_faces), -1)
    for part, (node, _, primitive, chosen) in enumerate(_placed_primitives(gltf, scene)):
        named = primitive["attributes"]
        number = primitive.get("material", -1)
        face_materials[chosen], face_groups[chosen] = number, nodes.index(node)
        face_parts[chosen] = part
        coordinates, transform = _base_coordinates(gltf, primitive)
        columns = {"normals": ("NORMAL", (3,)), "texture_coordinates": (coordinates, (2,)),
                   "colors": ("COLOR_0", (3, 4))}  # fmt: skip
        for key, (name, widths) in columns.items():
            if name not in named:
                continue
            width = raw_accessor(gltf, named[name]).shape[1]
            if width not in widths:
                raise FileFormatError(
                    f"{name} of a primitive must have {widths[0]} numbers each; it has {width}."
                )
            rows = read_accessor(gltf, named[name], width)
            if key == "colors" and width == 3:
                rows = np.column_stack([rows, np.ones(len(rows))])
            if key == "texture_coordinates":
                rows = _transform_coordinates(rows, transform)
            default = 1.0 if key == "colors" else 0.0
            table = found.setdefault(key, np.full((n_faces, 3, max(widths)), default))
            table[chosen] = _take(rows, corner_rows[chosen], name)
    if "texture_coordinates" in found:
        found["texture_coordinates"][..., 1] = 1.0 - found["texture_coordinates"][..., 1]
    if "colors" in found:
        found["colors"][..., :3] = screen_colors(found["colors"][..., :3])
        found["colors"] = np.rint(255 * found["colors"].clip(0, 1)).astype(np.uint8)
    entries = [gltf.entry("nodes", node) for node in nodes]
    names = [
        str(entry.get("name") or gltf.entry("meshes", entry["mesh"]).get("name", ""))
        for entry in entries
    ]
    return replace(
        plain_attributes(mesh),
        face_parts=face_parts,
        face_materials=face_materials,
        face_groups=face_groups,
        materials=tuple(materials),
        groups=tuple(names),
        others=_others(gltf),
        source=source,
        **found,
    )


def _open(source: SourceFile) -> tuple[Gltf, Scene]:
    gltf = read_gltf(source.data, source.folder if source.suffix == ".gltf" else None)
    return gltf, read_scene(gltf, source.scene)


def _placed_primitives(
    gltf: Gltf, scene: Scene
) -> Iterator[tuple[int, int, dict[str, Any], Int[np.ndarray, " k"]]]:
    """Give the node, the number and the faces of each primitive of each node that has faces."""
    for node in scene.placements:
        primitives = gltf.entry("meshes", gltf.entry("nodes", node)["mesh"])["primitives"]
        for number, primitive in enumerate(primitives):
            chosen = (scene.nodes == node) & (scene.piece.primitives == number)
            if chosen.any():
                yield node, number, primitive, np.flatnonzero(chosen)


def _take(rows: np.ndarray, corners: np.ndarray, name: str) -> np.ndarray:
    if corners.max() >= len(rows):
        raise FileFormatError(
            f"{name} of a primitive must have a row for each position; it has {len(rows)}, and row "
            f"{corners.max()} is used."
        )
    return rows[corners]


def _base_color(material: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = material.get("pbrMetallicRoughness", {})
    return found


def _base_coordinates(gltf: Gltf, primitive: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Name the texture coordinates of the base color of a primitive, and what transforms them."""
    number = primitive.get("material", -1)
    pbr = {} if number < 0 else _base_color(gltf.entry("materials", number))
    texture = pbr.get("baseColorTexture", {})
    transform = extension(texture, "KHR_texture_transform")
    return f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}", transform


def _transform_coordinates(rows: np.ndarray, transform: dict[str, Any]) -> np.ndarray:
    """Scale, turn and shift texture coordinates, whose v goes down (KHR_texture_transform)."""
    angle = transform.get("rotation", 0.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    scaled = rows * transform.get("scale", [1.0, 1.0])
    turned: np.ndarray = scaled @ turn.T + transform.get("offset", [0.0, 0.0])
    return turned


def _material(gltf: Gltf, source: SourceFile, entry: dict[str, Any]) -> Material:
    pbr = _base_color(entry)
    *light, alpha = pbr.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
    red, green, blue = screen_colors(np.array(light, dtype=np.float64)).tolist()
    image, image_name = None, ""
    if "baseColorTexture" in pbr:
        texture = gltf.entry("textures", pbr["baseColorTexture"].get("index"))
        # Images of newer formats, such as WebP, are named by extensions.
        named = [texture, *texture.get("extensions", {}).values()]
        number = next((each["source"] for each in named if "source" in each), None)
        if number is not None:
            held = gltf.entry("images", number)
            image, kind = _image(gltf, source, held)
            ending = mimetypes.guess_extension(kind) or f".{kind.rpartition('/')[2]}"
            ending = ".jpg" if kind == "image/jpeg" else ending
            stem = Path(str(held.get("name") or held.get("uri", "")[:80])).name
            stem = Path(stem).stem if not stem.startswith("data:") else ""
            image_name = f"{stem or f'image{number}'}{ending}"
    return Material(str(entry.get("name", "")), (red, green, blue, alpha), image, image_name)


def _image(gltf: Gltf, source: SourceFile, entry: dict[str, Any]) -> tuple[bytes | None, str]:
    """Return the bytes of an image, None if its file is missing, and its type."""
    if "bufferView" in entry:
        return bytes(view_of(gltf, entry["bufferView"])[0]), entry.get("mimeType", "image/png")
    uri = str(entry.get("uri", ""))
    kind = entry.get("mimeType") or mimetypes.guess_type(uri)[0] or "image/png"
    if uri.startswith("data:"):
        return decode_buffers({"buffers": [{"uri": uri}]}, b"")[0], uri[5:].partition(";")[
            0
        ] or kind
    try:
        return read_regular(file_beside(0, uri, source.folder), "an image"), kind
    except (OSError, FileFormatError):
        return None, kind


def _others(gltf: Gltf) -> tuple[str, ...]:
    """Name what only a glTF file keeps."""
    tree = gltf.tree
    names = [kind for kind in EXTRAS if tree.get(kind)]
    primitives = [part for mesh in tree.get("meshes", []) for part in mesh.get("primitives", [])]
    further: set[str] = set()
    for part in primitives:
        further |= {*part["attributes"]} - CARRIED - {_base_coordinates(gltf, part)[0]}
    names.extend(f"the values {name} of vertices" for name in sorted(further))
    if any("targets" in part for part in primitives):
        names.append("morph targets")
    if any(part.get("mode", 4) not in SURFACES for part in primitives):
        names.append("lines and points")
    plain_pbr = {"baseColorFactor", "baseColorTexture", "metallicFactor"}
    for entry in tree.get("materials", []):
        pbr = _base_color(entry)
        is_metal = pbr.get("metallicFactor", 1.0) != 0.0  # our own files say 0
        is_clear = pbr.get("baseColorFactor", [1.0])[-1] < 1
        plain = {"name", "pbrMetallicRoughness", *(["alphaMode"] if is_clear else [])}
        if is_metal or set(entry) - plain or set(pbr) - plain_pbr:
            names.append("properties of materials other than color and image")
            break
    if len(tree.get("nodes", [])) > len(tree.get("meshes", [])):
        names.append("nodes without a mesh")
    return tuple(names)


class _Document:
    """A glTF tree and its one buffer, to which accessors are added."""

    def __init__(self, tree: dict[str, Any], binary: bytes | bytearray = b"") -> None:
        self.tree, self.binary = tree, bytearray(binary)

    def add_view(self, data: bytes, **entry: Any) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        views: list[Any] = self.tree.setdefault("bufferViews", [])
        place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        views.append({**place, **entry})
        self.binary += data
        return len(views) - 1

    def add_accessor(self, rows: np.ndarray, view: int, **entry: Any) -> int:
        accessors: list[Any] = self.tree.setdefault("accessors", [])
        kind = {"componentType": COMPONENTS[rows.dtype.str[1:]], "type": TYPES[rows.shape[1]]}
        accessors.append({"bufferView": view, "count": len(rows), **kind, **entry})
        return len(accessors) - 1

    def add_columns(self, columns: Columns) -> dict[str, int]:
        """Add columns, and return their accessors by name."""
        found = {}
        for name, (values, is_normalized) in columns.items():
            rows = np.ascontiguousarray(values)
            size = rows.dtype.itemsize * rows.shape[1]
            step = size + -size % 4  # rows of attributes begin at multiples of four bytes
            padded = np.zeros((len(rows), step), np.uint8)
            padded[:, :size] = rows.view(np.uint8).reshape(len(rows), size)
            view = self.add_view(padded.tobytes(), byteStride=step, target=34962)
            facts: dict[str, Any] = {"normalized": True} if is_normalized else {}
            if name == "POSITION":
                facts |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
            found[name] = self.add_accessor(rows, view, **facts)
        return found

    def add_indices(self, indices: Int[np.ndarray, " c"], n_vertices: int) -> int:
        rows = indices.astype("<u2" if n_vertices < 2**16 - 1 else "<u4").reshape(-1, 1)
        return self.add_accessor(rows, self.add_view(rows.tobytes(), target=34963))

    def pack(self) -> bytes:
        """Write the document, without the parts of its buffer that nothing uses."""
        views = self.tree.get("bufferViews", [])
        users = list(_view_users(self.tree))
        used = sorted({user["bufferView"] for user in users})
        kept = bytearray()
        for index in used:
            start = views[index].get("byteOffset", 0)
            views[index]["byteOffset"] = len(kept)
            kept += self.binary[start : start + views[index]["byteLength"]]
            kept += b"\0" * (-len(kept) % 4)
        places = {index: place for place, index in enumerate(used)}
        for user in users:
            user["bufferView"] = places[user["bufferView"]]
        self.tree["bufferViews"] = [views[index] for index in used]
        self.tree["buffers"] = [{"byteLength": len(kept)}]
        return pack(self.tree, bytes(kept))


def _view_users(value: Any) -> Iterator[dict[str, Any]]:
    """Give all objects of a tree that name a view; extensions do so by the same key."""
    if isinstance(value, dict):
        if type(value.get("bufferView")) is int:
            yield value
        value = list(value.values())
    if isinstance(value, list):
        for part in value:
            yield from _view_users(part)


def write(job: WriteJob) -> dict[Path, bytes]:
    """Write a GLB file: that of the source with other positions and triangles, or a new one."""
    source = job.attributes.source
    if source and source.suffix in (".glb", ".gltf"):
        return {job.path: _rewrite(source, job)}
    job.lose(["fields"])
    places, offset = _local_places(job.mesh)
    job.lost.extend(rounding_loss(job.mesh, (places + offset)[job.mesh.faces]))
    return {job.path: write_new(job.attributes, job.mesh)}


def _rewrite(source: SourceFile, job: WriteJob) -> bytes:
    """Write a glTF file again as GLB with other positions and triangles, and name what is lost.

    Everything else in the file stays as it is: nodes, materials, images, skins, animations and
    extensions. Every attribute of vertices is carried, whatever it means, but tangents. Positions
    are such that the nodes, skins and morph targets of the file put each vertex into its place.
    """
    mesh, attributes = job.mesh, job.attributes
    gltf, scene = _open(source)
    document = _copy_document(gltf, source, job.lost)
    file_rows = scene.piece.rows[scene.piece.faces.ravel()]
    parts = [(node, number) for node, number, _, _ in _placed_primitives(gltf, scene)]
    nodes, primitive_numbers = np.array(parts)[attributes.face_parts].T
    places = mesh.vertices[mesh.faces]
    found = np.zeros_like(places)  # where the written file puts the corners
    normals = corner_normals(attributes, mesh)
    written: dict[int, list[dict[str, Any]]] = {}
    for node, place in scene.placements.items():
        primitives = gltf.entry("meshes", place.mesh)["primitives"]
        written[node] = [part for part in primitives if part.get("mode", 4) not in SURFACES]
        for numbers in _sharing(primitives):
            shared = primitives[numbers[0]]
            chosen = np.flatnonzero((nodes == node) & np.isin(primitive_numbers, numbers))
            if not chosen.size:
                continue
            # The rows of the file that the corners come from, and what each gives to each corner
            blends = attributes.corners[(3 * chosen[:, None] + [0, 1, 2]).ravel()]
            used, inverse = np.unique(blends.indices, return_inverse=True)
            rows = file_rows[used]
            blends = csr_array((blends.data, inverse.ravel(), blends.indptr))
            columns = _carry_columns(gltf, shared, rows, blends)
            old = decode(*columns[0].pop("POSITION"))
            normal = (
                normals[chosen].reshape(-1, 3)
                if normals is not None and "NORMAL" in shared["attributes"]
                else None
            )
            # Corners of the file agree if their rows do, others if all their values do.
            keys = [rows[blends.indices]]
            if blends.nnz > 3 * len(chosen):
                keys = [
                    column
                    for table in columns
                    for values, _ in table.values()
                    for column in values.T
                ]
            keys += [] if normal is None else [*np.rint(normal.T * 1e5)]
            first, indices = _split_corners([mesh.faces[chosen].ravel(), *keys])
            columns = [_choose_rows(table, first) for table in columns]
            wanted = places[chosen].reshape(-1, 3)[first]
            facing = None if normal is None else normal[first]
            turned, put = _place_vertices(place, columns, old[first], wanted, facing)
            triangles = indices.reshape(-1, 3)
            found[chosen] = put[triangles]
            # A reflection turns triangles over, and the reader has turned them back.
            flips = turned[triangles].sum(axis=1) < 0
            triangles = np.where(flips[:, None], triangles[:, ::-1], triangles)
            job.lost.extend([TANGENTS] if "TANGENT" in shared["attributes"] else [])
            changed: dict[str, Any] = {"attributes": document.add_columns(columns[0])}
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


def _choose_rows(columns: Columns, chosen: Int[np.ndarray, " n"]) -> Columns:
    return {name: (values[chosen], flag) for name, (values, flag) in columns.items()}


def _carry_columns(
    gltf: Gltf, part: dict[str, Any], rows: Int[np.ndarray, " r"], blends: csr_array
) -> list[Columns]:
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
    normals: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Add the positions that a node moves into places, and normals, to the columns of vertices.

    What stays in its place keeps its old position, also below a node or joint of scale 0. Return
    the side that each vertex is turned to, and the place of its rounded position.
    """
    table, *targets = columns
    pose = place.matrix[None]
    if place.bones is not None:
        pose = pose_matrices({name: decode(*column) for name, column in table.items()}, place.bones)
    linear = pose[:, :3, :3]
    shifts, turns = (_morph(place, targets, name) for name in ("POSITION", "NORMAL"))
    moves = places - transform_points(pose, old + shifts)
    with np.errstate(over="ignore"):  # what is too large is found when places are compared
        local = (old + np.einsum("...ij,...j->...i", np.linalg.pinv(linear), moves)).astype("<f4")
    table["POSITION"] = local, False
    if normals is not None:
        normals = unit_rows(np.einsum("...ji,...j->...i", linear, normals))
        table["NORMAL"] = unit_rows(normals - turns).astype("<f4"), False
    return np.broadcast_to(sides(pose), len(local)), transform_points(pose, local + shifts)


def _morph(place: Placement, targets: list[Columns], name: str) -> Any:
    """Return what the morph targets of a mesh add to an attribute by its default weights."""
    pairs = zip(place.weights, targets, strict=False)
    return sum(weight * decode(*target[name]) for weight, target in pairs if name in target)


def _drop_extensions(tree: dict[str, Any], nodes: Iterable[int]) -> list[str]:
    """Drop the extensions of some nodes and their meshes that belong to the old geometry, and name them."""
    owners = [tree["nodes"][node] for node in nodes]
    meshes = [tree["meshes"][owner["mesh"]] for owner in owners if "mesh" in owner]
    parts = [part for mesh in meshes for part in mesh["primitives"]]
    dropped: set[str] = set()
    for entry in [*owners, *meshes, *parts, *tree["bufferViews"]]:
        extensions = entry.pop("extensions", {})
        kept = {name: value for name, value in extensions.items() if name not in OF_GEOMETRY}
        dropped |= extensions.keys() - kept.keys()
        if kept:
            entry["extensions"] = kept
    text = json.dumps(tree)
    for key in ("extensionsUsed", "extensionsRequired"):
        names = tree.pop(key, [])
        still_used = [name for name in names if name not in dropped or f'"{name}":' in text]
        if still_used:
            tree[key] = still_used
    return [f"the extension {name}, which is about the old geometry"
            for name in sorted(dropped.difference(COMPRESSIONS))]  # fmt: skip


def _sharing(primitives: list[dict[str, Any]]) -> list[list[int]]:
    """Return the numbers of surfaces that share their vertices and differ in material alone."""
    families: dict[str, list[int]] = {}
    for number, part in enumerate(primitives):
        if part.get("mode", 4) in SURFACES:
            key = json.dumps([part["attributes"], part.get("targets")], sort_keys=True)
            families.setdefault(key, []).append(number)
    return list(families.values())


def _split_corners(keys: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Make one vertex of all corners whose keys agree; return its first corner, and the indices."""
    _, first, indices = np.unique(
        np.column_stack(keys), axis=0, return_index=True, return_inverse=True
    )
    return first, indices.ravel()


def _blend(
    gltf: Gltf, index: int, name: str, rows: Int[np.ndarray, " r"], blends: csr_array
) -> tuple[np.ndarray, bool]:
    """Interpolate an attribute; joints, whose weights go along, and numbers of things are only chosen."""
    values = _take(raw_accessor(gltf, index), rows, name)
    is_chosen = name.startswith(("JOINTS", "WEIGHTS"))
    is_chosen |= name.startswith("_") and values.dtype.kind in "iu"
    is_normalized = gltf.entry("accessors", index).get("normalized") is True
    return interpolate(blends, values, blend=not is_chosen), is_normalized


def _copy_document(gltf: Gltf, source: SourceFile, lost: list[str]) -> _Document:
    """Copy a tree, with all buffers and images of other files in one buffer."""
    tree = copy.deepcopy(gltf.tree)
    starts, binary = [], bytearray()
    for data in gltf.buffers:
        starts.append(len(binary))
        binary += data + b"\0" * (-len(data) % 4)
    for view in tree.get("bufferViews", []):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    document = _Document(tree, binary)
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


def _replace_meshes(tree: dict[str, Any], written: dict[int, list[dict[str, Any]]]) -> None:
    """Give each node a mesh of its new primitives, and empty the accessors that they replace."""
    nodes, meshes = tree["nodes"], tree["meshes"]
    before = copy.deepcopy(meshes)
    first_user: dict[int, int] = {}
    for node, entry in enumerate(nodes):
        first_user.setdefault(entry.get("mesh", -1), node)
    for node, primitives in written.items():
        index = nodes[node]["mesh"]
        if not primitives:
            del nodes[node]["mesh"]  # all its faces were dropped
            nodes[node].pop("skin", None)
        elif first_user[index] == node:
            meshes[index] = {**before[index], "primitives": primitives}
        else:  # several nodes share a mesh, and each has its own positions now
            nodes[node]["mesh"] = len(meshes)
            meshes.append({**before[index], "primitives": primitives})
    still_used = {index for mesh in meshes for index in _accessors_of(mesh)}
    for animation in tree.get("animations", []):
        still_used |= {s[key] for s in animation.get("samplers", []) for key in ("input", "output")}
    still_used |= {skin.get("inverseBindMatrices") for skin in tree.get("skins", [])}
    for index in {index for mesh in before for index in _accessors_of(mesh)} - still_used:
        for key in ("bufferView", "byteOffset", "sparse", "min", "max"):
            tree["accessors"][index].pop(key, None)  # its data are left out when packed


def _accessors_of(mesh: dict[str, Any]) -> Iterator[int]:
    for part in mesh["primitives"]:
        for columns in (part["attributes"], *part.get("targets", [])):
            yield from columns.values()
        if "indices" in part:
            yield part["indices"]


def write_new(attributes: MeshAttributes, mesh: TriangleMesh) -> bytes:
    """Write a GLB file with a node for each group and a primitive for each of its materials."""
    document = _Document({"asset": {"version": "2.0", "generator": "eigenshape"}, "scene": 0})
    tree = document.tree
    tree |= {"scenes": [{"nodes": []}], "nodes": [], "meshes": []}
    places, offset = _local_places(mesh)
    normals = corner_normals(attributes, mesh)
    if attributes.materials:
        tree["materials"] = [_write_material(document, m) for m in attributes.materials]
    tables: Columns = {}  # with a row for each corner
    if normals is not None:
        tables["NORMAL"] = normals.astype("<f4"), False
    if attributes.texture_coordinates is not None:
        flipped = [0, 1] + attributes.texture_coordinates * [1, -1]
        tables["TEXCOORD_0"] = flipped.astype("<f4"), False
    if attributes.colors is not None:
        tints = attributes.colors / 255
        tints[..., :3] = linear_colors(tints[..., :3])
        # Other programs keep the low byte of colors of 16 bits (trimesh 5.2, MeshLab).
        tables["COLOR_0"] = tints.astype("<f4"), False
    groups = np.unique(attributes.face_groups)
    for group in groups:
        in_group = np.flatnonzero(attributes.face_groups == group)
        corners = mesh.faces[in_group].ravel()
        rows = {
            name: (table[in_group].reshape(-1, table.shape[2]), is_normalized)
            for name, (table, is_normalized) in tables.items()
        }
        if not tables and len(groups) == 1:  # vertices keep their order, also those without a face
            first, indices, positions = np.arange(mesh.n_vertices), corners, places
        else:
            keys = [corners, *(column for values, _ in rows.values() for column in values.T)]
            first, indices = _split_corners(keys)
            positions = places[corners]
        table = document.add_columns(_choose_rows({"POSITION": (positions, False), **rows}, first))
        materials = attributes.face_materials[in_group]
        primitives: list[dict[str, Any]] = []
        for material in np.unique(materials).tolist():
            of_part = np.repeat(materials == material, 3)
            entry = {
                "attributes": table,
                "indices": document.add_indices(indices[of_part], len(first)),
            }
            primitives.append(entry | ({"material": material} if material >= 0 else {}))
        name = attributes.groups[group] if group >= 0 else ""
        tree["scenes"][0]["nodes"].append(len(tree["nodes"]))
        node = {"mesh": len(tree["meshes"]), **({"name": name} if name else {})}
        tree["nodes"].append(node | ({"translation": offset.tolist()} if offset.any() else {}))
        tree["meshes"].append({"primitives": primitives})
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


def _write_material(document: _Document, material: Material) -> dict[str, Any]:
    *tint, alpha = material.color
    color = [*linear_colors(np.array(tint)).tolist(), alpha]
    pbr: dict[str, Any] = {"baseColorFactor": color, "metallicFactor": 0.0}
    if material.image is not None:
        tree = document.tree
        images, textures = tree.setdefault("images", []), tree.setdefault("textures", [])
        kind = mimetypes.guess_type(material.image_name)[0] or "image/png"
        view = document.add_view(material.image)
        images.append({"bufferView": view, "mimeType": kind, "name": material.image_name})
        textures.append({"source": len(images) - 1})
        pbr["baseColorTexture"] = {"index": len(textures) - 1}
    see_through = {"alphaMode": "BLEND"} if material.color[3] < 1 else {}
    return {"name": material.name, "pbrMetallicRoughness": pbr, **see_through}
