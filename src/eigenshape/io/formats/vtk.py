"""Legacy VTK files, text or binary: POLYDATA and UNSTRUCTURED_GRID, and functions on them."""

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import (
    FOUR_CORNERED,
    SEGMENTS,
    CellLists,
    cells_of_types,
    fans,
    strip_triangles,
)
from eigenshape.io.formats.cursor import Cursor
from eigenshape.io.formats.text import quote_line, wholes

KINDS = {
    b"float": ">f4", b"double": ">f8", b"char": ">i1", b"unsigned_char": ">u1", b"int": ">i4",
    b"vtktypeint64": ">i8", b"vtktypeint32": ">i4", b"long": ">i8",
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


class _File(Cursor):
    """A cursor that knows names of types of numbers, and skips blank lines."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data, "A VTK file")
        super().line()  # version
        super().line()  # title, which may be blank
        self.is_text = super().line().upper() != b"BINARY"

    def line(self) -> bytes:
        """Return the next line that is not blank, or an empty one at the end."""
        text = b""
        while not text and self.place < len(self.data):
            text = super().line()
        return text

    def numbers(self, count: int, kind: bytes) -> np.ndarray:
        """Return the next `count` numbers; raise an error if there are fewer."""
        if kind not in KINDS:
            raise FileFormatError(
                f"Numbers of a VTK file must be {b', '.join(KINDS).decode()}; they are {kind!r}."
            )
        return self.take(KINDS[kind], count)

    def wholes(self, count: int, kind: bytes) -> Int[np.ndarray, " k"]:
        """Return the next numbers, all of them whole."""
        return wholes(self.numbers(count, kind), "Cells of a VTK file")


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], dict[str, Int[np.ndarray, "_ _"]]]:
    """Return points and cells by kind.

    Raises
    ------
    FileFormatError
        If the content differs from the header.
    """
    cursor = _File(data)
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


def _sections(cursor: _File) -> tuple[np.ndarray, np.ndarray | None, dict[bytes, CellLists]]:
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
            numbers = cursor.numbers(3 * count, words[2].lower())
            points = numbers.reshape(-1, 3).astype(np.float64)
        elif name == b"CELL_TYPES":
            types = cursor.wholes(count, b"int")
        else:
            lists[name] = _cells(cursor, name, count, _count(words[2]))
        start = cursor.place
    if points is None:
        raise FileFormatError("A VTK file must have a section POINTS; it has none.")
    return points, types, lists


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the functions on points and those on cells, by name; see `parse`.

    Raises
    ------
    FileFormatError
        If the content differs from the header.
    """
    cursor = _File(data)
    cursor.line()
    _sections(cursor)
    fields: dict[bytes, dict[str, np.ndarray]] = {name: {} for name in DATA_SECTIONS}
    section, count = DATA_SECTIONS[0], 0
    n_arrays = 0  # that the current FIELD still holds
    while text := cursor.line():
        words = text.split()
        keyword = words[0].upper()
        if n_arrays and len(words) == 4 and words[1].isdigit():
            width, rows, kind = int(words[1]), _count(words[2]), words[3].lower()
            name = words[0]
            n_arrays -= 1
        elif keyword in DATA_SECTIONS and len(words) == 2:
            section, count = keyword, _count(words[1])
            continue
        elif keyword == b"FIELD" and len(words) == 3:
            n_arrays = _count(words[2])
            continue
        elif keyword == b"SCALARS" and len(words) >= 3:
            name, kind, rows = words[1], words[2].lower(), count
            width = _count(words[3]) if len(words) > 3 else 1
            cursor.line()  # LOOKUP_TABLE
        elif keyword in WIDTHS and len(words) == 3:
            name, kind, rows, width = words[1], words[2].lower(), count, WIDTHS[keyword]
        else:
            continue
        values = cursor.numbers(rows * width, kind)
        values = values.astype(values.dtype.newbyteorder("="))
        held = fields[section]
        held[name.decode("latin-1")] = values if width == 1 else values.reshape(-1, width)
    of_points, of_cells = fields.values()
    return of_points, of_cells


def _polydata_cells(lists: dict[bytes, CellLists]) -> dict[str, Int[np.ndarray, "_ _"]]:
    blocks = {}
    if b"LINES" in lists:
        blocks[SEGMENTS] = lists[b"LINES"].pairs(np.arange(len(lists[b"LINES"].lengths)))
    strips = lists.get(b"TRIANGLE_STRIPS")
    triangles = (
        strip_triangles(np.split(strips.corners, strips.starts[1:-1]))
        if strips
        else np.empty((0, 3), int)
    )
    polygons = lists.get(b"POLYGONS")
    if polygons is not None and len(polygons.lengths):
        lengths = polygons.lengths
        everyone = np.arange(len(lengths))
        if not len(triangles) and (lengths == 4).all():
            return blocks | {FOUR_CORNERED: polygons.rows(everyone, 4)}
        if (lengths == lengths[0]).all():
            fanned = fans(polygons.rows(everyone, int(lengths[0])))
        else:
            fanned = fans(
                [row.tolist() for row in np.split(polygons.corners, polygons.starts[1:-1])]
            )
        triangles = np.concatenate([triangles, fanned])
    return blocks | {"triangles": triangles} if len(triangles) else blocks


def _count(word: bytes) -> int:
    try:
        return int(word)
    except ValueError as err:
        raise FileFormatError(
            f"A VTK file must count its cells by whole numbers; it says {word[:30]!r}."
        ) from err


def _cells(cursor: _File, name: bytes, count: int, size: int) -> CellLists:
    """Read lists of points; version 5 has offsets and connectivity instead of counts per cell."""
    start = cursor.place
    words = cursor.line().split()
    if words and words[0].upper() == b"OFFSETS":
        cells = _cells_by_offsets(cursor, words, count, size)
    else:
        cursor.place = start
        cells = _cells_by_counts(cursor.wholes(size, b"int"), count)
    short = np.flatnonzero(cells.lengths < SECTIONS[name])
    if short.size:
        raise FileFormatError(
            f"A cell of {name.decode()} must have {SECTIONS[name]} points or more; cell {short[0]} has "
            f"{cells.lengths[short[0]]}."
        )
    return cells


def _cells_by_offsets(cursor: _File, words: Sequence[bytes], count: int, size: int) -> CellLists:
    offsets = cursor.wholes(count, _kind(words))
    corners = cursor.wholes(size, _kind(cursor.line().split()))
    if not count or offsets[0] != 0 or offsets[-1] != size or (np.diff(offsets) < 0).any():
        raise FileFormatError(
            f"Offsets of a VTK file must rise from 0 to {size}; they are {offsets[:9].tolist()}."
        )
    return CellLists(offsets, corners)


def _kind(words: Sequence[bytes]) -> bytes:
    return words[1].lower() if len(words) > 1 else b""


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
    at_counts = np.array(places, dtype=np.int64)
    starts = np.concatenate([[0], np.cumsum(flat[at_counts])])
    return CellLists(starts, np.delete(flat, at_counts))


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
