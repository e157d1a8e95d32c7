"""Legacy VTK files, text or binary: POLYDATA and UNSTRUCTURED_GRID, and functions on them.

Read: POLYDATA and UNSTRUCTURED_GRID, text and binary, cells of all kinds but polyhedra, by their
    corners.
Kept: functions on points and cells, of all types of numbers, masks and colors.
Named: cells that were cut or read by their corners; arrays of text; data of unknown kinds.
Refused: other data sets, with the call of PyVista that writes their surface; polyhedra.
"""

import re
import string
from typing import Any
from urllib.parse import quote, unquote_to_bytes

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import FOUR_CORNERED, CellLists, ParsedFields, ParsedShape
from eigenshape.io.formats.numbers import Cursor, quote_line
from eigenshape.io.formats.vtk_cells import (
    POLY_VERTEX,
    POLYGON,
    POLYLINE,
    STRIP,
    Arrays,
    VtkShape,
    fit_fields,
    other_dataset,
    sort_cells,
    surface_lists,
)

KINDS = {
    b"float": ">f4", b"double": ">f8", b"bit": ">u1", b"char": ">i1", b"signed_char": ">i1",
    b"unsigned_char": ">u1", b"short": ">i2", b"unsigned_short": ">u2", b"int": ">i4",
    b"unsigned_int": ">u4", b"long": ">i8", b"unsigned_long": ">u8",
    b"vtkidtype": ">i4",  # which VTK writes as an int, whatever its size in memory
    **{f"vtktype{kind}{8 * size}".encode(): f">{kind[0]}{size}"
       for kind in ("int", "uint") for size in (1, 2, 4, 8)},
}  # fmt: skip
TEXTS = (b"string", b"utf8_string", b"variant")
OF_SURFACES = {
    POLY_VERTEX: b"VERTICES", POLYLINE: b"LINES", POLYGON: b"POLYGONS", STRIP: b"TRIANGLE_STRIPS",
}  # fmt: skip
SECTIONS = (*OF_SURFACES.values(), b"CELLS")
DATA_SECTIONS = (b"POINT_DATA", b"CELL_DATA")
WIDTHS = {  # numbers a row
    b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9, b"TENSORS6": 6,
    b"GLOBAL_IDS": 1, b"PEDIGREE_IDS": 1, b"EDGE_FLAGS": 1,
}  # fmt: skip
DATASETS = (b"POLYDATA", b"UNSTRUCTURED_GRID")
LEGACY_TYPES = {
    "f8": "double", "f4": "float", "i8": "vtktypeint64", "i4": "int", "u1": "unsigned_char",
}  # fmt: skip
# Characters of names that VTK writes as they are, besides letters and digits
AS_THEY_ARE = "".join(set(string.punctuation) - set('"%'))
BLANK_LINE = re.compile(rb"\n[ \t\r]*\n")


def parse(data: bytes) -> ParsedShape:
    """Return points, cells by kind, and notes.

    Raise FileFormatError if the content differs from the header.
    """
    shape, _ = _read(data)
    return shape.points, shape.cells, *shape.notes


def _read(data: bytes) -> tuple[VtkShape, Cursor]:
    """Read the points and cells, and return a cursor before the functions on them."""
    # The version, the title, which may be blank, and the encoding
    head = data.split(b"\n", 3)[:3]
    is_text = head[-1].strip().upper() != b"BINARY"
    place = sum(len(line) + 1 for line in head)
    cursor = Cursor(data, "A VTK file", is_text=is_text, place=place)
    dataset = cursor.line().upper().removeprefix(b"DATASET").strip()
    if dataset not in DATASETS:
        raise other_dataset(dataset.decode("latin-1"))
    held = _sections(cursor)
    points = held.pop(b"POINTS")
    if dataset == b"POLYDATA":
        of_types = {kind: held[name] for kind, name in OF_SURFACES.items() if name in held}
        shape = sort_cells(points, *surface_lists(of_types))
        polygons = shape.cells.get("polygons")
        if polygons and "triangles" not in shape.cells and (polygons.lengths == 4).all():
            del shape.cells["polygons"]
            shape.cells[FOUR_CORNERED] = polygons.corners.reshape(-1, 4)
            shape.numbers[FOUR_CORNERED] = shape.numbers.pop("polygons")[::2]
        return shape, cursor
    if not held.keys() >= {b"CELLS", b"CELL_TYPES"}:
        raise FileFormatError(
            "An unstructured grid of a VTK file must have CELLS and CELL_TYPES; one is missing."
        )
    cells, types = held[b"CELLS"], held[b"CELL_TYPES"]
    n_cells = len(cells.lengths)
    if len(types) != n_cells:
        raise FileFormatError(
            f"Each cell of a VTK file must have a type; it has {n_cells} cells, {len(types)} types."
        )
    return sort_cells(points, cells, types), cursor


def _sections(cursor: Cursor) -> dict[bytes, Any]:
    """Read points, types of cells, and lists of cells by the name of their section."""
    held: dict[bytes, Any] = {}
    start = cursor.place
    while text := cursor.line():
        words = [*text.split(), b"", b""]
        name = words[0].upper()
        if name in DATA_SECTIONS:
            cursor.place = start
            break
        if name in held:
            raise FileFormatError(f"A VTK file must have one section {name.decode()}; it has two.")
        if name == b"FIELD":  # functions on nothing, such as the time
            _take_fields(cursor, _count(words[2]))
        elif name == b"POINTS":
            numbers = cursor.take(_kind_of(words[2]), 3 * _count(words[1]))
            held[name] = numbers.reshape(-1, 3).astype(np.float64)
        elif name == b"CELL_TYPES":
            held[name] = cursor.wholes(">i4", _count(words[1]))
        elif name in SECTIONS:
            held[name] = _cells(cursor, _count(words[1]), _count(words[2]))
        else:
            raise FileFormatError(
                f"Sections of a VTK file must be POINTS, {b', '.join(SECTIONS).decode()}, CELL_TYPES, "
                f"POINT_DATA or CELL_DATA; one begins with {quote_line((0, text))}."
            )
        _skip_metadata(cursor)
        start = cursor.place
    if b"POINTS" not in held:
        raise FileFormatError("A VTK file must have a section POINTS; it has none.")
    return held


def parse_fields(data: bytes) -> ParsedFields:
    """Return the functions on points and those on simplices, by name, and notes; see `parse`.

    Raise FileFormatError if the content differs from the header.
    """
    shape, cursor = _read(data)
    fields: dict[bytes, Arrays] = {name: {} for name in DATA_SECTIONS}
    notes: list[str] = []
    section, count = DATA_SECTIONS[0], 0
    while text := cursor.line():
        words = [*text.split(), b"", b"", b""]
        keyword, name = words[0].upper(), _decode(words[1])
        found: dict[str, np.ndarray | None] = {}
        if keyword in DATA_SECTIONS:
            section, count = keyword, _count(words[1])
        elif keyword == b"FIELD":
            found = _take_fields(cursor, _count(words[2]))
        elif keyword == b"SCALARS":
            cursor.line()  # LOOKUP_TABLE
            found[name] = _take_array(cursor, words[2], count, _count(words[3] or b"1"))
        elif keyword == b"COLOR_SCALARS":
            values = _take_array(cursor, b"unsigned_char", count, _count(words[2]))
            # In text they are shares of 255.
            found[name] = (
                np.rint(255 * np.asarray(values)).astype(np.uint8) if cursor.is_text else values
            )
        elif keyword == b"TEXTURE_COORDINATES":
            found[name] = _take_array(cursor, words[3], count, _count(words[2]))
        elif keyword in WIDTHS:
            found[name] = _take_array(cursor, words[2], count, WIDTHS[keyword])
        elif keyword == b"LOOKUP_TABLE":
            cursor.take(">u1", 4 * _count(words[2]))
        else:
            notes.append(
                f"what follows {quote_line((0, text))} is not read: no such data are known"
            )
            break
        for each, held in found.items():
            if held is None:
                notes.append(f"the array {each!r} of text is not read")
            else:
                fields[section][each] = held
    of_points, of_cells = fit_fields(shape, *fields.values())
    return of_points, of_cells, *notes


def _take_fields(cursor: Cursor, count: int) -> dict[str, np.ndarray | None]:
    """Read arrays by name, each after a line with its name, width, number of rows and kind."""
    found = {}
    for _ in range(count):
        line = cursor.line()
        *name, width, rows, kind = [b"", b"", b"", *line.split()]
        found[_decode(b" ".join(name).strip())] = _take_array(
            cursor, kind, _count(rows), _count(width)
        )
    return found


def _decode(name: bytes) -> str:
    """Return a name as it was before VTK replaced its spaces and other characters by percent codes."""
    return unquote_to_bytes(name).decode(errors="replace")


def _take_array(cursor: Cursor, kind: bytes, rows: int, width: int) -> np.ndarray | None:
    """Read an array; return None for one of text."""
    count = rows * width
    values = None
    if kind.lower() in TEXTS:
        _skip_texts(cursor, count, is_packed=not cursor.is_text and kind.lower() != b"variant")
    elif kind.lower() == b"bit" and not cursor.is_text:
        values = np.unpackbits(cursor.take(">u1", -(-count // 8)))[:count]
    else:
        values = cursor.take(_kind_of(kind), count)
    _skip_metadata(cursor)
    if values is None:
        return None
    values = values.astype(values.dtype.newbyteorder("="))
    return values if width == 1 else values.reshape(rows, width)


def _skip_texts(cursor: Cursor, count: int, *, is_packed: bool) -> None:
    """Pass over lines of text, or over texts after their lengths.

    The first two bits of a length in a binary file say how many bytes it takes: 8, 4, 2 or 1.
    """
    for _ in range(count):
        if is_packed:
            size = 8 >> (cursor.one(">u1") >> 6)
            cursor.place -= 1
            length = cursor.one(f">u{size}") & (2 ** (8 * size - 2) - 1)
            cursor.take(">u1", length)
        else:
            end = cursor.data.find(b"\n", cursor.place)
            if end < 0:
                raise cursor.too_many(count)
            cursor.place = end + 1


def _skip_metadata(cursor: Cursor) -> None:
    """Pass over names of components and the like, which end with a blank line."""
    start = cursor.place
    if cursor.line().upper() != b"METADATA":
        cursor.place = start
        return
    blank = BLANK_LINE.search(cursor.data, cursor.place - 1)
    cursor.place = blank.end() if blank else len(cursor.data)


def _kind_of(word: bytes) -> str:
    """Return the numpy type of numbers that a file names."""
    kind = KINDS.get(word.lower())
    if kind is None:
        raise FileFormatError(
            f"Numbers of a VTK file must be {b', '.join(KINDS).decode()}; they are {word.lower()!r}."
        )
    return kind


def _count(word: bytes) -> int:
    if not word.isdigit():
        raise FileFormatError(
            f"A VTK file must count what it holds by whole numbers; it says {word[:30]!r}."
        )
    return int(word)


def _cells(cursor: Cursor, count: int, size: int) -> CellLists:
    """Read lists of points; version 5 has offsets and connectivity instead of counts per cell."""
    start = cursor.place
    words = cursor.line().split()
    if words and words[0].upper() == b"OFFSETS":
        offsets = cursor.wholes(_kind_of(b" ".join(words[1:])), count)
        corners = cursor.wholes(_kind_of(b" ".join(cursor.line().split()[1:])), size)
        if not count or offsets[0] != 0 or offsets[-1] != size or (np.diff(offsets) < 0).any():
            raise FileFormatError(
                f"Offsets of a VTK file must rise from 0 to {size}; they are {offsets[:9].tolist()}."
            )
        return CellLists(offsets, corners)
    cursor.place = start
    flat = cursor.wholes(">i4", size)
    numbers = flat.tolist()
    places = []  # where the counts are
    place = 0
    while place < len(numbers) and numbers[place] >= 0:
        places.append(place)
        place += 1 + numbers[place]
    if place != len(numbers) or len(places) != count:
        raise FileFormatError(
            f"A VTK file must hold {count} cells in {len(numbers)} numbers; {len(places)} cells take "
            f"{place}."
        )
    starts = np.append(places, place) - np.arange(count + 1)
    return CellLists(starts.astype(np.int64), np.delete(flat, places))


def format_fields(mesh: TriangleMesh, of_vertices: Arrays, of_faces: Arrays) -> bytes:
    """Write a mesh and functions on its vertices and faces."""

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
            word = quote(name, safe=AS_THEY_ARE)
            width = values.shape[1] if values.ndim == 2 else 1
            kind = LEGACY_TYPES[values.dtype.str[1:]]
            pieces += [f"{word} {width} {count} {kind}\n".encode(), big_endian(values)]
    return b"".join(pieces)
