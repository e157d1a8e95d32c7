"""Legacy VTK files, text or binary: POLYDATA and UNSTRUCTURED_GRID, and functions on them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cell_kinds import CellKind
from eigenshape.io.formats.cells import SEGMENTS, four_cornered
from eigenshape.io.formats.text import fans, numbers_of, quote_line, strip_triangles, wholes
from eigenshape.io.formats.vtk_cells import CellLists, cells_of_types

KINDS = {
    b"float": ">f4", b"double": ">f8", b"char": ">i1", b"unsigned_char": ">u1", b"int": ">i4",
    b"vtktypeint64": ">i8", b"vtktypeint32": ">i4", b"long": ">i8",
}  # fmt: skip
# Fewest points of a cell of each section.
SECTIONS = {b"VERTICES": 1, b"LINES": 2, b"POLYGONS": 3, b"TRIANGLE_STRIPS": 3, b"CELLS": 1}
DATA_SECTIONS = (b"POINT_DATA", b"CELL_DATA")
WIDTHS = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}  # numbers a row
DATASETS = (b"POLYDATA", b"UNSTRUCTURED_GRID")


class _Cursor:
    """A position in the file, and the encoding of its numbers."""

    def __init__(self, data: bytes) -> None:
        self.data, self.place = data, 0
        self._raw_line()  # version
        self._raw_line()  # title, which may be blank
        self.binary = self._raw_line().upper() == b"BINARY"

    def _raw_line(self) -> bytes:
        end = self.data.find(b"\n", self.place)
        end = len(self.data) if end < 0 else end
        text, self.place = self.data[self.place : end].strip(), end + 1
        return text

    def line(self) -> bytes:
        """Return the next line that is not blank, or an empty one at the end."""
        while self.place < len(self.data):
            text = self._raw_line()
            if text:
                return text
        return b""

    def numbers(self, count: int, kind: bytes) -> np.ndarray:
        """Return the next `count` numbers; raise an error if there are fewer."""
        if kind not in KINDS:
            raise FileFormatError(
                f"Numbers of a VTK file must be {b', '.join(KINDS).decode()}; they are {kind!r}."
            )
        if not 0 <= count <= len(self.data):
            raise FileFormatError(
                f"A VTK file must hold what it declares; {count} numbers do not fit into it."
            )
        return (
            self._binary_numbers(count, KINDS[kind]) if self.binary else self._text_numbers(count)
        )

    def _binary_numbers(self, count: int, kind: str) -> np.ndarray:
        size = count * np.dtype(kind).itemsize
        if self.place + size > len(self.data):
            raise FileFormatError(
                f"A VTK file must hold what it declares; it ends within {count} numbers."
            )
        found = np.frombuffer(self.data, kind, count, self.place)
        self.place += size
        return found

    def _text_numbers(self, count: int) -> np.ndarray:
        words = self.data[self.place :].split(None, count)
        try:
            found = numbers_of(words[:count])
        except ValueError as err:
            raise FileFormatError(
                f"A VTK file must hold {count} numbers at byte {self.place}; it does not."
            ) from err
        if len(found) < count:
            raise FileFormatError(
                f"A VTK file must hold what it declares; it ends within {count} numbers."
            )
        if count and len(words) == count and not self.data[-1:].isspace():
            raise FileFormatError(
                "A VTK file must be whole; its last number has no line break after it."
            )
        self.place = len(self.data) - len(words[count]) if len(words) > count else len(self.data)
        return found

    def wholes(self, count: int, kind: bytes) -> Int[np.ndarray, " k"]:
        """Return the next numbers, all of them whole."""
        return wholes(self.numbers(count, kind), "Cells of a VTK file")


def parse(
    data: bytes, cells: CellKind | None = None
) -> tuple[Float[np.ndarray, "n 3"], dict[str, Int[np.ndarray, "_ _"]]]:
    """Return points and cells by kind.

    `cells` is the kind of polygons of four corners if the file does not determine it.

    Raises
    ------
    FileFormatError
        If the content differs from the header, or polygons could be quads or tetrahedra.
    """
    cursor = _Cursor(data)
    dataset = cursor.line().split()
    if dataset[:1] != [b"DATASET"] or dataset[-1].upper() not in DATASETS:
        raise FileFormatError(
            f"A VTK file must hold the DATASET UNSTRUCTURED_GRID or POLYDATA; its line is "
            f"{quote_line((0, b' '.join(dataset)))}."
        )
    points, types, lists = _sections(cursor)
    if dataset[-1].upper() == b"POLYDATA":
        return points, _polydata_cells(points, lists, cells)
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


def _sections(cursor: _Cursor) -> tuple[np.ndarray, np.ndarray | None, dict[bytes, CellLists]]:
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


def parse_fields(data: bytes) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the functions on points and those on cells, by name; see `parse`.

    Raises
    ------
    FileFormatError
        If the content differs from the header.
    """
    cursor = _Cursor(data)
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


def _polydata_cells(
    points: np.ndarray, lists: dict[bytes, CellLists], cells: CellKind | None
) -> dict[str, Int[np.ndarray, "_ _"]]:
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
            four = polygons.rows(everyone, 4)
            return blocks | {_four_cornered_kind(points, four, cells): four}
        if (lengths == lengths[0]).all():
            fanned = fans(polygons.rows(everyone, int(lengths[0])))
        else:
            fanned = fans(
                [row.tolist() for row in np.split(polygons.corners, polygons.starts[1:-1])]
            )
        triangles = np.concatenate([triangles, fanned])
    return blocks | {"triangles": triangles} if len(triangles) else blocks


def _four_cornered_kind(
    points: np.ndarray, four: Int[np.ndarray, "c 4"], cells: CellKind | None
) -> CellKind:
    """Return the kind of polygons of four corners: LaPy, for example, writes tetrahedra as such."""
    if cells is not None:
        return "tetrahedra" if cells == "tetrahedra" else "quads"
    kind = four_cornered(points, four)
    if kind is None:
        raise FileFormatError(
            f"Polygons of four corners must be known to be quads or tetrahedra; these {len(four)} could be either; "
            f'the first is {four[0].tolist()}. cells="quads" or cells="tetrahedra" says which in read_shape and '
            "read_mesh, and --cells in the commands info, spectrum and repair."
        )
    return kind


def _count(word: bytes) -> int:
    try:
        return int(word)
    except ValueError as err:
        raise FileFormatError(
            f"A VTK file must count its cells by whole numbers; it says {word[:30]!r}."
        ) from err


def _cells(cursor: _Cursor, name: bytes, count: int, size: int) -> CellLists:
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


def _cells_by_offsets(cursor: _Cursor, words: Sequence[bytes], count: int, size: int) -> CellLists:
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
