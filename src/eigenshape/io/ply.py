"""Polygon File Format: a header that declares elements, then their rows, as text or binary of either order."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.text import fans, rows_text, shown

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2",
    "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
Table = dict[str, Any]  # the values of each column, by name
CORNERS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class Property:
    """A column: its name, its numpy type, and the type of its length where it is a list."""

    name: str
    kind: str
    length_kind: str | None = None


@dataclass(frozen=True)
class Element:
    """A table: its name, its declared number of rows, and its columns."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def least_bytes(self) -> int:
        """Bytes that a row of the table takes at least, in binary."""
        return sum(np.dtype(column.length_kind or column.kind).itemsize for column in self.properties)


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons become fans, all other elements and properties are passed over."""
    order, elements, body = _header(data)
    _require_room(elements, order, len(body))
    tables = _text_tables(body, elements) if order == "" else _binary_tables(body, elements, order)
    vertex = tables.get("vertex")
    if vertex is None or not {"x", "y", "z"} <= vertex.keys():
        raise FileFormatError("A PLY file must declare an element vertex with x, y and z; it does not.")
    vertices = np.column_stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"])
    return vertices, _triangles(tables, len(vertices))


def _triangles(tables: dict[str, Table], n_vertices: int) -> np.ndarray:
    face = tables.get("face", {})
    polygons = next((face[name] for name in CORNERS if name in face), None)
    if polygons is None or not len(polygons):
        strips = " It has triangle strips, which are not read." if "tristrips" in tables else ""
        raise FileFormatError(f"A PLY file must hold faces; it holds {n_vertices} points and no face.{strips}")
    if isinstance(polygons, np.ndarray) and polygons.shape[1] == 3:
        return polygons.astype(np.int64)
    for index, corners in enumerate(polygons):
        if len(corners) < 3:
            raise FileFormatError(f"A face must have three corners or more; face {index} is {list(corners)}.")
    return fans([[int(corner) for corner in corners] for corners in polygons])


def _header(data: bytes) -> tuple[str, list[Element], bytes]:
    head, mark, body = data.partition(b"end_header")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    if not lines or lines[0] != ["ply"]:
        raise FileFormatError("A PLY file must begin with ply; it does not.")
    if not mark:
        raise FileFormatError("A PLY header must end with end_header; it does not.")
    body = body[2:] if body[:2] == b"\r\n" else body[1:]
    order, elements = None, []
    for number, words in enumerate(lines, 1):
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], _count(words[2]), ()))
            elif words[:1] == ["property"]:
                last = elements.pop()
                elements.append(Element(last.name, last.count, (*last.properties, _property(words))))
        except (IndexError, KeyError, ValueError) as err:
            raise FileFormatError(f"A PLY header must make sense; line {number} is {shown(words)}.") from err
    if order is None:
        raise FileFormatError("A PLY header must name its format; it does not.")
    return order, elements, body


def _count(word: str) -> int:
    if not word.isdecimal():
        raise ValueError(word)
    return int(word)


def _property(words: list[str]) -> Property:
    if words[1] == "list":
        return Property(words[4], TYPES[words[3]], TYPES[words[2]])
    return Property(words[2], TYPES[words[1]])


def _require_room(elements: list[Element], order: str, n_bytes: int) -> None:
    for element in elements:
        least = element.least_bytes if order else 2 * len(element.properties)
        if element.count * least > n_bytes + 1:  # the last line of a text may lack its end
            raise FileFormatError(
                f"A PLY file must hold the rows it declares; {element.count} rows of {element.name} take "
                f"{element.count * least} bytes or more and {n_bytes} follow the header."
            )


def _text_tables(body: bytes, elements: list[Element]) -> dict[str, Table]:
    rows = [line.split() for line in body.decode("latin-1").splitlines() if line.strip()]
    declared = sum(element.count for element in elements if element.properties)
    if declared != len(rows):
        raise FileFormatError(
            f"A PLY file must hold the rows it declares; it declares {declared} in all and holds {len(rows)}."
        )
    tables, start = {}, 0
    for element in elements:
        count = element.count if element.properties else 0
        tables[element.name] = _text_table(rows[start : start + count], element)
        start += count
    return tables


def _text_table(rows: list[list[str]], element: Element) -> Table:
    table: Table = {column.name: [] for column in element.properties}
    for index, words in enumerate(rows):
        row = iter(words)
        try:
            for column in element.properties:
                read = float if "f" in column.kind else int
                if column.length_kind is None:
                    table[column.name].append(read(next(row)))
                else:
                    table[column.name].append([read(next(row)) for _ in range(int(next(row)))])
        except (StopIteration, RuntimeError, ValueError) as err:
            raise FileFormatError(f"Row {index} of {element.name} must fit its columns; it is {shown(words)}.") from err
        if next(row, None) is not None:
            raise FileFormatError(f"Row {index} of {element.name} must end with its columns; it is {shown(words)}.")
    return table


def _binary_tables(body: bytes, elements: list[Element], order: str) -> dict[str, Table]:
    tables, start = {}, 0
    for element in elements:
        table = _uniform_table(body, element, order, start) or _ragged_table(body, element, order, start)
        tables[element.name], start = table
    if body[start:].strip(b"\r\n\0 "):
        raise FileFormatError(f"A PLY file must end with its last row; {len(body) - start} more bytes follow.")
    return tables


def _uniform_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int] | None:
    """Read a table whose lists all have the length of the first, as most do; None where it is not so."""
    fields: list[Any] = []
    for column, length in _first_lengths(body, element, order, start):
        if column.length_kind is not None:
            fields.append((f"{column.name} length", order + column.length_kind))
        fields.append((column.name, order + column.kind, () if length is None else (length,)))
    record = np.dtype(fields)
    if start + record.itemsize * element.count > len(body):
        return None
    table = np.frombuffer(body, dtype=record, count=element.count, offset=start)
    for column in element.properties:
        if (
            column.length_kind
            and element.count
            and (table[f"{column.name} length"] != table[column.name].shape[1]).any()
        ):
            return None
    return {column.name: table[column.name] for column in element.properties}, start + record.itemsize * element.count


def _first_lengths(body: bytes, element: Element, order: str, start: int) -> Iterator[tuple[Property, int | None]]:
    for column in element.properties:
        length = None
        if column.length_kind is not None:
            kind = np.dtype(order + column.length_kind)
            known = element.count and start + kind.itemsize <= len(body)
            length = min(max(int(np.frombuffer(body, kind, 1, start)[0]), 0), len(body)) if known else 0
            start += kind.itemsize
        yield column, length
        start += np.dtype(column.kind).itemsize * (1 if length is None else length)


def _ragged_table(body: bytes, element: Element, order: str, start: int) -> tuple[Table, int]:
    table: Table = {column.name: [] for column in element.properties}
    for index in range(element.count):
        where = f"{element.name} {index}"
        for column in element.properties:
            if column.length_kind is None:
                values, start = _take(body, order + column.kind, 1, start, where)
                table[column.name].append(values[0])
            else:
                length, start = _take(body, order + column.length_kind, 1, start, where)
                values, start = _take(body, order + column.kind, int(length[0]), start, where)
                table[column.name].append(values)
    return table, start


def _take(body: bytes, kind: str, count: int, start: int, where: str) -> tuple[np.ndarray, int]:
    end = start + count * np.dtype(kind).itemsize
    if count < 0 or end > len(body):
        raise FileFormatError(f"A PLY file must hold the rows it declares; it ends inside {where}.")
    return np.frombuffer(body, kind, count, start), end


def format_mesh(mesh: TriangleMesh, *, binary: bool = True, colors: np.ndarray | None = None) -> bytes:
    """Write a mesh so that it reads back exactly; colours, (n, 3) uint8, stand with the vertices."""
    tints = [f"property uchar {name}" for name in ("red", "green", "blue") if colors is not None]
    header = [
        "ply", f"format {'binary_little_endian' if binary else 'ascii'} 1.0",
        f"element vertex {mesh.n_vertices}", *(f"property double {axis}" for axis in "xyz"), *tints,
        f"element face {mesh.n_faces}", "property list uchar int vertex_indices", "end_header",
    ]  # fmt: skip
    text = "\n".join(header) + "\n"
    if binary:
        return text.encode() + _binary_rows(mesh, colors)
    vertices = rows_text("", mesh.vertices)
    if colors is not None:
        vertices = [f"{row} {tint}" for row, tint in zip(vertices, rows_text("", colors), strict=True)]
    return (text + "\n".join([*vertices, *rows_text("3 ", mesh.faces)]) + "\n").encode()


def _binary_rows(mesh: TriangleMesh, colors: np.ndarray | None) -> bytes:
    vertices = np.zeros(mesh.n_vertices, dtype=[("xyz", "<f8", 3)] + ([("rgb", "u1", 3)] if colors is not None else []))
    vertices["xyz"] = mesh.vertices
    if colors is not None:
        vertices["rgb"] = colors
    faces = np.zeros(mesh.n_faces, dtype=[("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, mesh.faces
    return vertices.tobytes() + faces.tobytes()
