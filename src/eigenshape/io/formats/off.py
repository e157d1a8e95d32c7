"""Object File Format: counts, vertices and faces, as text or binary.

Read: polygons of any outline; binary files; OFF, COFF, NOFF, CNOFF, STOFF and 4OFF.
Kept: nothing besides positions and faces.
Named: colors, normals and texture coordinates, which are not read.
Refused: a count that the file does not hold; a face that crosses itself; other dimensions (nOFF).
"""

import re
from collections.abc import Sequence

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import polygon_triangles
from eigenshape.io.formats.numbers import (
    Line,
    coordinates,
    end_lines,
    lines_of,
    number,
    quote_line,
    rows_text,
    whole,
    whole_table,
)

# CGAL writes STCNOFF, MeshLab NCOFF, and some OFF8 6 12; nOFF has any number of coordinates.
KEYWORD = re.compile(rb"(?!.*nOFF)(?i:(?:ST|C|N)*OFF)(?P<glued>\d*)")
PLAIN = re.compile(rb"OFF", re.IGNORECASE)  # three numbers a vertex
BINARY = re.compile(rb"OFF[ \t]+BINARY[ \t]*\r?\n", re.IGNORECASE)


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray, *tuple[str, ...]]:
    """Read vertices and faces, and name what else vertices and faces have."""
    binary = BINARY.match(data)
    if binary:
        return _parse_binary(data[binary.end() :])
    first, *rows = lines_of(data) or [(1, b"")]
    keyword, *words = first[1].split() or [b""]
    match = KEYWORD.fullmatch(keyword)
    if match is None:
        raise FileFormatError(
            "An OFF file must begin with OFF, COFF, NOFF or the like, and have three coordinates a "
            f"vertex; it begins with {quote_line(first)}. Save it as OFF."
        )
    # The counts stand behind the keyword or in the next line.
    counts = (first[0], b" ".join([match["glued"], *words]).strip())
    if not counts[1]:
        counts, *rows = rows or [(first[0] + 1, b"")]
    declared = counts[1].split()[:2]
    if len(declared) < 2:
        raise FileFormatError(
            f"An OFF file must declare vertices and faces; line {counts[0]} is {quote_line(counts)}."
        )
    n_vertices, n_faces = (whole(word, counts, "A count") for word in declared)
    if min(n_vertices, n_faces) < 0:
        raise FileFormatError(
            f"A count must not be negative; line {counts[0]} is {quote_line(counts)}."
        )
    if n_vertices + n_faces != len(rows):
        found = _parse_stream(rows, n_vertices, n_faces) if PLAIN.match(first[1]) else None
        if found is not None:
            return found
        raise FileFormatError(
            f"An OFF file must hold the rows it declares; it declares {n_vertices} vertices and {n_faces} faces "
            f"and holds {len(rows)} rows."
        )
    # A face could be read as a vertex, but rows have different widths then.
    widths = [len(text.split()) for _, text in rows[:n_vertices]]
    for row, width in zip(rows, widths, strict=False):
        if width != widths[0]:
            raise FileFormatError(
                f"All vertices must have equally many columns; the first has {widths[0]} and "
                f"line {row[0]} is {quote_line(row)}."
            )
    vertices = coordinates(rows[:n_vertices])
    faces = _faces(rows[n_vertices:])
    n_words = sum(len(text.split()) for _, text in rows[n_vertices:])
    has_more = max(widths, default=3) > 3 or n_words > len(faces) + sum(map(len, faces))
    notes = ["colors, normals and texture coordinates are not read"] if has_more else []
    return vertices, polygon_triangles(vertices, faces), *notes


def _faces(rows: Sequence[Line]) -> np.ndarray | list[list[int]]:
    table = whole_table(rows)
    if table is not None and 3 <= table[0, 0] < table.shape[1]:
        size = table[0, 0]
        if (table[:, 0] == size).all():
            return table[:, 1 : 1 + size]
    polygons = []
    for row in rows:
        words = row[1].split()
        count = whole(words[0], row, "A number of corners")
        if not 3 <= count < len(words):
            raise FileFormatError(
                f"A face must have three corners or more, as many as it says; line {row[0]} is {quote_line(row)}."
            )
        polygons.append([whole(word, row, "A corner") for word in words[1 : 1 + count]])
    return polygons


def _parse_stream(
    rows: Sequence[Line], n_vertices: int, n_faces: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Read numbers without regard to lines; None if vertices and faces do not fill the file."""
    words = [(at, word) for at, text in rows for word in text.split()]
    n_numbers = 3 * n_vertices
    if n_numbers + 4 * n_faces > len(words):
        return None
    faces = [whole(word, (at, word), "A corner") for at, word in words[n_numbers:]]
    polygons = _polygons(faces, n_faces, has_colors=False)
    if polygons is None:
        return None
    numbers = [number(word, (at, word)) for at, word in words[:n_numbers]]
    vertices = np.array(numbers).reshape(-1, 3)
    return vertices, polygon_triangles(vertices, polygons)


def _parse_binary(body: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read 32-bit numbers, in the byte order and with the counts of colors that fit the file.

    Geomview writes big-endian numbers and, after each face, the number of its colors. The Polygon
    Mesh Processing library and OpenMesh use the byte order of the machine and write no such number.
    """
    for order in ">", "<":
        numbers: list[int] = np.frombuffer(body, f"{order}i4", len(body) // 4).tolist()
        n_vertices, n_faces, *_ = [*numbers[:3], -1, -1]
        place = 3 + 3 * n_vertices
        if len(body) % 4 or min(n_vertices, n_faces) < 0 or place + 4 * n_faces > len(numbers):
            continue
        for has_colors in True, False:
            polygons = _polygons(numbers[place:], n_faces, has_colors=has_colors)
            if polygons is not None:
                floats = np.frombuffer(body, f"{order}f4", 3 * n_vertices, 12)
                vertices = floats.reshape(-1, 3).astype(np.float64)
                return vertices, polygon_triangles(vertices, polygons)
    raise FileFormatError(
        f"A binary OFF file must hold 32-bit counts, x, y and z of each vertex, and faces that fill it; it does not, "
        f"in {len(body)} bytes."
    )


def _polygons(numbers: list[int], n_faces: int, *, has_colors: bool) -> list[list[int]] | None:
    """Return polygons from numbers that begin with theirs; None if they do not fill them."""
    place = 0
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
    return polygons if place == len(numbers) else None


def format_text(mesh: TriangleMesh) -> bytes:
    """Write a mesh so that it reads back exactly."""
    return end_lines(
        [
            f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0",
            *rows_text("", mesh.vertices),
            *rows_text("3 ", mesh.faces),
        ]
    )
