"""Stereolithography: triangles without shared corners, text or binary, in single precision where binary."""

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import weld
from eigenshape.io.text import coordinates, lines_of

HEADER = 84
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read triangles; corners with the same coordinates become one vertex, since the format cannot share them."""
    corners = _parse_text(data) if _is_text(data) else _parse_binary(data)
    if not len(corners):
        raise FileFormatError("An STL file must hold triangles; it holds none.")
    soup = TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
    welded = weld(soup).mesh
    return welded.vertices, welded.faces


def _is_text(data: bytes) -> bool:
    if len(data) >= HEADER and len(data) == HEADER + RECORD.itemsize * _declared(data):
        return False
    return data.lstrip()[:5].lower() == b"solid" and b"\0" not in data[:HEADER]


def _declared(data: bytes) -> int:
    return int.from_bytes(data[80:HEADER], "little")


def _parse_binary(data: bytes) -> np.ndarray:
    if len(data) < HEADER:
        raise FileFormatError(f"A binary STL file must have {HEADER} bytes of header; it has {len(data)} in all.")
    expected = HEADER + RECORD.itemsize * _declared(data)
    if len(data) != expected:
        raise FileFormatError(
            f"A binary STL file must hold the triangles it declares; {_declared(data)} take {expected} bytes and it "
            f"has {len(data)}."
        )
    return np.frombuffer(data, dtype=RECORD, offset=HEADER)["corners"].reshape(-1, 3).astype(np.float64)


def _parse_text(data: bytes) -> np.ndarray:
    lines = lines_of(data, comment="")
    words = [line.words[0].lower() for line in lines]
    counts = {word: words.count(word) for word in ("facet", "endfacet", "vertex", "solid", "endsolid")}
    whole_facets = counts["facet"] == counts["endfacet"] and counts["vertex"] == 3 * counts["facet"]
    if not whole_facets or counts["solid"] != counts["endsolid"]:
        told = ", ".join(f"{count} {word}" for word, count in counts.items())
        raise FileFormatError(f"A text STL file must close each facet of three vertices and each solid; it has {told}.")
    return coordinates([line for line, word in zip(lines, words, strict=True) if word == "vertex"], skip=1)


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write binary STL in single precision.

    Raises
    ------
    FileFormatError
        If a coordinate is too large for single precision.
    """
    records = np.zeros(mesh.n_faces, dtype=RECORD)
    records["corners"] = single_precision(mesh, "STL")[mesh.faces]
    edges = np.diff(mesh.vertices[mesh.faces] / np.abs(mesh.vertices).max(initial=1e-300), axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    records["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    return b"\0" * 80 + mesh.n_faces.to_bytes(4, "little") + records.tobytes()


def single_precision(mesh: TriangleMesh, name: str) -> np.ndarray:
    """Return vertices as float32, refusing what does not fit."""
    largest = np.abs(mesh.vertices).max(axis=1)
    bad = np.flatnonzero(largest > np.finfo(np.float32).max)
    if bad.size:
        raise FileFormatError(
            f"{name} holds single precision, up to 3.4e38; vertex {bad[0]} is {mesh.vertices[bad[0]].tolist()}."
        )
    return mesh.vertices.astype(np.float32)
