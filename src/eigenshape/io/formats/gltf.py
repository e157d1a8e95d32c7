"""glTF, as one binary file or with separate buffers: the triangles of all nodes, transformed."""

import base64
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from scipy.spatial.transform import Rotation

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular
from eigenshape.io.formats.cells import NO_TRIANGLES
from eigenshape.io.formats.numbers import quote_line

JSON_CHUNK = b"JSON"
BINARY_CHUNK = b"BIN\0"
COPIES = 2**22  # most vertices and faces from copies in a small file; they take 200 MB
KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = SURFACES = 4, 5, 6
LARGEST = sys.float_info.max
# Extensions that change the look of a surface but not its place, or that a reader may ignore.
HARMLESS = (
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
)


class Piece(NamedTuple):
    """Triangles, and where they stand in the file."""

    vertices: np.ndarray  # (n, 3)
    faces: np.ndarray  # (f, 3)
    rows: np.ndarray  # (n,) the row of each vertex in the accessors of its primitive
    primitives: np.ndarray  # (f,) the number of each face's primitive in its mesh


class Scene(NamedTuple):
    """The triangles of all nodes in world coordinates, and where they stand in the file."""

    piece: Piece
    nodes: np.ndarray  # (f,) the node of each face
    matrices: dict[int, np.ndarray]  # by node, from its coordinates to those of the world


@dataclass(frozen=True)
class Gltf:
    """The JSON tree and buffers of a file, and a limit for its vertices and faces.

    There is a limit because a small file can place one mesh any number of times.
    """

    tree: dict[str, Any]
    buffers: Sequence[bytes]
    most: int

    def entry(self, kind: str, index: Any) -> dict[str, Any]:
        """Return one entry of a list in the tree."""
        entries = _list(self.tree, kind)
        known = type(index) is int and 0 <= index < len(entries)
        if not known or not isinstance(entries[index], dict):
            raise FileFormatError(
                f"A glTF file must hold what it names; it names {kind}[{ascii(index)[:60]}] and holds none."
            )
        return entries[index]

    def require_few(self, total: int) -> None:
        """Raise an error if there are more vertices and faces than the limit."""
        if total > self.most:
            raise FileFormatError(
                f"A glTF file must stay within {self.most} vertices and faces; its copies make more."
            )


def parse(data: bytes, folder: Path | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of the scene, from a .glb file or, if a folder is given, a .gltf file.

    The buffers of a .gltf file lie in its folder or in data URIs.
    """
    piece = read_scene(read_gltf(data, folder)).piece
    return piece.vertices, piece.faces


def read_gltf(data: bytes, folder: Path | None = None) -> Gltf:
    """Read the tree and the buffers of a file; see `parse`."""
    if folder is None:
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
        tree = _tree(chunks.get(JSON_CHUNK, b""))
        buffers = decode_buffers(tree, chunks.get(BINARY_CHUNK, b""))
    else:
        tree = _tree(data)
        buffers = decode_buffers(tree, b"", folder)
    return Gltf(tree, buffers, most=max(sum(map(len, buffers)), COPIES))


def read_scene(gltf: Gltf) -> Scene:
    """Read the triangles of the scene; there must be some."""
    scene = place_triangles(gltf)
    if not len(scene.piece.faces):
        raise FileFormatError("A glTF file must hold triangles; it holds none.")
    return scene


def _tree(text: bytes) -> dict[str, Any]:
    try:
        tree: Any = json.loads(text)
    except (ValueError, RecursionError) as err:
        raise FileFormatError(
            f"The first chunk of a GLB file, and a .gltf file, must be JSON; {err}."
        ) from err
    if not isinstance(tree, dict):
        raise FileFormatError(
            f"The JSON of a glTF file must be an object; it is a {type(tree).__name__}."
        )
    return tree


def pack(tree: dict[str, Any], binary: bytes) -> bytes:
    """Write a tree and its buffer as one binary file."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    body = _chunk(JSON_CHUNK, text + b" " * (-len(text) % 4))
    if binary:
        body += _chunk(BINARY_CHUNK, binary + b"\0" * (-len(binary) % 4))
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def _chunk(kind: bytes, content: bytes) -> bytes:
    return len(content).to_bytes(4, "little") + kind + content


def decode_buffers(tree: dict[str, Any], binary: bytes, folder: Path | None = None) -> list[bytes]:
    """Return the buffers: the binary chunk, data URIs and, if a folder is given, files in it.

    Raise FileFormatError if a buffer is outside the file or the folder; such a file is not opened.
    """
    return [
        _decode_buffer(index, entry, binary, folder)
        for index, entry in enumerate(_list(tree, "buffers"))
    ]


def _decode_buffer(index: int, entry: Any, binary: bytes, folder: Path | None) -> bytes:
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
    data = read_regular(file_beside(index, str(uri), folder), "numbers")
    if len(data) < size:
        raise FileFormatError(
            f"buffers[{index}] must have {size} bytes; the file {str(uri)[:80]!r} has {len(data)}."
        )
    return data[:size]


def file_beside(index: int, uri: str, folder: Path) -> Path:
    """Return the file of a relative URI; links resolved, it must be in or below the folder."""
    try:
        root = folder.resolve()
        path = (root / unquote(uri, errors="strict")).resolve()
    except (ValueError, OSError, RuntimeError):  # undecodable text, a zero byte, a loop of links
        path = root.parent
    if ":" in uri or not path.is_relative_to(root):
        raise FileFormatError(
            f"Buffers of a .gltf file must lie in its folder; buffers[{index}] points to {uri[:80]!r}."
        )
    return path


def place_triangles(gltf: Gltf) -> Scene:
    """Gather the triangles of all nodes, in world coordinates."""
    for name in _list(gltf.tree, "extensionsRequired"):
        if not str(name).startswith(HARMLESS):
            raise FileFormatError(
                f"A glTF file must be plain glTF 2.0; it requires the extension {str(name)[:60]!r}."
            )
    shapes: dict[int, Piece] = {}
    matrices: dict[int, np.ndarray] = {}
    meshes: dict[int, int] = {}  # by node
    total = 0
    for node, index, matrix in _placed_meshes(gltf):
        mesh = gltf.entry("meshes", index)
        if index not in shapes:
            shapes[index] = _mesh(gltf, mesh)
        total += len(shapes[index].vertices) + len(shapes[index].faces)
        gltf.require_few(total)  # before any copy is made
        matrices[node], meshes[node] = matrix, index
    placed = []
    for node, matrix in matrices.items():
        piece = shapes[meshes[node]]
        # A reflection turns triangles inside out; by the format they must be turned back.
        flips = np.linalg.slogdet(matrix[:3, :3])[0] < 0
        vertices = piece.vertices @ matrix[:3, :3].T + matrix[:3, 3]
        faces = piece.faces[:, ::-1] if flips else piece.faces
        placed.append(piece._replace(vertices=vertices, faces=faces))
    n_faces = [len(piece.faces) for piece in placed]
    nodes = np.repeat(np.array(list(matrices), dtype=np.int64), n_faces)
    return Scene(_merge_pieces(placed), nodes, matrices)


def _merge_pieces(pieces: Sequence[Piece]) -> Piece:
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    none = np.empty(0, dtype=np.int64)
    faces = [piece.faces + start for piece, start in zip(pieces, starts, strict=False)]
    return Piece(
        np.concatenate([np.empty((0, 3)), *(piece.vertices for piece in pieces)]),
        np.concatenate([NO_TRIANGLES, *faces]),
        np.concatenate([none, *(piece.rows for piece in pieces)]),
        np.concatenate([none, *(piece.primitives for piece in pieces)]),
    )


def _placed_meshes(gltf: Gltf) -> Iterator[tuple[int, Any, np.ndarray]]:
    waiting = [(index, np.eye(4)) for index in reversed(_roots(gltf))]
    seen = set()
    while waiting:
        index, above = waiting.pop()
        node = gltf.entry("nodes", index)
        if index in seen:
            raise FileFormatError(
                f"The nodes of a glTF file must form trees; node {index} is met twice."
            )
        seen.add(index)
        matrix = above @ _local_matrix(node)
        if "mesh" in node:
            yield index, node["mesh"], matrix
        waiting.extend((child, matrix) for child in reversed(_list(node, "children")))


def _roots(gltf: Gltf) -> list[Any]:
    if "scenes" in gltf.tree:
        return _list(gltf.entry("scenes", gltf.tree.get("scene", 0)), "nodes")
    everyone = range(len(_list(gltf.tree, "nodes")))
    children = [
        child for index in everyone for child in _list(gltf.entry("nodes", index), "children")
    ]
    below = {child for child in children if isinstance(child, int)}
    return [index for index in everyone if index not in below]


def _local_matrix(node: dict[str, Any]) -> np.ndarray:
    if "matrix" in node:
        return _numbers(node, "matrix", [0.0] * 16).reshape(4, 4).T  # stored by columns
    turn = _numbers(node, "rotation", [0.0, 0.0, 0.0, 1.0])
    if not turn.any():
        raise FileFormatError(
            "A rotation must be a quaternion other than zero; a node has [0, 0, 0, 0]."
        )
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(turn / np.abs(turn).max()).as_matrix() * _numbers(
        node, "scale", [1.0, 1.0, 1.0]
    )
    matrix[:3, 3] = _numbers(node, "translation", [0.0, 0.0, 0.0])
    return matrix


def _mesh(gltf: Gltf, mesh: dict[str, Any]) -> Piece:
    """Read one mesh; parts that differ only in material share their vertices, as in the file."""
    primitives = _list(mesh, "primitives")
    sharing: dict[int, list[int]] = {}  # by the accessor of positions
    for number, part in enumerate(primitives):
        if _whole(part, "mode", TRIANGLES) in SURFACES:
            sharing.setdefault(_whole(part.get("attributes"), "POSITION"), []).append(number)
    pieces = []
    total = 0
    for position, numbers in sharing.items():
        vertices = read_accessor(gltf, position, 3)
        total += len(vertices)
        faces = []
        for number in numbers:
            faces.append(_faces(gltf, primitives[number], len(vertices)))
            total += 1 + len(faces[-1])
            gltf.require_few(total)
        owners = np.repeat(numbers, [len(block) for block in faces])
        pieces.append(Piece(vertices, np.concatenate(faces), np.arange(len(vertices)), owners))
    return _merge_pieces(pieces)


def _faces(gltf: Gltf, part: dict[str, Any], n_vertices: int) -> np.ndarray:
    """Read the triangles of a primitive: a list, a strip or a fan."""
    corners = np.arange(n_vertices)
    if "indices" in part:
        indices = read_accessor(gltf, part["indices"], 1)[:, 0]
        is_known = (indices >= 0) & (indices < n_vertices) & (indices == np.floor(indices))
        bad = np.flatnonzero(~is_known)
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


def read_accessor(gltf: Gltf, index: Any, width: int) -> np.ndarray:
    """Read an accessor as float64, with as many numbers a row as `width`."""
    rows = raw_accessor(gltf, index, width)
    if gltf.entry("accessors", index).get("normalized") is True and rows.dtype.kind in "iu":
        return np.maximum(rows / np.iinfo(rows.dtype).max, -1.0)
    return rows.astype(np.float64)


def raw_accessor(gltf: Gltf, index: Any, wanted: int | None = None) -> np.ndarray:
    """Return the rows of an accessor as they are stored, without a copy; `wanted` numbers each."""
    accessor = gltf.entry("accessors", index)
    kind = np.dtype(KINDS.get(_whole(accessor, "componentType"), "V0"))
    width = WIDTHS.get(str(accessor.get("type")), 0)
    fits = width == wanted if wanted else width > 0
    if not kind.itemsize or not fits or "sparse" in accessor:
        raise FileFormatError(
            f"accessors[{index}] must be a plain list of {wanted or '1 to 4'} numbers each; it is not."
        )
    data, step = view_of(gltf, accessor.get("bufferView"))
    row = kind.itemsize * width
    count, start = _whole(accessor, "count"), _whole(accessor, "byteOffset", 0)
    step = step if step and count > 1 else row  # fewer than two rows have no step
    if step < row or start + (count - 1) * step + row > len(data):
        raise FileFormatError(
            f"accessors[{index}] must lie in its buffer; {count} rows do not fit {len(data)} bytes."
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


def _numbers(entry: dict[str, Any], key: str, default: list[float]) -> np.ndarray:
    value = entry.get(key, default)
    known = isinstance(value, list) and len(value) == len(default)
    if not known or not all(type(part) in (int, float) and abs(part) <= LARGEST for part in value):
        raise FileFormatError(
            f"{key} of a node must be {len(default)} finite numbers; it is {str(value)[:60]!r}."
        )
    return np.array(value, dtype=np.float64)
