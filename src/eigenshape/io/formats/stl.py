"""Stereolithography: triangles without shared corners, as text or in binary single precision.

Read: text and binary; corners at one place become one vertex.
Kept: nothing besides positions and faces.
Named: what rounding to single precision takes.
Refused: a count that the file does not hold; shapes that single precision changes by more than 1
    %.
"""

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape._vectors import unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import weld
from eigenshape.io.formats.numbers import coordinates, end_lines, lines_of, quote_line

HEADER = 84  # bytes before the triangles of a binary file: 80 of text, 4 of their number
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
FACET = (b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet")


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read triangles; corners with the same coordinates become one vertex, since the format cannot share them."""
    n_declared = int.from_bytes(data[80:HEADER], "little")
    expected = HEADER + RECORD.itemsize * n_declared
    is_text = data.lstrip()[:5].lower() == b"solid" and b"\0" not in data[:HEADER]
    # Many binary files also begin with "solid".
    if is_text and (len(data) < HEADER or len(data) != expected):
        lines = lines_of(data)
        words = [text.split(None, 1)[0].lower() for _, text in lines]
        n_open, n_closed = words.count(b"solid"), words.count(b"endsolid")
        if n_open != n_closed:
            raise FileFormatError(
                f"A text STL file must close what it opens; it has {n_open} solid, {n_closed} endsolid."
            )
        facets = [
            pair
            for pair in zip(lines, words, strict=True)
            if pair[1] not in (b"solid", b"endsolid")
        ]
        for place, (line, word) in enumerate(facets):
            if word != FACET[place % len(FACET)]:
                raise FileFormatError(
                    f"A facet must be lines of {b' '.join(FACET).decode()}; line {line[0]} is {quote_line(line)}."
                )
        if len(facets) % len(FACET):
            raise FileFormatError(
                f"A text STL file must end with a whole facet; its last line is {quote_line(facets[-1][0])}."
            )
        corners = coordinates(
            [(line[0], line[1][len(word) :]) for line, word in facets if word == b"vertex"]
        )
    elif len(data) < HEADER:
        raise FileFormatError(
            f"A binary STL file must have {HEADER} bytes of header; it has {len(data)} in all."
        )
    elif len(data) != expected:
        raise FileFormatError(
            f"A binary STL file must hold the triangles it declares; "
            f"{n_declared} take {expected} bytes and it has {len(data)}."
        )
    else:
        rows = np.frombuffer(data, dtype=RECORD, offset=HEADER)
        corners = rows["corners"].reshape(-1, 3).astype(np.float64)
    if not len(corners):
        raise FileFormatError("An STL file must hold triangles; it holds none.")
    welded = weld(TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))).mesh
    return welded.vertices, welded.faces


def format_text(mesh: TriangleMesh) -> bytes:
    """Write text STL in full precision."""
    lines = ["solid mesh"]
    for normal, corners in zip(
        _normals(mesh).tolist(), mesh.vertices[mesh.faces].tolist(), strict=True
    ):
        rows = "\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in corners)
        lines.append(
            f"facet normal {' '.join(map(repr, normal))}\nouter loop\n{rows}\nendloop\nendfacet"
        )
    return end_lines([*lines, "endsolid mesh"])


def format_binary(mesh: TriangleMesh) -> bytes:
    """Write binary STL in single precision.

    Raise FileFormatError if a coordinate does not fit into single precision.
    """
    records = np.zeros(mesh.n_faces, dtype=RECORD)
    records["corners"] = single_precision(mesh, "Binary STL")[mesh.faces]
    records["normal"] = _normals(mesh)
    return b"\0" * 80 + mesh.n_faces.to_bytes(4, "little") + records.tobytes()


def _normals(mesh: TriangleMesh) -> np.ndarray:
    edges = np.diff(mesh.vertices[mesh.faces] / (np.abs(mesh.vertices).max() or 1.0), axis=1)
    return unit_vectors(np.cross(edges[:, 0], edges[:, 1]))


def single_precision(mesh: TriangleMesh, name: str) -> np.ndarray:
    """Return vertices as float32; raise an error if one does not fit."""
    single = np.finfo(np.float32)
    largest = np.abs(mesh.vertices).max(axis=1)
    bad = int(np.argmax(largest))
    if largest[bad] > single.max:
        raise FileFormatError(
            f"{name} holds single precision, up to 3.4e38; vertex {bad} is {mesh.vertices[bad].tolist()}."
        )
    if 0 < largest[bad] < single.tiny:
        raise FileFormatError(
            f"{name} holds single precision, down to 1.2e-38; no coordinate is larger than {largest[bad]}."
        )
    return mesh.vertices.astype(np.float32)
