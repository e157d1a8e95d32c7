"""Object File Format: counts, vertices and faces, as text or binary."""

import re
from collections.abc import Sequence

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import fans
from eigenshape.io.formats.text import (
    Line,
    coordinates,
    lines_of,
    number,
    quote_line,
    rows_text,
    whole,
    whole_table,
)

KEYWORD = re.compile(rb"(?:ST)?C?N?OFF(?P<glued>\d*)", re.IGNORECASE)  # some write OFF8 6 12
PLAIN = re.compile(rb"OFF", re.IGNORECASE)  # three numbers a vertex
BINARY = re.compile(rb"OFF[ \t]+BINARY[ \t]*\r?\n", re.IGNORECASE)


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons become fans; colors and normals are ignored."""
    binary = BINARY.match(data)
    if binary:
        return _parse_binary(data[binary.end() :])
    lines = lines_of(data)
    counts, rows = _head(lines)
    n_vertices, n_faces = _counts(counts)
    if n_vertices + n_faces != len(rows):
        found = _parse_stream(rows, n_vertices, n_faces) if PLAIN.match(lines[0][1]) else None
        if found is not None:
            return found
        raise FileFormatError(
            f"An OFF file must hold the rows it declares; it declares {n_vertices} vertices and {n_faces} faces "
            f"and holds {len(rows)} rows."
        )
    _require_equal_rows(rows[:n_vertices])
    return coordinates(rows[:n_vertices]), _triangles(rows[n_vertices:])


def _parse_stream(
    rows: Sequence[Line], n_vertices: int, n_faces: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Read numbers without regard to lines; None if vertices and faces do not fill the file."""
    words = [(at, word) for at, text in rows for word in text.split()]
    if 3 * n_vertices + 4 * n_faces > len(words):
        return None
    place = 3 * n_vertices
    polygons = []
    for _ in range(n_faces):
        if place >= len(words):
            return None
        line = words[place]
        count = whole(line[1], line, "A number of corners")
        if not 3 <= count < len(words) - place:
            return None
        corners = words[place + 1 : place + 1 + count]
        polygons.append([whole(word, (at, word), "A corner") for at, word in corners])
        place += 1 + count
    if place != len(words):
        return None
    numbers = [number(word, (at, word)) for at, word in words[: 3 * n_vertices]]
    return np.array(numbers).reshape(-1, 3), fans(polygons)


def _parse_binary(body: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read 32-bit numbers, in the byte order and with the counts of colors that fit the file.

    Geomview writes big-endian numbers and, after each face, the number of its colors. The Polygon
    Mesh Processing library and OpenMesh use the byte order of the machine and write no such number.
    """
    for order in ">", "<":
        for has_colors in True, False:
            found = _binary_mesh(body, order, has_colors)
            if found is not None:
                return found
    raise FileFormatError(
        f"A binary OFF file must hold 32-bit counts, x, y and z of each vertex, and faces that fill it; it does not, "
        f"in {len(body)} bytes."
    )


def _binary_mesh(body: bytes, order: str, has_colors: bool) -> tuple[np.ndarray, np.ndarray] | None:
    numbers = np.frombuffer(body, f"{order}i4", len(body) // 4).tolist()
    if len(body) % 4 or len(numbers) < 3:
        return None
    n_vertices, n_faces, _ = numbers[:3]
    place = 3 + 3 * n_vertices
    if min(n_vertices, n_faces) < 0 or place + 4 * n_faces > len(numbers):
        return None
    polygons = []
    for _ in range(n_faces):
        if place >= len(numbers) or not 3 <= numbers[place] < len(numbers) - place:
            return None
        polygons.append(numbers[place + 1 : place + 1 + numbers[place]])
        place += 1 + numbers[place]
        if has_colors:
            n_colors = numbers[place] if place < len(numbers) else -1
            if not 0 <= n_colors <= 4:
                return None
            place += 1 + n_colors
    if place != len(numbers):
        return None
    vertices = np.frombuffer(body, f"{order}f4", 3 * n_vertices, 12).reshape(-1, 3)
    return vertices.astype(np.float64), fans(polygons)


def _head(lines: list[Line]) -> tuple[Line, list[Line]]:
    first = lines[0] if lines else (1, b"")
    keyword, *words = first[1].split() or [b""]
    match = KEYWORD.fullmatch(keyword)
    if match is None:
        raise FileFormatError(
            f"An OFF file must begin with OFF, COFF, NOFF or the like; it begins with {quote_line(first)}."
        )
    counts = b" ".join([match["glued"], *words]).strip()
    if counts:
        return (first[0], counts), lines[1:]
    return (lines[1] if len(lines) > 1 else (first[0] + 1, b"")), lines[2:]


def _counts(line: Line) -> tuple[int, int]:
    words = line[1].split()
    if len(words) < 2:
        raise FileFormatError(
            f"An OFF file must declare vertices and faces; line {line[0]} is {quote_line(line)}."
        )
    n_vertices, n_faces = (whole(word, line, "A count") for word in words[:2])
    if min(n_vertices, n_faces) < 0:
        raise FileFormatError(
            f"A count must not be negative; line {line[0]} is {quote_line(line)}."
        )
    return n_vertices, n_faces


def _require_equal_rows(rows: Sequence[Line]) -> None:
    """Raise an error if rows have different widths: a face could be read as a vertex."""
    widths = [len(row[1].split()) for row in rows]
    odd = next((row for row, width in zip(rows, widths, strict=True) if width != widths[0]), None)
    if odd is not None:
        raise FileFormatError(
            f"All vertices must have equally many columns; the first has {widths[0]} and "
            f"line {odd[0]} is {quote_line(odd)}."
        )


def _triangles(rows: Sequence[Line]) -> np.ndarray:
    table = whole_table(rows)
    if (
        table is not None
        and (table[:, 0] == table[0, 0]).all()
        and 3 <= table[0, 0] < table.shape[1]
    ):
        return fans(table[:, 1 : 1 + table[0, 0]])
    return fans([_corners(row) for row in rows])


def _corners(row: Line) -> list[int]:
    words = row[1].split()
    count = whole(words[0], row, "A number of corners")
    if not 3 <= count < len(words):
        raise FileFormatError(
            f"A face must have three corners or more, as many as it says; line {row[0]} is {quote_line(row)}."
        )
    return [whole(word, row, "A corner") for word in words[1 : 1 + count]]


def format_text(mesh: TriangleMesh) -> bytes:
    """Write a mesh so that it reads back exactly."""
    lines = [
        f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0",
        *rows_text("", mesh.vertices),
        *rows_text("3 ", mesh.faces),
    ]
    return ("\n".join(lines) + "\n").encode()
