"""Binary glTF: all triangles of all nodes, each moved to its place; single precision by the format."""

import io
import json
from typing import Any

import numpy as np
import trimesh

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.stl import single_precision

HEADER = 12
CHUNK = 8


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of the whole scene; anything outside the file is refused, never opened."""
    _refuse_outside(_json_chunk(data))
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False)
        pieces = [piece for piece in scene.dump() if isinstance(piece, trimesh.Trimesh) and len(piece.faces)]
    except Exception as err:  # the library raises whatever it meets
        raise FileFormatError(f"A GLB file must be readable as glTF 2.0; {type(err).__name__}: {err}.") from err
    if not pieces:
        raise FileFormatError("A GLB file must hold triangles; it holds none.")
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])[:-1]
    faces = [piece.faces + start for piece, start in zip(pieces, starts, strict=True)]
    return np.concatenate([piece.vertices for piece in pieces]), np.concatenate(faces)


def _json_chunk(data: bytes) -> dict[str, Any]:
    if data[:4] != b"glTF" or len(data) < HEADER + CHUNK:
        raise FileFormatError(f"A GLB file must begin with glTF and a header; it begins with {data[:4]!r}.")
    version, length, n_json = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8, 12))
    if version != 2 or length != len(data):
        raise FileFormatError(
            f"A GLB file must be of version 2 and as long as it says; it is of version {version}, says {length} bytes "
            f"and has {len(data)}."
        )
    try:
        tree: Any = json.loads(data[HEADER + CHUNK : HEADER + CHUNK + n_json])
    except ValueError as err:
        raise FileFormatError(f"The first chunk of a GLB file must be JSON; {err}.") from err
    if not isinstance(tree, dict):
        raise FileFormatError(f"The first chunk of a GLB file must be a JSON object; it is a {type(tree).__name__}.")
    return tree


def _refuse_outside(tree: dict[str, Any]) -> None:
    for kind in ("buffers", "images"):
        for index, entry in enumerate(tree.get(kind) or []):
            uri = entry.get("uri", "data:") if isinstance(entry, dict) else "data:"
            if not str(uri).startswith("data:"):
                raise FileFormatError(
                    f"A GLB file must hold all its data; {kind}[{index}] points outside, to {str(uri)[:80]!r}."
                )


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write binary glTF in single precision."""
    shape = trimesh.Trimesh(single_precision(mesh, "GLB"), mesh.faces, process=False)
    return bytes(trimesh.exchange.gltf.export_glb(trimesh.Scene(shape)))
