"""One tetrahedron in every format, and a way to read bytes."""

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io import glb, obj, off, ply, stl

VERTICES = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
TETRAHEDRON = TriangleMesh(VERTICES, FACES)

BIG_ENDIAN = ply.format_binary(TETRAHEDRON).replace(b"little", b"big")
BIG_ENDIAN = BIG_ENDIAN[: BIG_ENDIAN.index(b"end_header\n") + 11]
BIG_ENDIAN += TETRAHEDRON.vertices.astype(">f8").tobytes()
BIG_ENDIAN += b"".join(b"\x03" + row.astype(">i4").tobytes() for row in TETRAHEDRON.faces)

FILES = {
    "off": (off.parse, off.format_mesh(TETRAHEDRON)),
    "obj": (obj.parse, obj.format_mesh(TETRAHEDRON)),
    "ply text": (ply.parse, ply.format_text(TETRAHEDRON)),
    "ply little": (ply.parse, ply.format_binary(TETRAHEDRON)),
    "ply big": (ply.parse, BIG_ENDIAN),
    "stl text": (stl.parse, stl.format_text(TETRAHEDRON)),
    "stl binary": (stl.parse, stl.format_binary(TETRAHEDRON)),
    "glb": (glb.parse, glb.format_mesh(TETRAHEDRON)),
}


def read(parse, data):
    """Read bytes as a file would be read."""
    return TriangleMesh(*parse(data))
