"""Object File Format: counts, then a line a vertex, then a line a face."""

import re

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.text import Line, coordinates, fans, lines_of, rows_text, shown, whole

KEYWORD = re.compile(r"(ST)?C?N?OFF(?P<glued>\d*)", re.IGNORECASE)


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons become fans, colours and normals are passed over."""
    lines = lines_of(data)
    keyword = KEYWORD.fullmatch(lines[0].words[0]) if lines else None
    if keyword is None:
        first = shown(lines[0].words) if lines else "empty"
        raise FileFormatError(f"An OFF file must begin with OFF, COFF, NOFF or the like; it is {first}.")
    if "BINARY" in (word.upper() for word in lines[0].words):
        raise FileFormatError("An OFF file must be text; line 1 says BINARY.")
    head = [*filter(None, [keyword["glued"]]), *lines[0].words[1:]]
    rows = lines[1:] if head else lines[2:]
    count_line = Line(lines[0].number, head) if head else (lines[1] if len(lines) > 1 else Line(1, []))
    n_vertices, n_faces = _counts(count_line)
    if n_vertices + n_faces != len(rows):
        raise FileFormatError(
            f"An OFF file must hold the rows it declares; it declares {n_vertices} vertices and {n_faces} faces "
            f"and holds {len(rows)} rows."
        )
    vertices = coordinates(rows[:n_vertices])
    return vertices, fans([_corners(line) for line in rows[n_vertices:]])


def _counts(line: Line) -> tuple[int, int]:
    if len(line.words) < 2:
        raise FileFormatError(
            f"An OFF file must declare vertices and faces; line {line.number} is {shown(line.words)}."
        )
    counts = [whole(word, line.number, "A count") for word in line.words[:2]]
    if min(counts) < 0:
        raise FileFormatError(f"A count must not be negative; line {line.number} is {shown(line.words)}.")
    return counts[0], counts[1]


def _corners(line: Line) -> list[int]:
    count = whole(line.words[0], line.number, "A number of corners")
    corners = line.words[1 : 1 + max(count, 0)]
    if count < 3 or len(corners) < count:
        raise FileFormatError(
            f"A face must have three corners or more, as many as it says; line {line.number} is {shown(line.words)}."
        )
    return [whole(word, line.number, "A corner") for word in corners]


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write a mesh so that it reads back exactly."""
    lines = [f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0", *rows_text("", mesh.vertices), *rows_text("3 ", mesh.faces)]
    return ("\n".join(lines) + "\n").encode()
