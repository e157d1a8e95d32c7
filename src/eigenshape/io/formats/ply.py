"""Polygon File Format: a header that declares tables, then their rows, as text or binary of either order."""

import struct
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import fans, strip_triangles
from eigenshape.io.formats.ply_header import TEXT, Column, Element, parse_header
from eigenshape.io.formats.text import (
    Line,
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
WRITTEN = {"u1": "uchar", "i4": "int", "f8": "double"}  # types of columns that are written
LABEL = "label"  # the property of faces that holds the number of their part
Table = dict[str, Any]  # the values of each column, by name


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons and strips become triangles, the rest is ignored."""
    tables = read_tables(data)
    vertices = np.column_stack(
        [np.asarray(tables["vertex"][axis], dtype=np.float64) for axis in AXES]
    )
    polygons, strips = read_lists(tables, "face"), read_lists(tables, "tristrips")
    triangles = [_triangles(polygons)] if len(polygons) else []
    if len(strips):
        triangles.append(strip_triangles(_pieces(strips)))
    return vertices, np.concatenate(triangles) if triangles else np.empty((0, 3), dtype=np.int64)


def read_tables(data: bytes) -> dict[str, Table]:
    """Read all columns, by table and name; of text those that make no mesh are left as words."""
    header = parse_header(data)
    elements = [element for element in header.elements if element.columns]
    _require_mesh(elements)
    body = data[header.end :]
    if header.order == TEXT:
        return _textread_tables(lines_of(body, first=header.n_lines + 1), elements)
    return _binaryread_tables(body, elements, header.order)


def read_lists(tables: dict[str, Table], name: str) -> Any:
    """Return the lists of corners of faces or strips."""
    table = tables.get(name, {})
    return next((table[column] for column in CORNERS if column in table), ())


def _pieces(strips: Sequence[Sequence[int]] | np.ndarray) -> list[np.ndarray]:
    """Split strips at -1, which separates them."""
    pieces = []
    for strip in strips:
        corners = np.asarray(strip, dtype=np.int64)
        ends = np.flatnonzero(corners == -1)
        pieces += [piece[piece != -1] for piece in np.split(corners, ends)]
    return pieces


def _require_mesh(elements: Sequence[Element]) -> None:
    columns = {
        (element.name, column.name): column for element in elements for column in element.columns
    }
    axes = [columns.get(("vertex", axis)) for axis in AXES]
    if any(axis is None or axis.length_kind for axis in axes):
        raise FileFormatError(
            "A PLY file must declare an element vertex with the numbers x, y and z; it does not."
        )
    for element in elements:
        if element.name not in ("face", "tristrips") or not element.count:
            continue
        corners = [
            columns[element.name, name] for name in CORNERS if (element.name, name) in columns
        ]
        if not (corners and corners[0].length_kind and corners[0].is_whole):
            raise FileFormatError(
                f"The element {element.name} of a PLY file must declare a list of whole vertex_indices; it does not."
            )


def _triangles(polygons: Sequence[Sequence[int]] | np.ndarray) -> np.ndarray:
    uniform = isinstance(polygons, np.ndarray)
    for index, corners in enumerate(polygons[:1] if uniform else polygons):
        if len(corners) < 3:
            raise FileFormatError(
                f"A face must have three corners or more; face {index} is {list(map(int, corners))}."
            )
    return fans(polygons.astype(np.int64) if isinstance(polygons, np.ndarray) else polygons)


def _textread_tables(lines: Sequence[Line], elements: Sequence[Element]) -> dict[str, Table]:
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
    is_whole = all(column.is_whole for column in element.columns)
    if not is_whole and any(column.length_kind for column in element.columns):
        return None
    values = whole_table(rows) if is_whole else number_table(rows)
    if values is None:
        return None
    table, place = {}, 0
    for column in element.columns:
        if place >= values.shape[1]:
            return None
        length = int(values[0, place]) if column.length_kind else 1
        if column.length_kind and (length < 0 or (values[:, place] != length).any()):
            return None
        place += bool(column.length_kind)
        table[column.name] = (
            values[:, place : place + length] if column.length_kind else values[:, place]
        )
        place += length
    return table if place == values.shape[1] else None


def _row_by_row(rows: Sequence[Line], element: Element) -> Table:
    table: Table = {column.name: [] for column in element.columns}
    for row in rows:
        words = row[1].split()
        place = 0
        for column in element.columns:
            values, place = _text_values(words, place, column, row)
            table[column.name].append(values if column.length_kind else values[0])
        if place < len(words):
            raise FileFormatError(
                f"A row of {element.name} must end with its columns; line {row[0]} goes on with "
                f"{quote_line((0, b' '.join(words[place:])))}."
            )
    return table


def _text_values(
    words: Sequence[bytes], place: int, column: Column, row: Line
) -> tuple[Sequence[Any], int]:
    count = 1
    if column.length_kind and place < len(words):
        count = whole(words[place], row, "The length of a list")
        place += 1
    if not 0 <= count <= len(words) - place:
        raise FileFormatError(
            f"A row must hold all its columns; line {row[0]} lacks {column.name}: {quote_line(row)}."
        )
    return _understood(words[place : place + count], column, row), place + count


def _understood(words: Sequence[bytes], column: Column, row: Line) -> Sequence[Any]:
    if column.name in AXES:
        return [number(word, row) for word in words]
    if column.name in CORNERS:
        return [whole(word, row, "A corner") for word in words]
    return words  # the column is not used


def _binaryread_tables(body: bytes, elements: Sequence[Element], order: str) -> dict[str, Table]:
    tables, start = {}, 0
    for element in elements:
        tables[element.name], start = _binary_table(body, element, order, start)
    if body[start:].strip(b"\r\n\0 "):
        raise FileFormatError(
            f"A PLY file must end with its last row; {len(body) - start} more bytes follow."
        )
    return tables


def _binary_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int]:
    """Read all rows at once if their lists have equal lengths, as in most files."""
    first, end = _ragged_table(body, replace(element, count=min(element.count, 1)), order, start)
    if not element.count:
        return first, end
    fields: list[Any] = []
    for column in element.columns:
        if column.length_kind:
            fields.append((f"length of {column.name}", order + column.length_kind))
        fields.append(
            (
                column.name,
                order + column.kind,
                (len(first[column.name][0]),) if column.length_kind else (),
            )
        )
    record = np.dtype(fields)
    end = start + element.count * record.itemsize
    if end <= len(body):
        rows = np.frombuffer(body, record, element.count, start)
        lists = [column.name for column in element.columns if column.length_kind]
        if all((rows[f"length of {name}"] == rows[name].shape[1]).all() for name in lists):
            return {column.name: rows[column.name] for column in element.columns}, end
    return _ragged_table(body, element, order, start)


def _ragged_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int]:
    table: Table = {column.name: [] for column in element.columns}
    for index in range(element.count):
        for column in element.columns:
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

    Raises
    ------
    FileFormatError
        If faces have no such property, or it is not a whole number.
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


def format_text(
    mesh: TriangleMesh, of_vertices: Table | None = None, of_faces: Table | None = None
) -> bytes:
    """Write a mesh, and columns of vertices and faces by name, as text that reads back exactly."""
    tables = _columns(mesh, of_vertices, of_faces)
    rows: list[str] = []
    for columns in tables.values():
        words = [
            rows_text(f"{values.shape[1]} ", values)
            if values.ndim == 2
            else map(repr, values.tolist())
            for values in columns.values()
        ]
        rows += map(" ".join, zip(*words, strict=True))
    return _header_text(tables, "ascii") + ("\n".join(rows) + "\n").encode()


def format_binary(
    mesh: TriangleMesh, of_vertices: Table | None = None, of_faces: Table | None = None
) -> bytes:
    """Write a mesh, and columns of vertices and faces by name, in binary that reads back exactly."""
    tables = _columns(mesh, of_vertices, of_faces)
    data = _header_text(tables, "binary_little_endian")
    for columns in tables.values():
        kinds: list[Any] = []
        for name, values in columns.items():
            kinds += [(f"length of {name}", "u1")] if values.ndim == 2 else []
            kinds.append((name, values.dtype.newbyteorder("<"), values.shape[1:]))
        table = np.zeros(len(next(iter(columns.values()))), dtype=kinds)
        for name, values in columns.items():
            table[name] = values
            if values.ndim == 2:
                table[f"length of {name}"] = values.shape[1]
        data += table.tobytes()
    return data


def _columns(
    mesh: TriangleMesh, of_vertices: Table | None, of_faces: Table | None
) -> dict[str, Table]:
    corners = {CORNERS[0]: mesh.faces.astype(np.int32)}
    places = dict(zip(AXES, mesh.vertices.T, strict=True))
    return {"vertex": places | (of_vertices or {}), "face": corners | (of_faces or {})}


def format_points(points: np.ndarray, _suffix: str) -> bytes:
    """Write points without faces, in binary."""
    lines = [
        "ply", "format binary_little_endian 1.0",
        f"element vertex {len(points)}", *(f"property double {axis}" for axis in AXES), "end_header",
    ]  # fmt: skip
    return ("\n".join(lines) + "\n").encode() + points.astype("<f8").tobytes()


def _header_text(tables: dict[str, Table], order: str) -> bytes:
    lines = ["ply", f"format {order} 1.0"]
    for element, columns in tables.items():
        lines.append(f"element {element} {len(next(iter(columns.values())))}")
        for name, values in columns.items():
            kind = WRITTEN[values.dtype.str[1:]]
            lines.append(f"property {'list uchar ' if values.ndim == 2 else ''}{kind} {name}")
    return ("\n".join([*lines, "end_header"]) + "\n").encode()
