"""Polygon File Format: a header that declares tables, then their rows, as text or binary of either order.

Read: polygons of any outline and strips, text and binary of both orders, all types of numbers.
Kept: texture coordinates, normals, colors of vertices and faces, labels, fields, the image of a
    comment.
Named: elements with corners under another name; lists; missing images.
Refused: a row that is not there; a face that crosses itself.
"""

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.errors import FileFormatError
from certeig.kit.files import LONGEST_LINE
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import (
    list_corners,
    polygon_triangles,
    strip_triangles,
)
from eigenshape.io.formats.numbers import (
    Line,
    end_lines,
    lines_of,
    number,
    number_table,
    quote_line,
    rows_text,
    whole,
    whole_table,
)

AXES = ("x", "y", "z")
CORNERS = ("vertex_indices", "vertex_index")
READ_ELEMENTS = ("face", "tristrips")  # that have corners
WRITTEN_TYPES = {"u1": "uchar", "i4": "int", "f8": "double"}  # of columns
LABEL = "label"  # the property of faces that holds the number of their part
Table = dict[str, Any]  # the values of each column, by name
TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d",
    "int64": "q", "uint64": "Q",  # which meshio writes
}  # fmt: skip
TEXT = "text"
ORDERS = {"ascii": TEXT, "binary_little_endian": "<", "binary_big_endian": ">"}
MOST_DIGITS = 18  # more rows than any file can hold
END = re.compile(rb"(?:^|(?<=[\r\n]))end_header[ \t]*(\r\n|\n|\r|$)")


@dataclass(frozen=True)
class Column:
    """A property: its name, the letter of its type, and for a list that of its length."""

    name: str
    kind: str
    length_kind: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether its values are whole numbers."""
        return self.kind not in "fd"


@dataclass(frozen=True)
class Element:
    """A table: its name, its declared number of rows, and its columns by name."""

    name: str
    count: int
    columns: dict[str, Column]


@dataclass(frozen=True)
class Header:
    """The byte order (or TEXT), the tables by name, and the place where their rows begin."""

    order: str
    elements: dict[str, Element]
    end: int
    n_lines: int


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray, *tuple[str, ...]]:
    """Read vertices and faces, where polygons and strips become triangles; name other elements."""
    tables = read_tables(data)
    vertices = np.column_stack(
        [np.asarray(tables["vertex"][axis], dtype=np.float64) for axis in AXES]
    )
    polygons = read_lists(tables, "face")
    are_equal = isinstance(polygons, np.ndarray)
    for index, corners in enumerate(polygons[:1] if are_equal else polygons):
        if len(corners) < 3:
            raise FileFormatError(
                f"A face must have three corners or more; face {index} is {list(map(int, corners))}."
            )
    corners = polygons.astype(np.int64) if are_equal else polygons
    triangles = [polygon_triangles(vertices, corners)]
    for strip in read_lists(tables, "tristrips"):
        corners = np.asarray(strip, dtype=np.int64)
        pieces = np.split(corners, np.flatnonzero(corners == -1))  # -1 separates strips
        strips = list_corners([piece[piece != -1].tolist() for piece in pieces])
        triangles.append(strip_triangles(strips)[0])
    notes = [
        f"the element {name}, which has {CORNERS[0]}, is not read"
        for name in tables
        if name not in READ_ELEMENTS and len(read_lists(tables, name))
    ]
    return vertices, np.concatenate(triangles), *notes


def parse_header(data: bytes) -> Header:
    """Read the header, refusing tables that are larger than the file before anybody makes room for them."""
    if not re.match(rb"ply\s", data):
        raise FileFormatError(
            f"A PLY file must begin with ply; it begins with {quote_line((1, data[:10]))}."
        )
    mark = END.search(data, 0, LONGEST_LINE)
    if mark is None:
        raise FileFormatError(
            "A PLY header must end with end_header; there is no such line in its first "
            f"{min(len(data), LONGEST_LINE)} bytes."
        )
    lines = data[: mark.start()].splitlines()
    order, elements = _declarations(lines)
    if not order:
        raise FileFormatError("A PLY header must name its format; it has no such line.")
    # Where lines end in a carriage return alone, a line feed that follows belongs to the rows.
    end = mark.end() - (mark[1] == b"\r\n" and not re.match(rb"ply[ \t]*\r?\n", data))
    n_bytes = len(data) - end
    for element in elements.values():
        kinds = [column.length_kind or column.kind for column in element.columns.values()]
        # A list may be empty, and a word of text takes a letter and a space.
        least = sum(2 if order == TEXT else struct.calcsize("<" + kind) for kind in kinds)
        if element.count * least > n_bytes + 1:  # the last line of a text may lack its end
            raise FileFormatError(
                f"A PLY file must hold the rows it declares; {element.count} rows of {element.name} take "
                f"{element.count * least} bytes or more and {n_bytes} follow the header."
            )
    return Header(order, elements, end, len(lines) + 1)


def _declarations(lines: Sequence[bytes]) -> tuple[str, dict[str, Element]]:
    """Return the byte order, empty if there is none, and the tables that the lines of a header declare."""
    order = ""
    elements: dict[str, Element] = {}
    columns: dict[str, Column] | None = None  # of the last element
    for index, line in enumerate(lines, 1):
        match line.decode("latin-1").split():
            case [] | ["ply" | "comment" | "obj_info", *_]:
                pass
            case ["format", name, *_] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count, *_] if (
                name not in elements and count.isdecimal() and len(count) <= MOST_DIGITS
            ):
                columns = {}
                elements[name] = Element(name, int(count), columns)
            case ["property", "list", lengths, kind, name, *_] if (
                columns is not None
                and name not in columns
                and kind in TYPES
                and TYPES.get(lengths, "f") not in "fd"
            ):
                columns[name] = Column(name, TYPES[kind], TYPES[lengths])
            case ["property", kind, name, *_] if (
                columns is not None and name not in columns and kind in TYPES
            ):
                columns[name] = Column(name, TYPES[kind])
            case _:
                raise FileFormatError(
                    f"A PLY header must declare format, elements and properties; "
                    f"line {index} is {quote_line((index, line))}."
                )
    return order, elements


def read_tables(data: bytes) -> dict[str, Table]:
    """Read all columns, by table and name; of text those that make no mesh are left as words."""
    header = parse_header(data)
    elements = [element for element in header.elements.values() if element.columns]
    places = header.elements["vertex"].columns if "vertex" in header.elements else {}
    if any(axis not in places or places[axis].length_kind for axis in AXES):
        raise FileFormatError(
            "A PLY file must declare an element vertex with the numbers x, y and z; it does not."
        )
    for element in elements:
        if element.name not in READ_ELEMENTS or not element.count:
            continue
        corners = next((element.columns[name] for name in CORNERS if name in element.columns), None)
        if corners is None or not corners.length_kind or not corners.is_whole:
            raise FileFormatError(
                f"The element {element.name} of a PLY file must declare a list of whole vertex_indices; it does not."
            )
    body = data[header.end :]
    if header.order == TEXT:
        return _read_text(lines_of(body, first=header.n_lines + 1), elements)
    tables, start = {}, 0
    for element in elements:
        tables[element.name], start = _binary_table(body, element, header.order, start)
    if body[start:].strip(b"\r\n\0 "):
        raise FileFormatError(
            f"A PLY file must end with its last row; {len(body) - start} more bytes follow."
        )
    return tables


def read_lists(tables: dict[str, Table], name: str) -> Any:
    """Return the lists of corners of faces or strips."""
    table = tables.get(name, {})
    return next((table[column] for column in CORNERS if column in table), ())


def _read_text(lines: Sequence[Line], elements: Sequence[Element]) -> dict[str, Table]:
    declared = sum(element.count for element in elements)
    if declared != len(lines):
        raise FileFormatError(
            f"A PLY file must hold the rows it declares; it declares {declared} in all and holds {len(lines)}."
        )
    tables, start = {}, 0
    for element in elements:
        rows = lines[start : start + element.count]
        table = _plain_table(rows, element)
        tables[element.name] = _row_by_row(rows, element) if table is None else table
        start += element.count
    return tables


def _plain_table(rows: Sequence[Line], element: Element) -> Table | None:
    """Read rows of plain numbers with lists of equal lengths at once; None if there are others."""
    columns = element.columns.values()
    is_whole = all(column.is_whole for column in columns)
    if not is_whole and any(column.length_kind for column in columns):
        return None
    values = whole_table(rows) if is_whole else number_table(rows)
    if values is None:
        return None
    table, place = {}, 0
    for column in columns:
        if place >= values.shape[1]:
            return None
        table[column.name] = first = values[:, place]
        place += 1
        if column.length_kind:
            length = int(first[0])
            if length < 0 or (first != length).any():
                return None
            table[column.name] = values[:, place : place + length]
            place += length
    return table if place == values.shape[1] else None


def _row_by_row(rows: Sequence[Line], element: Element) -> Table:
    table: Table = {name: [] for name in element.columns}
    for row in rows:
        words = row[1].split()
        place = 0
        for column in element.columns.values():
            count = 1
            if column.length_kind and place < len(words):
                count = whole(words[place], row, "The length of a list")
                place += 1
            if not 0 <= count <= len(words) - place:
                raise FileFormatError(
                    f"A row must hold all its columns; line {row[0]} lacks {column.name}: {quote_line(row)}."
                )
            values: Sequence[Any] = words[place : place + count]
            place += count
            if column.name in AXES:
                values = [number(word, row) for word in values]
            elif column.name in CORNERS:
                values = [whole(word, row, "A corner") for word in values]
            table[column.name].append(values if column.length_kind else values[0])
        if place < len(words):
            raise FileFormatError(
                f"A row of {element.name} must end with its columns; line {row[0]} goes on with "
                f"{quote_line((0, b' '.join(words[place:])))}."
            )
    return table


def _binary_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int]:
    """Read all rows at once if their lists have equal lengths, as in most files."""
    first, end = _ragged_table(body, replace(element, count=min(element.count, 1)), order, start)
    if not element.count:
        return first, end
    fields: list[Any] = []
    for name, column in element.columns.items():
        if column.length_kind:
            fields.append((f"length of {name}", order + column.length_kind))
        fields.append((name, order + column.kind, np.shape(first[name][0])))
    record = np.dtype(fields)
    end = start + element.count * record.itemsize
    if end <= len(body):
        rows = np.frombuffer(body, record, element.count, start)
        lists = [name for name, column in element.columns.items() if column.length_kind]
        if all((rows[f"length of {name}"] == rows[name].shape[1]).all() for name in lists):
            return {name: rows[name] for name in element.columns}, end
    return _ragged_table(body, element, order, start)


def _ragged_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int]:
    table: Table = {name: [] for name in element.columns}
    for index in range(element.count):
        for column in element.columns.values():
            try:
                count = 1
                if column.length_kind:
                    (count,) = struct.unpack_from(order + column.length_kind, body, start)
                    start += struct.calcsize(order + column.length_kind)
                values = struct.unpack_from(f"{order}{count}{column.kind}", body, start)
            except struct.error as err:
                raise FileFormatError(
                    f"A PLY file must hold the rows it declares; {column.name} of {element.name} {index} does not fit."
                ) from err
            start += struct.calcsize(f"{order}{count}{column.kind}")
            table[column.name].append(values if column.length_kind else values[0])
    return table, start


def parse_labels(data: bytes) -> Int[np.ndarray, " f"]:
    """Read the property `label` of faces: one whole number for each triangle that `parse` makes of them.

    Raise FileFormatError if faces have no such property, or it is not a whole number.
    """
    tables = read_tables(data)
    labels = tables.get("face", {}).get(LABEL)
    if labels is None:
        raise FileFormatError(
            f"Faces of a PLY file of labels must have a property {LABEL}; they have none."
        )
    try:
        values = np.array([int(label) for label in labels], dtype=np.int64)
    except (TypeError, ValueError, OverflowError) as err:
        raise FileFormatError(
            f"The property {LABEL} of faces must be a whole number; it is not: {err}."
        ) from err
    n_triangles = [len(polygon) - 2 for polygon in read_lists(tables, "face")]
    return np.repeat(values, n_triangles)


def format_text(mesh: TriangleMesh, *more: Table, comment: str = "") -> bytes:
    """Write a mesh, and more columns of vertices and of faces, as text that reads back exactly."""
    tables = _columns(mesh, *more)
    rows: list[str] = []
    for columns in tables.values():
        words = [
            rows_text(f"{values.shape[1]} ", values)
            if values.ndim == 2
            else map(repr, values.tolist())
            for values in columns.values()
        ]
        rows += map(" ".join, zip(*words, strict=True))
    return _header_text(tables, "ascii", comment) + end_lines(rows)


def format_binary(mesh: TriangleMesh, *more: Table, comment: str = "") -> bytes:
    """Write a mesh, and more columns of vertices and of faces, in binary that reads back exactly."""
    return _pack(_columns(mesh, *more), comment)


def format_points(points: np.ndarray, _suffix: str) -> bytes:
    """Write points without faces, in binary."""
    return _pack({"vertex": dict(zip(AXES, points.T, strict=True))})


def _columns(mesh: TriangleMesh, *more: Table) -> dict[str, Table]:
    places = dict(zip(AXES, mesh.vertices.T, strict=True))
    tables = {"vertex": places, "face": {CORNERS[0]: mesh.faces.astype(np.int32)}}
    for table, columns in zip(tables.values(), more, strict=False):
        table.update(columns)
    return tables


def _pack(tables: dict[str, Table], comment: str = "") -> bytes:
    data = _header_text(tables, "binary_little_endian", comment)
    for columns in tables.values():
        pieces = []
        for values in columns.values():
            if values.ndim == 2:
                pieces.append(np.full((len(values), 1), values.shape[1], np.uint8))
            rows = values.astype(values.dtype.newbyteorder("<"), order="C")
            pieces.append(np.frombuffer(rows, np.uint8).reshape(len(rows), -1))
        data += np.hstack(pieces).tobytes()
    return data


def _header_text(tables: dict[str, Table], order: str, comment: str) -> bytes:
    lines = ["ply", f"format {order} 1.0", *([f"comment {comment}"] if comment else [])]
    for element, columns in tables.items():
        lines.append(f"element {element} {len(next(iter(columns.values())))}")
        for name, values in columns.items():
            kind = WRITTEN_TYPES[values.dtype.str[1:]]
            lines.append(f"property {'list uchar ' if values.ndim == 2 else ''}{kind} {name}")
    return end_lines([*lines, "end_header"])
