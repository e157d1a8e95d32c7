"""Object File Format: counts, then a line a vertex, then a line a face."""

import re
from collections.abc import Sequence

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.text import Line, coordinates, fans, lines_of, rows_text, shown, whole, whole_table

KEYWORD = re.compile(rb"(?:ST)?C?N?OFF(?P<glued>\d*)", re.IGNORECASE)  # some write OFF8 6 12


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons become fans, colours and normals are passed over."""
    counts, rows = _head(lines_of(data))
    n_vertices, n_faces = _counts(counts)
    if n_vertices + n_faces != len(rows):
        raise FileFormatError(
            f"An OFF file must hold the rows it declares; it declares {n_vertices} vertices and {n_faces} faces "
            f"and holds {len(rows)} rows."
        )
    _require_equal_rows(rows[:n_vertices])
    return coordinates(rows[:n_vertices]), _triangles(rows[n_vertices:])


def _head(lines: list[Line]) -> tuple[Line, list[Line]]:
    first = lines[0] if lines else (1, b"")
    keyword, *words = first[1].split() or [b""]
    match = KEYWORD.fullmatch(keyword)
    if match is None:
        raise FileFormatError(
            f"An OFF file must begin with OFF, COFF, NOFF or the like; it begins with {shown(first)}."
        )
    if b"BINARY" in (word.upper() for word in words):
        raise FileFormatError("An OFF file must be text; line 1 says BINARY.")
    counts = b" ".join([match["glued"], *words]).strip()
    if counts:
        return (first[0], counts), lines[1:]
    return (lines[1] if len(lines) > 1 else (first[0] + 1, b"")), lines[2:]


def _counts(line: Line) -> tuple[int, int]:
    words = line[1].split()
    if len(words) < 2:
        raise FileFormatError(f"An OFF file must declare vertices and faces; line {line[0]} is {shown(line)}.")
    n_vertices, n_faces = (whole(word, line, "A count") for word in words[:2])
    if min(n_vertices, n_faces) < 0:
        raise FileFormatError(f"A count must not be negative; line {line[0]} is {shown(line)}.")
    return n_vertices, n_faces


def _require_equal_rows(rows: Sequence[Line]) -> None:
    """Refuse rows of several widths: where counts are wrong a face could be taken for a vertex."""
    widths = [len(row[1].split()) for row in rows]
    odd = next((row for row, width in zip(rows, widths, strict=True) if width != widths[0]), None)
    if odd is not None:
        raise FileFormatError(
            f"All vertices must have equally many columns; the first has {widths[0]} and line {odd[0]} is {shown(odd)}."
        )


def _triangles(rows: Sequence[Line]) -> np.ndarray:
    table = whole_table(rows)
    if table is not None and (table[:, 0] == table[0, 0]).all() and 3 <= table[0, 0] < table.shape[1]:
        return fans(table[:, 1 : 1 + table[0, 0]])
    return fans([_corners(row) for row in rows])


def _corners(row: Line) -> list[int]:
    words = row[1].split()
    count = whole(words[0], row, "A number of corners")
    if not 3 <= count < len(words):
        raise FileFormatError(
            f"A face must have three corners or more, as many as it says; line {row[0]} is {shown(row)}."
        )
    return [whole(word, row, "A corner") for word in words[1 : 1 + count]]


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write a mesh so that it reads back exactly."""
    lines = [f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0", *rows_text("", mesh.vertices), *rows_text("3 ", mesh.faces)]
    return ("\n".join(lines) + "\n").encode()
