"""glTF, as one binary file or with separate buffers: the triangles of all nodes, transformed."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.gltf import Gltf, decode_buffers, place_triangles
from eigenshape.io.stl import single_precision
from eigenshape.io.text import quote_line

JSON_CHUNK = b"JSON"
BINARY_CHUNK = b"BIN\0"
COPIES = 2**22  # most vertices and faces from copies in a small file; they take 200 MB


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of the scene; a buffer outside the file raises an error."""
    chunks = _chunks(data)
    tree = _tree(chunks.get(JSON_CHUNK, b""))
    return _scene(tree, decode_buffers(tree, chunks.get(BINARY_CHUNK, b"")))


def parse_text(data: bytes, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of the scene of a .gltf file, whose buffers lie in this folder or in data URIs."""
    tree = _tree(data)
    return _scene(tree, decode_buffers(tree, b"", folder))


def _scene(tree: dict[str, Any], buffers: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = place_triangles(Gltf(tree, buffers, most=max(sum(map(len, buffers)), COPIES)))
    if not len(faces):
        raise FileFormatError("A glTF file must hold triangles; it holds none.")
    return vertices, faces


def _chunks(data: bytes) -> dict[bytes, bytes]:
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if data[:4] != b"glTF" or version != 2 or length != len(data):
        raise FileFormatError(
            f"A GLB file must begin with glTF, version 2 and its length; it begins with {quote_line((1, data[:4]))}, "
            f"{version} and {length}, and has {len(data)} bytes."
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


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write binary glTF in single precision.

    Raises
    ------
    FileFormatError
        If a coordinate does not fit into single precision.
    """
    vertices = single_precision(mesh, "GLB")
    positions, corners = vertices.astype("<f4").tobytes(), mesh.faces.astype("<u4").tobytes()
    box = {"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()}
    tree = {
        "asset": {"version": "2.0", "generator": "eigenshape"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": mesh.n_vertices,
                "type": "VEC3",
                **box,
            },
            {"bufferView": 1, "componentType": 5125, "count": 3 * mesh.n_faces, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions), "target": 34962},
            {
                "buffer": 0,
                "byteOffset": len(positions),
                "byteLength": len(corners),
                "target": 34963,
            },
        ],
        "buffers": [{"byteLength": len(positions) + len(corners)}],
    }
    text = json.dumps(tree, separators=(",", ":")).encode()
    body = _chunk(JSON_CHUNK, text + b" " * (-len(text) % 4)) + _chunk(
        BINARY_CHUNK, positions + corners
    )
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def _chunk(kind: bytes, content: bytes) -> bytes:
    return len(content).to_bytes(4, "little") + kind + content
