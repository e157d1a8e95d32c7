"""VTP files: PolyData of VTK in XML, and functions on them.

Read: polygons, strips, lines and vertices; text, binary, zlib, LZMA and LZ4; several pieces.
Kept: functions on points and cells.
Named: arrays of text, or not in all pieces.
Refused: a polygon that crosses itself; more than a file can hold.
"""

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.vtk_cells import Arrays
from eigenshape.io.formats.vtk_xml import format_piece, parse, parse_fields

__all__ = ["format_fields", "parse", "parse_fields"]


def format_fields(mesh: TriangleMesh, of_vertices: Arrays, of_faces: Arrays) -> bytes:
    """Write a mesh and functions on its vertices and faces."""
    return format_piece("PolyData", "Polys", mesh, of_vertices, of_faces)
