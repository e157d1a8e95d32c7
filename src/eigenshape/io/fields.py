"""Meshes with functions on vertices and faces: .vtu, .vtk and .npz. Only .vtu holds other cells than triangles."""

import base64
import re
import struct
from collections.abc import Mapping
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from eigenshape._arrays import freeze
from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape._files import as_path, read_regular, replace_file
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io.attributes import MeshAttributes, plain_attributes
from eigenshape.io.formats import npz, vtk, vtu
from eigenshape.io.parsing import naming, suffix_of

FIELD_FORMATS = (".vtu", ".vtk", ".npz")
CELL_TYPES = {2: 3, 3: 5, 4: 10}  # VTK's number of the type of cell, by its number of corners
VERTEX_FIELD, FACE_FIELD = "vertex_", "face_"  # how names of arrays begin in .npz
# VTK's names of types of numbers in XML and in legacy files. Other types are stored as float64.
XML_TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}
LEGACY_TYPES = {
    "f8": "double",
    "f4": "float",
    "i8": "vtktypeint64",
    "i4": "int",
    "u1": "unsigned_char",
}
Fields = dict[str, np.ndarray]


def write_fields(mesh: MeshLike, path: str | Path, fields: Mapping[str, ArrayLike]) -> None:
    """Write a mesh with functions on its vertices and faces, for ParaView, PyVista or NumPy.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices and f faces. Tetrahedra and segments, which go to .vtu, count as faces.
    path : str or Path
        Must end in .vtu, .vtk or .npz.
    fields : mapping of str to array
        Functions by name, (n,) or (n, d) on vertices, (f,) or (f, d) on faces. If there are as many
        vertices as faces, they are on vertices.

    Raises
    ------
    FileFormatError
        If the suffix is another one, or another one than .vtu for tetrahedra or segments.
    InvalidParameterError
        If a field has another number of rows, or is not of numbers.
    OSError
        If the system cannot write the file.

    See Also
    --------
    read_fields

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.vtk")
    >>> es.io.write_fields(mesh, path, {"area": es.geometry.face_areas(mesh)})
    >>> es.io.read_fields(path)["area"].shape
    (80,)
    """
    mesh, path = as_simplicial(mesh), as_path(path)
    suffix = suffix_of(path, None, FIELD_FORMATS)
    replace_file(path, format_fields(mesh, suffix, fields))


def format_fields(mesh: Mesh, suffix: str, fields: Mapping[str, ArrayLike]) -> bytes:
    """Write a mesh and its fields; each has a row for every vertex, or for every face.

    Raises
    ------
    FileFormatError
        If the format holds triangles only, and the mesh has other cells.
    InvalidParameterError
        If a field has another number of rows, or is not of numbers.
    """
    of_vertices: Fields = {}
    of_faces: Fields = {}
    for name, values in fields.items():
        array = np.asarray(values)
        if array.dtype.kind not in "buif" or array.ndim not in (1, 2):
            raise InvalidParameterError(
                f"fields must be lists or tables of numbers; {name!r} is {array.dtype} of shape {array.shape}."
            )
        if len(array) not in (mesh.n_points, len(mesh.simplices)):
            raise InvalidParameterError(
                f"fields must have a row for each of {mesh.n_points} vertices or {len(mesh.simplices)} faces; "
                f"{name!r} has {len(array)}."
            )
        if array.dtype.str[1:] not in XML_TYPES:
            array = array.astype(np.int64 if array.dtype.kind in "bui" else np.float64)
        held = of_vertices if len(array) == mesh.n_points else of_faces
        held[name] = np.ascontiguousarray(array)
    if suffix == ".vtu":
        return _format_vtu(mesh, of_vertices, of_faces)
    if not isinstance(mesh, TriangleMesh):
        raise FileFormatError(
            f"Files in {suffix} hold triangles in R^3; the mesh is {mesh!r}. Write it to .vtu."
        )
    writers = {".vtk": _format_vtk, ".npz": _format_npz}
    return writers[suffix](mesh, of_vertices, of_faces)


def _format_npz(mesh: TriangleMesh, of_vertices: Fields, of_faces: Fields) -> bytes:
    file = BytesIO()
    named = {VERTEX_FIELD + name: values for name, values in of_vertices.items()}
    named |= {FACE_FIELD + name: values for name, values in of_faces.items()}
    np.savez(file, allow_pickle=False, vertices=mesh.vertices, faces=mesh.faces, **named)
    return file.getvalue()


def _format_vtu(mesh: Mesh, of_vertices: Fields, of_faces: Fields) -> bytes:
    def element(name: str, values: np.ndarray) -> str:
        data = values.astype(values.dtype.newbyteorder("<")).tobytes()
        text = base64.b64encode(struct.pack("<Q", len(data)) + data).decode()
        width = f'NumberOfComponents="{values.shape[1]}" ' if values.ndim == 2 else ""
        return (
            f'<DataArray type="{XML_TYPES[values.dtype.str[1:]]}" Name={quoteattr(name)} '
            f'{width}format="binary">{text}</DataArray>'
        )

    n_cells, n_corners = mesh.simplices.shape
    ends = n_corners * np.arange(1, n_cells + 1)
    types = np.full(n_cells, CELL_TYPES[n_corners], np.uint8)
    places = np.zeros((mesh.n_points, 3))  # VTK has no points in the plane
    places[:, : mesh.points.shape[1]] = mesh.points
    lines = [
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{mesh.n_points}" NumberOfCells="{n_cells}">',
        "<PointData>", *(element(name, values) for name, values in of_vertices.items()), "</PointData>",
        "<CellData>", *(element(name, values) for name, values in of_faces.items()), "</CellData>",
        "<Points>", element("Points", places), "</Points>",
        "<Cells>", element("connectivity", mesh.simplices.ravel()), element("offsets", ends),
        element("types", types), "</Cells>", "</Piece>", "</UnstructuredGrid>", "</VTKFile>", "",
    ]  # fmt: skip
    return "\n".join(lines).encode()


def _format_vtk(mesh: TriangleMesh, of_vertices: Fields, of_faces: Fields) -> bytes:
    def big_endian(values: np.ndarray) -> bytes:
        return values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n"

    cells = np.column_stack([np.full(mesh.n_faces, 3), mesh.faces]).astype(np.int32)
    pieces = [
        b"# vtk DataFile Version 3.0\neigenshape\nBINARY\nDATASET POLYDATA\n",
        f"POINTS {mesh.n_vertices} double\n".encode(), big_endian(mesh.vertices),
        f"POLYGONS {mesh.n_faces} {cells.size}\n".encode(), big_endian(cells),
    ]  # fmt: skip
    for section, count, fields in (
        ("POINT_DATA", mesh.n_vertices, of_vertices),
        ("CELL_DATA", mesh.n_faces, of_faces),
    ):
        if not fields:
            continue
        pieces.append(f"{section} {count}\nFIELD FieldData {len(fields)}\n".encode())
        for name, values in fields.items():
            word = re.sub(r"\s", "_", name)  # names in legacy files have no spaces
            width = values.shape[1] if values.ndim == 2 else 1
            kind = LEGACY_TYPES[values.dtype.str[1:]]
            pieces += [f"{word} {width} {count} {kind}\n".encode(), big_endian(values)]
    return b"".join(pieces)


def read_fields(path: str | Path) -> Fields:
    """Read the functions on vertices and faces that a file holds beside its mesh.

    Parameters
    ----------
    path : str or Path
        A file in .vtu, .vtk or .npz, such as `write_fields` writes.

    Returns
    -------
    dict of str to array
        By name; each has a row for every vertex or for every face. If a function on faces has the
        name of one on vertices, it comes under ``face_`` and its name.

    Raises
    ------
    FileFormatError
        If the format holds no fields, or the content differs from what the file declares.
    OSError
        If the system cannot open the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.vtu")
    >>> es.io.write_fields(mesh, path, {"height": mesh.vertices[:, 2]})
    >>> es.io.read_fields(path)["height"].shape
    (42,)
    """
    path = as_path(path)
    suffix = suffix_of(path, None, FIELD_FORMATS)
    data = read_regular(path)
    with naming(path):
        return _parse_fields(data, suffix)


def _parse_fields(data: bytes, suffix: str) -> Fields:
    if suffix == ".npz":
        arrays = npz.read_arrays(data)
        tables = [
            {
                name.removeprefix(begin): array
                for name, array in arrays.items()
                if name.startswith(begin)
            }
            for begin in (VERTEX_FIELD, FACE_FIELD)
        ]
    else:
        parse = vtu.parse_fields if suffix == ".vtu" else vtk.parse_fields
        tables = [*parse(data)]
    of_vertices, of_faces = tables
    found = dict(of_vertices)
    for name, values in of_faces.items():
        found[FACE_FIELD + name if name in found else name] = values
    return {name: freeze(values) for name, values in found.items()}


def read_field_attributes(data: bytes, suffix: str, mesh: TriangleMesh) -> MeshAttributes:
    """Return the fields of a file as attributes; those of cells that are no triangles are named."""
    fields = _parse_fields(data, suffix)
    fitting = {
        name: values
        for name, values in fields.items()
        if len(values) in (mesh.n_vertices, mesh.n_faces)
    }
    others = tuple(f"the field {name!r}" for name in fields if name not in fitting)
    return replace(plain_attributes(mesh), fields=fitting, others=others)
