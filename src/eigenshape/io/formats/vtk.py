"""Legacy VTK files, text or binary: POLYDATA and UNSTRUCTURED_GRID, and functions on them."""

import re

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import (
    FOUR_CORNERED,
    NO_TRIANGLES,
    SEGMENTS,
    CellLists,
    Cells,
    cells_of_types,
    strip_triangles,
)
from eigenshape.io.formats.numbers import Cursor, quote_line

KINDS = {
    b"float": ">f4", b"double": ">f8", b"char": ">i1", b"unsigned_char": ">u1", b"int": ">i4",
    b"vtktypeint64": ">i8", b"vtktypeint32": ">i4", b"long": ">i8",
    b"vtkidtype": ">i4",  # which VTK writes as an int, whatever its size in memory
}  # fmt: skip
# Fewest points of a cell of each section.
SECTIONS = {b"VERTICES": 1, b"LINES": 2, b"POLYGONS": 3, b"TRIANGLE_STRIPS": 3, b"CELLS": 1}
DATA_SECTIONS = (b"POINT_DATA", b"CELL_DATA")
WIDTHS = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}  # numbers a row
DATASETS = (b"POLYDATA", b"UNSTRUCTURED_GRID")
LEGACY_TYPES = {
    "f8": "double", "f4": "float", "i8": "vtktypeint64", "i4": "int", "u1": "unsigned_char",
}  # fmt: skip
Arrays = dict[str, np.ndarray]


def _open(data: bytes) -> Cursor:
    """Return a cursor behind the version, the title, which may be blank, and the encoding."""
    head = data.split(b"\n", 3)[:3]
    is_text = head[-1].strip().upper() != b"BINARY"
    return Cursor(data, "A VTK file", is_text=is_text, place=sum(len(line) + 1 for line in head))


def _kind_of(word: bytes) -> str:
    """Return the numpy type of numbers that a file names."""
    kind = KINDS.get(word.lower())
    if kind is None:
        raise FileFormatError(
            f"Numbers of a VTK file must be {b', '.join(KINDS).decode()}; they are {word.lower()!r}."
        )
    return kind


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Cells]:
    """Return points and cells by kind.

    Raise FileFormatError if the content differs from the header.
    """
    cursor = _open(data)
    dataset = cursor.line().split()
    if dataset[:1] != [b"DATASET"] or dataset[-1].upper() not in DATASETS:
        raise FileFormatError(
            f"A VTK file must hold the DATASET UNSTRUCTURED_GRID or POLYDATA; its line is "
            f"{quote_line((0, b' '.join(dataset)))}."
        )
    points, types, lists = _sections(cursor)
    if dataset[-1].upper() == b"POLYDATA":
        return points, _polydata_cells(lists)
    if types is None or b"CELLS" not in lists:
        raise FileFormatError(
            "An unstructured grid of a VTK file must have CELLS and CELL_TYPES; one is missing."
        )
    n_cells = len(lists[b"CELLS"].lengths)
    if len(types) != n_cells:
        raise FileFormatError(
            f"Each cell of a VTK file must have a type; it has {n_cells} cells, {len(types)} types."
        )
    return points, cells_of_types(lists[b"CELLS"], types)


def _sections(cursor: Cursor) -> tuple[np.ndarray, np.ndarray | None, dict[bytes, CellLists]]:
    """Read points, types of cells, and lists of cells by the name of their section."""
    points, types = None, None
    lists: dict[bytes, CellLists] = {}
    seen: set[bytes] = set()
    start = cursor.place
    while text := cursor.line():
        words = text.split()
        name = words[0].upper()
        if name in DATA_SECTIONS:
            cursor.place = start
            break
        n_words = {b"CELL_TYPES": 2}.get(name, 3)
        if len(words) != n_words or name not in (b"POINTS", b"CELL_TYPES", *SECTIONS):
            start = cursor.place
            continue
        if name in seen:
            raise FileFormatError(f"A VTK file must have one section {name.decode()}; it has two.")
        seen.add(name)
        count = _count(words[1])
        if name == b"POINTS":
            numbers = cursor.take(_kind_of(words[2]), 3 * count)
            points = numbers.reshape(-1, 3).astype(np.float64)
        elif name == b"CELL_TYPES":
            types = cursor.wholes(">i4", count)
        else:
            lists[name] = _cells(cursor, name, count, _count(words[2]))
        start = cursor.place
    if points is None:
        raise FileFormatError("A VTK file must have a section POINTS; it has none.")
    return points, types, lists


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the functions on points and those on cells, by name; see `parse`.

    Raise FileFormatError if the content differs from the header.
    """
    cursor = _open(data)
    cursor.line()
    _sections(cursor)
    fields: dict[bytes, dict[str, np.ndarray]] = {name: {} for name in DATA_SECTIONS}
    section, count = DATA_SECTIONS[0], 0
    n_arrays = 0  # that the current FIELD still holds
    while text := cursor.line():
        words = text.split()
        keyword = words[0].upper()
        if n_arrays and len(words) == 4 and words[1].isdigit():
            width, rows, kind = int(words[1]), _count(words[2]), words[3]
            name = words[0]
            n_arrays -= 1
        elif keyword in DATA_SECTIONS and len(words) == 2:
            section, count = keyword, _count(words[1])
            continue
        elif keyword == b"FIELD" and len(words) == 3:
            n_arrays = _count(words[2])
            continue
        elif keyword == b"SCALARS" and len(words) >= 3:
            name, kind, rows = words[1], words[2], count
            width = _count(words[3]) if len(words) > 3 else 1
            cursor.line()  # LOOKUP_TABLE
        elif keyword in WIDTHS and len(words) == 3:
            name, kind, rows, width = words[1], words[2], count, WIDTHS[keyword]
        else:
            continue
        values = cursor.take(_kind_of(kind), rows * width)
        values = values.astype(values.dtype.newbyteorder("="))
        held = fields[section]
        held[name.decode("latin-1")] = values if width == 1 else values.reshape(-1, width)
    of_points, of_cells = fields.values()
    return of_points, of_cells


def _polydata_cells(lists: dict[bytes, CellLists]) -> Cells:
    blocks: Cells = {}
    if b"LINES" in lists:
        blocks[SEGMENTS] = lists[b"LINES"].pairs(np.arange(len(lists[b"LINES"].lengths)))
    triangles = NO_TRIANGLES
    if b"TRIANGLE_STRIPS" in lists:
        triangles = strip_triangles(lists[b"TRIANGLE_STRIPS"].split())
    polygons = lists.get(b"POLYGONS")
    if polygons is not None and len(polygons.lengths):
        sizes = np.unique(polygons.lengths)
        everyone = np.arange(len(polygons.lengths))
        if sizes.tolist() == [4] and not len(triangles):
            return blocks | {FOUR_CORNERED: polygons.rows(everyone, 4)}
        blocks["polygons"] = polygons
    return blocks | {"triangles": triangles} if len(triangles) else blocks


def _count(word: bytes) -> int:
    try:
        return int(word)
    except ValueError as err:
        raise FileFormatError(
            f"A VTK file must count its cells by whole numbers; it says {word[:30]!r}."
        ) from err


def _cells(cursor: Cursor, name: bytes, count: int, size: int) -> CellLists:
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
        cells = CellLists(offsets, corners)
    else:
        cursor.place = start
        cells = _cells_by_counts(cursor.wholes(">i4", size), count)
    short = np.flatnonzero(cells.lengths < SECTIONS[name])
    if short.size:
        raise FileFormatError(
            f"A cell of {name.decode()} must have {SECTIONS[name]} points or more; cell {short[0]} has "
            f"{cells.lengths[short[0]]}."
        )
    return cells


def _cells_by_counts(flat: Int[np.ndarray, " k"], count: int) -> CellLists:
    size = len(flat)
    length = int(flat[0]) if size else 0
    if length > 0 and size == count * (1 + length) and (flat[:: 1 + length] == length).all():
        return CellLists(
            np.arange(0, count * length + 1, length), flat.reshape(count, -1)[:, 1:].ravel()
        )
    places = []  # where the counts are
    place = 0
    for index in range(count):
        if place >= size or not 0 <= flat[place] < size - place:
            raise FileFormatError(
                f"Cells of a VTK file must fill {size} numbers; cell {index} of {count} does not."
            )
        places.append(place)
        place += 1 + int(flat[place])
    if place != size:
        raise FileFormatError(
            f"Cells of a VTK file must fill {size} numbers; {count} cells fill {place}."
        )
    starts = np.cumsum([0, *flat[places]]) if places else np.zeros(1, dtype=np.int64)
    return CellLists(starts, np.delete(flat, places))


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
            word = re.sub(r"\s", "_", name)  # names in legacy files have no spaces
            width = values.shape[1] if values.ndim == 2 else 1
            kind = LEGACY_TYPES[values.dtype.str[1:]]
            pieces += [f"{word} {width} {count} {kind}\n".encode(), big_endian(values)]
    return b"".join(pieces)
