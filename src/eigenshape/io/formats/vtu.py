"""VTU files: unstructured grids of VTK in XML, and functions on them.

Read: cells of all kinds but polyhedra, by their corners; text, binary, zlib, LZMA and LZ4;
    several pieces.
Kept: functions on points and cells.
Named: cells that were cut or read by their corners; arrays of text, or not in all pieces.
Refused: polyhedra; more than a file can hold.
"""

import numpy as np

from eigenshape.geometry.simplicial import Mesh
from eigenshape.io.formats.vtk_cells import SIMPLEX_TYPES, Arrays
from eigenshape.io.formats.vtk_xml import array_tag, format_piece, parse, parse_fields

__all__ = ["format_fields", "parse", "parse_fields"]


def format_fields(mesh: Mesh, of_vertices: Arrays, of_faces: Arrays) -> bytes:
    """Write a mesh and functions on its vertices and cells."""
    n_cells, n_corners = mesh.simplices.shape
    types = array_tag("types", np.full(n_cells, SIMPLEX_TYPES[n_corners], np.uint8))
    return format_piece("UnstructuredGrid", "Cells", mesh, of_vertices, of_faces, types)
