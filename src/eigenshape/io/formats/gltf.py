"""glTF, as one binary file or with separate buffers: the triangles of a scene as viewers show them.

Nodes, instances, skins and morph targets place them, in the pose that stands in the file; animations
are not played.

Read: triangles, strips and fans of one scene; nodes, instances, skins, default weights of morph
    targets, quantized and sparse accessors.
Kept: to GLB all but tangents and instances; to others texture coordinates (with their transform),
    normals, colors, materials with their images, names of nodes.
Named: other scenes; hidden nodes; points and lines; weights of joints that have no sum of 1;
    extensions that are not read; digits that are lost.
Refused: meshes that Draco or meshopt has packed, and other extensions that a file requires;
    buffers outside the file or its folder.
"""

import base64
import json
import struct
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from scipy.spatial.transform import Rotation

from certeig.kit.errors import FileFormatError
from certeig.kit.files import read_regular
from eigenshape.io.formats.cells import NO_TRIANGLES
from eigenshape.io.formats.numbers import quote_line
from eigenshape.io.formats.obj_attributes import find_beside

Entry = dict[str, Any]  # an object of the JSON tree
Column = tuple[np.ndarray, bool]  # numbers, and whether whole ones mean shares of one
JSON_CHUNK = b"JSON"
BINARY_CHUNK = b"BIN\0"
COPIES = 2**22  # most vertices and faces from copies in a small file; they take 200 MB
KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TRIANGLES, STRIP, FAN = SURFACES = 4, 5, 6
LARGEST = sys.float_info.max
SKINS = "JOINTS", "WEIGHTS"  # attributes of vertices; what they have four of each has a number
# Weights of a vertex in a skin sum to 1; eight of one byte each may miss it by 8 / 2 / 255.
SAME_SUM = 0.02
# Extensions that say where geometry is, and are applied: copies of a mesh, nodes that are not shown,
# and nodes that stand for another one from afar.
INSTANCES, VISIBILITY, LEVELS = "EXT_mesh_gpu_instancing", "KHR_node_visibility", "MSFT_lod"
# Compressed copies of geometry. Where they are not required, the file holds it plainly, too.
LONGEST_PATH = 4096  # characters of a path that a system opens
DRACO = "KHR_draco_mesh_compression"
COMPRESSED = (
    "A glTF file must hold its geometry plainly; it is compressed by the extension {!r}. The command "
    "`npx @gltf-transform/cli copy a.glb b.glb` writes it without compression."
)
COMPRESSIONS = (DRACO, "EXT_meshopt_compression", "KHR_meshopt_compression")
# What places a node or an instance, and where it stands by default.
PLACES = {"TRANSLATION": [0.0] * 3, "ROTATION": [0.0, 0.0, 0.0, 1.0], "SCALE": [1.0] * 3}
# Beginnings of the names of extensions that are applied, or leave all geometry in its place.
HARMLESS = (
    INSTANCES, "KHR_mesh_quantization", "KHR_node_", "KHR_animation_", "KHR_audio", "KHR_lights_",
    "KHR_materials_", "KHR_texture_", "KHR_xmp", "EXT_instance_features", "EXT_lights_", "EXT_materials_",
    "EXT_mesh_features", "EXT_mesh_manifold", "EXT_structural_metadata", "EXT_texture_", "MSFT_",
    "FB_ngon_encoding", "CESIUM_primitive_outline", "GODOT_single_root", "VRM",
)  # fmt: skip


class Piece(NamedTuple):
    """Triangles, and where they stand in the file."""

    vertices: np.ndarray  # (n, 3)
    faces: np.ndarray  # (f, 3)
    rows: np.ndarray  # (n,) the row of each vertex in the accessors of its primitive
    primitives: np.ndarray  # (f,) the number of each face's primitive in its mesh


NOTHING = Piece(np.empty((0, 3)), NO_TRIANGLES, *np.empty((2, 0), dtype=np.int64))


class Placement(NamedTuple):
    """How a node shows its mesh."""

    mesh: int
    weights: tuple[float, ...]  # of the morph targets
    matrix: np.ndarray  # (4, 4) from the coordinates of the node to those of the world
    copies: np.ndarray  # (k, 4, 4) the same for each instance; the identity if there is a skin
    skin: int | None
    bones: np.ndarray | None  # (j, 4, 4) for each joint of the skin, instead of the matrix


class Scene(NamedTuple):
    """The triangles of all nodes in world coordinates, and where they stand in the file."""

    number: int | None  # None if the file has no scenes
    piece: Piece
    nodes: np.ndarray  # (f,) the node of each face
    placements: dict[int, Placement]  # by node

    def parts(self) -> tuple[list[list[int]], np.ndarray]:
        """Return the node and the number of each primitive that has faces, and each face's primitive in this list."""
        size = self.piece.primitives.max() + 1
        codes, owners = np.unique(self.nodes * size + self.piece.primitives, return_inverse=True)
        return np.transpose(np.divmod(codes, size)).tolist(), owners


@dataclass(frozen=True)
class Gltf:
    """The JSON tree and buffers of a file, and a limit for its vertices and faces.

    There is a limit because a small file can place one mesh any number of times. Notes say what
    the file holds and the shape does not, as they are found.
    """

    tree: Entry
    buffers: Sequence[bytes]
    most: int
    notes: list[str] = field(default_factory=list)

    def entry(self, kind: str, index: Any) -> Entry:
        """Return one entry of a list in the tree."""
        entries = _list(self.tree, kind)
        known = type(index) is int and 0 <= index < len(entries)
        if not known or not isinstance(entries[index], dict):
            raise FileFormatError(
                f"A glTF file must hold what it names; it names {kind}[{ascii(index)[:60]}] and holds none."
            )
        return entries[index]

    def entries(self, kind: str) -> list[Entry]:
        """Return all entries of a list in the tree."""
        return [self.entry(kind, index) for index in range(len(_list(self.tree, kind)))]

    def require_few(self, total: int) -> None:
        """Raise an error if there are more vertices and faces than the limit."""
        if total > self.most:
            raise FileFormatError(
                f"A glTF file must stay within {self.most} vertices and faces; its copies make more."
            )


def parse(
    data: bytes, folder: Path | None = None, scene: str | int | None = None
) -> tuple[np.ndarray, np.ndarray, *tuple[str, ...]]:
    """Read vertices and faces of a scene, and notes, from a .glb file or the text of a .gltf file.

    The buffers of a .gltf file lie in its folder, if that is given, or in data URIs.
    """
    gltf = read_gltf(data, folder)
    piece = place_triangles(gltf, scene).piece
    return piece.vertices, piece.faces, *gltf.notes


def read_gltf(data: bytes, folder: Path | None = None) -> Gltf:
    """Read the tree and the buffers of a file; see `parse`."""
    is_text = data[:4] != b"glTF" and (folder is not None or data.lstrip().startswith(b"{"))
    chunks = {JSON_CHUNK: data} if is_text else _chunks(data)
    try:
        tree: Any = json.loads(chunks.get(JSON_CHUNK, b""))
    except (ValueError, RecursionError) as err:
        raise FileFormatError(
            f"The first chunk of a GLB file, and a .gltf file, must be JSON; {err}."
        ) from err
    if not isinstance(tree, dict):
        raise FileFormatError(
            f"The JSON of a glTF file must be an object; it is a {type(tree).__name__}."
        )
    buffers = [
        decode_buffer(index, entry, chunks.get(BINARY_CHUNK, b""), folder if is_text else None)
        for index, entry in enumerate(_list(tree, "buffers"))
    ]
    return Gltf(tree, buffers, most=max(sum(map(len, buffers)), COPIES))


def _chunks(data: bytes) -> dict[bytes, bytes]:
    """Return the chunks of a GLB file by their kinds; of one kind the first."""
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if data[:4] != b"glTF" or version != 2 or length != len(data):
        raise FileFormatError(
            f"A GLB file must begin with glTF, version 2 and its length; it begins with "
            f"{quote_line((1, data[:4]))}, {version} and {length}, and has {len(data)} bytes."
        )
    chunks: dict[bytes, bytes] = {}
    start = 12
    while start < length:
        end = start + 8 + int.from_bytes(data[start : start + 4], "little")
        if start + 8 > length or end > length:
            raise FileFormatError(
                f"A chunk of a GLB file must end within it; one ends at {end} of {length} bytes."
            )
        chunks.setdefault(data[start + 4 : start + 8], data[start + 8 : end])
        start = end
    return chunks


def pack(tree: Entry, binary: bytes) -> bytes:
    """Write a tree and its buffer as one binary file."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    body = _chunk(JSON_CHUNK, text, b" ") + _chunk(BINARY_CHUNK, binary, b"\0")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    content += filler * (-len(content) % 4)
    return struct.pack("<I4s", len(content), kind) + content


def decode_buffer(index: int, entry: Any, binary: bytes, folder: Path | None) -> bytes:
    """Return a buffer: the binary chunk, a data URI or, if a folder is given, a file in it.

    Raise FileFormatError if it is outside the file or the folder; such a file is not opened.
    """
    uri = entry.get("uri") if isinstance(entry, dict) else None
    if uri is None:
        return binary if index == 0 else b""
    scheme, _, content = str(uri).partition(",")
    if scheme.startswith("data:") and scheme.endswith(";base64"):
        try:
            return base64.b64decode(content, validate=True)
        except ValueError as err:
            raise FileFormatError(
                f"A data URI must be in base64; buffers[{index}] is not."
            ) from err
    if folder is None:
        raise FileFormatError(
            f"A GLB file must hold all its data; buffers[{index}] points outside, to {str(uri)[:80]!r}."
        )
    size = _whole(entry, "byteLength")
    data = read_beside(index, str(uri), folder)
    if len(data) < size:
        raise FileFormatError(
            f"buffers[{index}] must have {size} bytes; the file {str(uri)[:80]!r} has {len(data)}."
        )
    return data[:size]


def read_beside(index: int, uri: str, folder: Path) -> bytes:
    """Read the file of a relative URI; links resolved, it must be in or below the folder."""
    path = None if ":" in uri or len(uri) > LONGEST_PATH else find_beside(unquote(uri), folder)
    # A service must not tell where its folder is, as an error of the system would.
    if path is None:
        raise FileFormatError(
            f"Buffers of a .gltf file must lie in its folder; buffers[{index}], {uri[:80]!r}, is not there. "
            "Give the file with its folder, or save it as .glb, which holds all."
        )
    return read_regular(path, "numbers")


def place_triangles(gltf: Gltf, name: str | int | None = None) -> Scene:
    """Gather the triangles of all nodes of a scene, in world coordinates; there must be some."""
    _check_extensions(gltf)
    scene = _choose_scene(gltf, name)
    placements = _placements(gltf, scene)
    shapes: dict[Any, Piece] = {}
    placed = []
    total = 0
    for place in placements.values():
        # Nodes share what they show alike.
        key = place.mesh, place.weights, place.skin
        if key not in shapes:
            shapes[key] = _mesh(gltf, place)
        piece = shapes[key]
        total += len(place.copies) * (len(piece.vertices) + len(piece.faces))
        gltf.require_few(total)  # before any copy is made
        placed.append(_copy_piece(piece, place.copies))
    shown = {place.mesh for place in placements.values()}
    parts = [part for n in shown for part in _list(gltf.entry("meshes", n), "primitives")]
    if n_others := sum(part.get("mode", TRIANGLES) not in SURFACES for part in parts):
        gltf.notes.append(f"{n_others} primitives of points or lines are left out")
    whole = _merge_pieces(placed)
    if not len(whole.faces):
        reasons = "".join(f"; {note}" for note in gltf.notes)
        raise FileFormatError(f"A glTF file must hold triangles; it holds none{reasons}.")
    nodes = np.repeat(list(placements), [len(piece.faces) for piece in placed])
    return Scene(scene, whole, nodes, placements)


def _check_extensions(gltf: Gltf) -> None:
    """Raise an error if an unknown extension is required, and note unknown ones that are used."""
    for name in map(str, _list(gltf.tree, "extensionsRequired")):
        if name in COMPRESSIONS:
            raise FileFormatError(COMPRESSED.format(name))
        if not name.startswith(HARMLESS):
            raise FileFormatError(
                f"A glTF file must be plain glTF 2.0; it requires the extension {name[:60]!r}."
            )
    used = [ascii(name)[:60] for name in _list(gltf.tree, "extensionsUsed")
            if not str(name).startswith((*HARMLESS, *COMPRESSIONS))]  # fmt: skip
    if used:
        gltf.notes.append(
            f"extensions that are not read may move, add or select parts of the shape: {', '.join(used)}"
        )


def extension(entry: Any, name: str) -> Entry:
    """Return what an extension adds to an entry of the tree, which may be nothing."""
    return member(member(entry, "extensions"), name)


def member(entry: Entry, key: str) -> Entry:
    """Return an object in another one; without it an empty one."""
    value = entry.get(key, {})
    if not isinstance(value, dict):
        raise FileFormatError(f"{key} of a glTF file must be an object; it is {str(value)[:60]!r}.")
    return value


def _choose_scene(gltf: Gltf, wanted: str | int | None) -> int | None:
    """Return the number of the scene of a name or number, or of the one that the file names."""
    names = [entry.get("name") for entry in gltf.entries("scenes")]
    if not names and wanted is None:
        return None
    number = gltf.tree.get("scene", 0) if wanted is None else wanted
    if isinstance(number, str):
        number = (
            names.index(number) if number in names else int(number) if number.isdecimal() else -1
        )
    listed = ", ".join(
        f"{n} {'' if name is None else repr(name)}".strip() for n, name in enumerate(names)
    )
    if type(number) is not int or not 0 <= number < len(names):
        raise FileFormatError(
            f"The scene of a glTF file must be one that it holds, {listed[:400] or 'none'}; it is "
            f"{str(gltf.tree.get('scene') if wanted is None else wanted)[:60]!r}."
        )
    if wanted is None and len(names) > 1:
        gltf.notes.append(
            f"scene {number} is read of scenes {listed[:400]}; scene= or --scene chooses"
        )
    return number


def _copy_piece(piece: Piece, matrices: np.ndarray) -> Piece:
    """Place copies of triangles."""
    count, n_vertices = len(matrices), len(piece.vertices)
    points = transform_points(matrices[:, None], piece.vertices).reshape(-1, 3)
    starts = np.repeat(n_vertices * np.arange(count), len(piece.faces))
    faces = np.tile(piece.faces, (count, 1)) + starts[:, None]
    signs = np.repeat(sides(matrices), n_vertices)
    rows, primitives = np.tile(piece.rows, count), np.tile(piece.primitives, count)
    return Piece(points, turn_back(faces, signs), rows, primitives)


def turn_back(faces: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Reverse the triangles whose vertices a reflection turns over, as the format demands."""
    return np.where(signs[faces].sum(axis=1, keepdims=True) < 0, faces[:, ::-1], faces)


def sides(matrices: np.ndarray) -> np.ndarray:
    """Return -1 for matrices that turn triangles over, and 1 for others, however small."""
    return np.linalg.slogdet(matrices[:, :3, :3])[0]


def _merge_pieces(pieces: Sequence[Piece]) -> Piece:
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    moved = [
        piece._replace(faces=piece.faces + start)
        for piece, start in zip(pieces, starts, strict=False)
    ]
    return Piece(*map(np.concatenate, zip(NOTHING, *moved, strict=True)))


def _placements(gltf: Gltf, scene: int | None) -> dict[int, Placement]:
    """Return how each node of a scene shows its mesh."""
    matrices, hidden = world_matrices(gltf, scene)
    skins: dict[int, np.ndarray] = {}
    found = {}
    for index, matrix in matrices.items():
        node = gltf.entry("nodes", index)
        if "mesh" not in node or index in hidden:
            continue
        mesh = gltf.entry("meshes", node["mesh"])
        n_targets = max(
            (len(_list(part, "targets")) for part in _list(mesh, "primitives")), default=0
        )
        # The weights of a node win over those of its mesh.
        weights = [0.0] * n_targets
        for entry in (mesh, node):
            weights = _numbers(entry, "weights", weights).tolist()
        copies = matrix @ _instances(gltf, node)
        skin, bones = node.get("skin"), None
        if skin is not None:
            gltf.entry("skins", skin)
            if skin not in skins:
                skins[skin] = _bones(gltf, skin, matrices)
            # By the format only the joints place a skin, and neither its node nor instances.
            bones, copies = skins[skin], np.eye(4)[None]
        found[index] = Placement(node["mesh"], tuple(weights), matrix, copies, skin, bones)
    if n_hidden := sum("mesh" in gltf.entry("nodes", index) for index in hidden):
        gltf.notes.append(f"{n_hidden} nodes with a mesh are hidden by {VISIBILITY}, and left out")
    return found


def world_matrices(gltf: Gltf, scene: int | None) -> tuple[dict[int, np.ndarray], set[int]]:
    """Return the matrices of all nodes of a scene, parents first, and which of these nodes are hidden."""
    nodes = gltf.entries("nodes")
    coarser = _named_nodes(_list(extension(node, LEVELS), "ids") for node in nodes)
    if scene is None:
        below = _named_nodes(_list(node, "children") for node in nodes)
        roots = [index for index in range(len(nodes)) if index not in below]
    else:
        roots = _list(gltf.entry("scenes", scene), "nodes")
    waiting = [(index, np.eye(4), True) for index in reversed(roots)]
    matrices: dict[int, np.ndarray] = {}
    hidden = set()
    while waiting:
        index, above, is_shown = waiting.pop()
        node = gltf.entry("nodes", index)
        if index in matrices:
            raise FileFormatError(
                f"The nodes of a glTF file must form trees; node {index} is met twice."
            )
        if index in coarser:
            continue
        is_shown &= extension(node, VISIBILITY).get("visible") is not False
        matrices[index] = above @ local_matrix(node)
        if not is_shown:
            hidden.add(index)
        waiting.extend(
            (child, matrices[index], is_shown) for child in reversed(_list(node, "children"))
        )
    return matrices, hidden


def _named_nodes(lists: Iterable[list[Any]]) -> set[int]:
    return {index for entries in lists for index in entries if type(index) is int}


def _bones(gltf: Gltf, index: int, matrices: dict[int, np.ndarray]) -> np.ndarray:
    """Return, for each joint of a skin, the matrix from where the skin was bound to the world."""
    skin = gltf.entry("skins", index)
    joints = _list(skin, "joints")
    for joint in joints:
        gltf.entry("nodes", joint)
        if joint not in matrices:
            raise FileFormatError(
                f"Joints of a skin must lie in the scene of its mesh; skins[{index}] names node {joint}, "
                "which does not."
            )
    bones = np.array([matrices[joint] for joint in joints]).reshape(-1, 4, 4)
    if "inverseBindMatrices" not in skin:
        return bones
    inverses = read_accessor(gltf, skin["inverseBindMatrices"], 16)
    if len(inverses) < len(joints):
        raise FileFormatError(
            f"A skin must have an inverse bind matrix for each joint; skins[{index}] has {len(inverses)} "
            f"for {len(joints)} joints."
        )
    columns = inverses[: len(joints)].reshape(-1, 4, 4)
    return bones @ columns.transpose(0, 2, 1)


def _instances(gltf: Gltf, node: Entry) -> np.ndarray:
    """Return the matrix of each instance of the mesh of a node; the identity if it has none."""
    named = member(extension(node, INSTANCES), "attributes")
    if not named:
        return np.eye(4)[None]
    count = max(_whole(gltf.entry("accessors", accessor), "count") for accessor in named.values())
    gltf.require_few(count)
    columns = [
        np.tile(default, (count, 1)) if name not in named
        else read_column(gltf, named, name, len(default), count)
        for name, default in PLACES.items()
    ]  # fmt: skip
    return _compose(*columns)


def local_matrix(node: Entry) -> np.ndarray:
    """Return the matrix of a node from its coordinates to those of its parent."""
    if "matrix" in node:
        return _numbers(node, "matrix", [0.0] * 16).reshape(4, 4).T  # stored by columns
    return _compose(
        *(_numbers(node, name.lower(), default)[None] for name, default in PLACES.items())
    )[0]


def _compose(
    shifts: np.ndarray,
    turns: np.ndarray,
    scales: np.ndarray,
) -> np.ndarray:
    """Return the matrices that scale, then turn by quaternions, then shift."""
    sizes = np.abs(turns).max(axis=1, keepdims=True)
    if not sizes.all():
        raise FileFormatError(
            "A rotation must be a quaternion other than zero; a node has [0, 0, 0, 0]."
        )
    matrices = np.tile(np.eye(4), (len(shifts), 1, 1))
    matrices[:, :3, :3] = Rotation.from_quat(turns / sizes).as_matrix() * scales[:, None]
    matrices[:, :3, 3] = shifts
    return matrices


def _mesh(gltf: Gltf, place: Placement) -> Piece:
    """Read one mesh with its morph targets and its skin.

    Parts that differ only in material share their vertices, as in the file.
    """
    primitives = _list(gltf.entry("meshes", place.mesh), "primitives")
    pieces = []
    total = 0
    for numbers in families(primitives, ("POSITION", *SKINS)):
        vertices, turned = _vertices(gltf, primitives[numbers[0]], place)
        total += len(vertices)
        faces = []
        for number in numbers:
            faces.append(turn_back(_faces(gltf, primitives[number], len(vertices)), turned))
            total += 1 + len(faces[-1])
            gltf.require_few(total)
        owners = np.repeat(numbers, [len(block) for block in faces])
        pieces.append(Piece(vertices, np.concatenate(faces), np.arange(len(vertices)), owners))
    return _merge_pieces(pieces)


def families(primitives: list[Any], names: tuple[str, ...] = ("",)) -> list[list[int]]:
    """Return the numbers of surfaces with the same targets and, of attributes that begin so, the same."""
    found: dict[str, list[int]] = {}
    for number, part in enumerate(primitives):
        if _whole(part, "mode", TRIANGLES) in SURFACES:
            _whole(part.get("attributes"), "POSITION")
            same = {
                key: index for key, index in part["attributes"].items() if key.startswith(names)
            }
            key = json.dumps([same, part.get("targets")], sort_keys=True)
            found.setdefault(key, []).append(number)
    return list(found.values())


def _vertices(gltf: Gltf, part: Entry, place: Placement) -> tuple[np.ndarray, np.ndarray]:
    """Read the vertices of a primitive, and the sides that a skin turns them to."""
    attributes = part["attributes"]
    accessor = gltf.entry("accessors", attributes["POSITION"])
    if extension(part, DRACO) and "bufferView" not in accessor:
        raise FileFormatError(COMPRESSED.format(DRACO))
    vertices = read_accessor(gltf, attributes["POSITION"], 3)
    count = len(vertices)
    for weight, target in zip(place.weights, _list(part, "targets"), strict=False):
        if weight and isinstance(target, dict) and "POSITION" in target:
            vertices = vertices + weight * read_column(gltf, target, "POSITION", 3, count)
    if place.bones is None:
        return vertices, np.ones(count)
    matrices, n_odd = pose_matrices(
        attributes, lambda name: read_column(gltf, attributes, name, 4, count), place.bones
    )
    if n_odd:
        gltf.notes.append(
            f"weights of {n_odd} vertices of a skin do not sum to 1, and were divided by their sum; "
            "vertices without weights follow their first joint"
        )
    return transform_points(matrices, vertices), sides(matrices)


def pose_matrices(
    attributes: Iterable[str], read: Callable[[str], np.ndarray], bones: np.ndarray
) -> tuple[np.ndarray, int]:
    """Return the mean matrix of the joints of each vertex (glTF 2.0, section 3.7.3.3).

    Return also how many vertices have weights that do not sum to 1.
    """
    joints, weights, n_odd = skin_weights(attributes, read, len(bones))
    pairs = zip(weights.T, joints.T, strict=True)
    return sum(weight[:, None, None] * bones[joint] for weight, joint in pairs), n_odd


def skin_weights(
    attributes: Iterable[str], read: Callable[[str], np.ndarray], n_joints: int
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the joints of each vertex, their weights with sum 1, and how many sums were others."""
    # Each set has four joints and weights, and the first one must be there.
    sets = sorted({"JOINTS_0", *(name for name in attributes if name.startswith("JOINTS"))})
    wanted = [name.replace("JOINTS", kind) for name in sets for kind in SKINS]
    if missing := [name for name in wanted if name not in attributes]:
        raise FileFormatError(
            f"A mesh with a skin must have {', '.join(wanted)}; it has no {', '.join(missing)}. "
            "Without its skin, or bound to its joints again by the program that wrote it, it can be read."
        )
    joints, weights = (
        np.hstack([read(name.replace("JOINTS", kind)) for name in sets]) for kind in SKINS
    )
    sums = weights.sum(axis=1)
    n_odd = int((np.abs(sums - 1.0) > SAME_SUM).sum())
    weights[sums == 0, 0] = 1.0
    weights /= weights.sum(axis=1, keepdims=True)
    joints = np.where(weights != 0, joints, 0).astype(np.int64)
    bad, places = np.nonzero((joints < 0) | (joints >= n_joints))
    if bad.size:
        raise FileFormatError(
            f"Joints of vertices must be within 0..{n_joints - 1}; vertex {bad[0]} has joint "
            f"{joints[bad[0], places[0]]}."
        )
    return joints, weights, n_odd


def transform_points(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Move points by a matrix each, or by one for all."""
    moved = np.einsum("...ij,...j->...i", matrices[..., :3, :3], points)
    return moved + matrices[..., :3, 3]


def _faces(gltf: Gltf, part: Entry, n_vertices: int) -> np.ndarray:
    """Read the triangles of a primitive: a list, a strip or a fan."""
    corners = np.arange(n_vertices)
    if "indices" in part:
        indices = read_accessor(gltf, part["indices"], 1)[:, 0]
        bad = np.flatnonzero(
            (indices != np.floor(indices)) | (indices < 0) | (indices >= n_vertices)
        )
        if bad.size:
            raise FileFormatError(
                f"Indices of a primitive must be whole and within 0..{n_vertices - 1}; index {bad[0]} is "
                f"{indices[bad[0]]:.10g}."
            )
        corners = indices.astype(np.int64)
    mode = _whole(part, "mode", TRIANGLES)
    if mode == TRIANGLES:
        if len(corners) % 3:
            raise FileFormatError(
                f"Triangles must have three corners each; a primitive has {len(corners)} in all."
            )
        return corners.reshape(-1, 3)
    place = np.arange(max(len(corners) - 2, 0))
    if mode == FAN:
        return corners[np.column_stack([place + 1, place + 2, np.zeros_like(place)])]
    odd = place % 2  # every second triangle of a strip is turned
    return corners[np.column_stack([place, place + 1 + odd, place + 2 - odd])]


def read_column(gltf: Gltf, named: Entry, name: str, width: int, count: int) -> np.ndarray:
    """Read one of several accessors that have a row each for the same things."""
    rows = read_accessor(gltf, _whole(named, name), width)
    if len(rows) != count:
        raise FileFormatError(
            f"{name} in a glTF file must have {count} rows, as what stands beside it; it has {len(rows)}."
        )
    return rows


def read_accessor(gltf: Gltf, index: Any, width: int | None = None) -> np.ndarray:
    """Read an accessor as float64; each row must have `width` numbers, if that is given."""
    return decode(*raw_accessor(gltf, index, width))


def decode(rows: np.ndarray, is_normalized: bool) -> np.ndarray:
    """Return float64; normalized whole numbers are shares of the largest one."""
    if is_normalized and rows.dtype.kind in "iu":
        return np.maximum(rows / np.iinfo(rows.dtype).max, -1.0)
    return rows.astype(np.float64)


def raw_accessor(gltf: Gltf, index: Any, wanted: int | None = None) -> Column:
    """Return the rows of an accessor as they are stored, if possible without a copy; `wanted` numbers each."""
    accessor = gltf.entry("accessors", index)
    name = f"accessors[{index}]"
    kind = np.dtype(KINDS.get(_whole(accessor, "componentType"), "V0"))
    width = WIDTHS.get(str(accessor.get("type")), 0)
    if not kind.itemsize or not (width == wanted if wanted else width):
        raise FileFormatError(
            f"{name} must have rows of {wanted or '1 to 4, or 16'} numbers of a known type; it has "
            f"{ascii(accessor.get('type'))[:60]} of type {accessor['componentType']}."
        )
    count = _whole(accessor, "count")
    if "bufferView" in accessor:
        rows = _stored_rows(gltf, accessor, kind, width, count, name)
    else:
        gltf.require_few(count)  # zeros take memory, and none of the file
        rows = np.zeros((count, width), kind)
    if "sparse" in accessor:  # some rows are replaced
        sparse = accessor["sparse"]
        n_replaced = _whole(sparse, "count")
        places, values = (sparse.get(key) for key in ("indices", "values"))
        kind_of_places = np.dtype(KINDS.get(_whole(places, "componentType"), "V0"))
        chosen = _stored_rows(gltf, places, kind_of_places, 1, n_replaced, name).ravel()
        if kind_of_places.kind != "u" or (chosen >= count).any():
            raise FileFormatError(
                f"{name} must replace rows that it has, 0..{count - 1}; it replaces {chosen[:5]}."
            )
        rows = rows.copy()
        rows[chosen] = _stored_rows(gltf, values, kind, width, n_replaced, name)
    return rows, accessor.get("normalized") is True


def _stored_rows(
    gltf: Gltf, entry: Any, kind: np.dtype[Any], width: int, count: int, name: str
) -> np.ndarray:
    """Return rows that lie in a view, without a copy."""
    start = _whole(entry, "byteOffset", 0)
    data, step = view_of(gltf, entry.get("bufferView"))
    row = kind.itemsize * width
    step = step if step and count > 1 else row  # fewer than two rows have no step
    if step < row or start + (count - 1) * step + row > len(data):
        raise FileFormatError(
            f"{name} must lie in its buffer; {count} rows do not fit {len(data)} bytes."
        )
    return np.ndarray((count, width), kind, data, start, (step, kind.itemsize))


def view_of(gltf: Gltf, index: Any) -> tuple[memoryview, int]:
    """Return the bytes of a view, and the distance between its rows or 0."""
    view = gltf.entry("bufferViews", index)
    place = _whole(view, "buffer")
    data = memoryview(gltf.buffers[place] if place < len(gltf.buffers) else b"")
    return data[_whole(view, "byteOffset", 0) :][: _whole(view, "byteLength")], _whole(
        view, "byteStride", 0
    )


def _list(entry: Any, key: str) -> list[Any]:
    value = entry.get(key, []) if isinstance(entry, dict) else None
    if not isinstance(value, list):
        raise FileFormatError(f"{key} of a glTF file must be a list; it is {str(value)[:60]!r}.")
    return value


def _whole(entry: Any, key: str, default: int | None = None) -> int:
    value = entry.get(key, default) if isinstance(entry, dict) else None
    if type(value) is not int or value < 0:
        raise FileFormatError(
            f"{key} in a glTF file must be a whole number from 0; it is {str(value)[:60]!r}."
        )
    return value


def _numbers(entry: Entry, key: str, default: list[float]) -> np.ndarray:
    value = entry.get(key, default)
    known = isinstance(value, list) and len(value) == len(default)
    if not known or not all(type(part) in (int, float) and abs(part) <= LARGEST for part in value):
        raise FileFormatError(
            f"{key} of a node must be {len(default)} finite numbers; it is {str(value)[:60]!r}."
        )
    return np.array(value, dtype=np.float64)
