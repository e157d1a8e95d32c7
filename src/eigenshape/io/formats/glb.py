"""glTF, as one binary file or with separate buffers: the triangles of all nodes, transformed."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.gltf import Gltf, Scene, decode_buffers, place_triangles
from eigenshape.io.formats.text import quote_line

JSON_CHUNK = b"JSON"
BINARY_CHUNK = b"BIN\0"
COPIES = 2**22  # most vertices and faces from copies in a small file; they take 200 MB


def parse(data: bytes, folder: Path | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of the scene, from a .glb file or, if a folder is given, a .gltf file.

    The buffers of a .gltf file lie in its folder or in data URIs.
    """
    piece = read_scene(read_gltf(data, folder)).piece
    return piece.vertices, piece.faces


def read_gltf(data: bytes, folder: Path | None = None) -> Gltf:
    """Read the tree and the buffers of a file; see `parse`."""
    if folder is None:
        chunks = _chunks(data)
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


def pack(tree: dict[str, Any], binary: bytes) -> bytes:
    """Write a tree and its buffer as one binary file."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    body = _chunk(JSON_CHUNK, text + b" " * (-len(text) % 4))
    if binary:
        body += _chunk(BINARY_CHUNK, binary + b"\0" * (-len(binary) % 4))
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def _chunk(kind: bytes, content: bytes) -> bytes:
    return len(content).to_bytes(4, "little") + kind + content
