"""One tetrahedron in every format, and a way to read bytes."""

from pathlib import Path

import numpy as np

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.formats import gltf, gltf_attributes, obj, obj_attributes, off, ply, stl, vtp
from eigenshape.io.formats.cells import select_cells

VERTICES = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
TETRAHEDRON = TriangleMesh(VERTICES, FACES)
PLAIN = MeshAttributes.plain(TETRAHEDRON)

BIG_ENDIAN = ply.format_binary(TETRAHEDRON).replace(b"little", b"big")
BIG_ENDIAN = BIG_ENDIAN[: BIG_ENDIAN.index(b"end_header\n") + 11]
BIG_ENDIAN += TETRAHEDRON.vertices.astype(">f8").tobytes()
BIG_ENDIAN += b"".join(b"\x03" + row.astype(">i4").tobytes() for row in TETRAHEDRON.faces)

OFF_NUMBERS = [
    3,
    0,
    2,
    1,
    0,
    3,
    0,
    1,
    3,
    0,
    3,
    1,
    2,
    3,
    0,
    3,
    0,
    3,
    2,
    0,
]  # a count of colors after each face
OFF_BINARY = (
    b"OFF BINARY\n" + np.array([4, 4, 6], ">i4").tobytes() + np.array(VERTICES, ">f4").tobytes()
)
OFF_BINARY += np.array(OFF_NUMBERS, ">i4").tobytes()
STRIP = ply.format_text(TETRAHEDRON).replace(b"element face 4", b"element tristrips 1")
STRIP = STRIP[: STRIP.index(b"3 0 2 1")] + b"6 0 2 1 3 0 2\n"


def parse_vtp(data):
    """Read points and triangles."""
    points, cells, *_ = vtp.parse(data)
    return points, select_cells(points, cells, None)


FILES = {
    "off": (off.parse, off.format_text(TETRAHEDRON)),
    "off binary": (off.parse, OFF_BINARY),
    "off broken": (
        off.parse,
        off.format_text(TETRAHEDRON)
        .replace(b" 2 1\n3", b"\n2 1 3")
        .replace(b"0.0 1.0", b"0.0\n1.0"),
    ),
    "obj": (obj.parse, obj_attributes.write_new(PLAIN, TETRAHEDRON, Path("a.obj"))[Path("a.obj")]),
    "ply text": (ply.parse, ply.format_text(TETRAHEDRON)),
    "ply little": (ply.parse, ply.format_binary(TETRAHEDRON)),
    "ply big": (ply.parse, BIG_ENDIAN),
    "ply strip": (ply.parse, STRIP),
    "stl text": (stl.parse, stl.format_text(TETRAHEDRON)),
    "stl binary": (stl.parse, stl.format_binary(TETRAHEDRON)),
    "vtp": (parse_vtp, vtp.format_fields(TETRAHEDRON, {}, {})),
    "glb": (gltf.parse, gltf_attributes.write_new(PLAIN, TETRAHEDRON)),
}


def read(parse, data):
    """Read bytes as a file would be read."""
    return TriangleMesh(*parse(data)[:2])  # what follows are notes
