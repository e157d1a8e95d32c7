"""Wavefront OBJ: positions and faces, and the lines of a file that `obj_attributes` understands.

Read: polygons of any outline, polylines, vertices in a plane, negative indices, lines that go on.
Kept: from OBJ to OBJ all but comments, points and polylines; to others texture coordinates,
    normals, colors, materials with their images, groups.
Named: missing materials and images; lines that are not kept.
Refused: a corner that is no vertex; a face that crosses itself.
"""

import codecs
import re
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import polygon_triangles
from eigenshape.io.formats.numbers import (
    Line,
    coordinates,
    lines_of,
    quote_line,
    whole,
    whole_table,
)

# A backslash joins only lines of numbers: comments and names of folders may end in one.
CONTINUED = re.compile(rb"^[ \t]*[vfl](?:[^\n\\#]|\\\r?\n|\\(?!\r?\n))*", re.MULTILINE)
JOINT = re.compile(rb"\\\r?\n")
KEPT = (b"vt", b"o", b"g", b"s", b"usemtl", b"mtllib")
OTHER_LINES = {"l": "polylines", "p": "points"}
AFTER_POSITION = re.compile(rb"(?<=\d)/\S*")  # a corner is position/texture/normal


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; without faces, the segments of lines; without both, none.

    Vertices are in the plane if all of them have two numbers.
    """
    positions: list[Line] = []
    # Each with the number of vertices before it
    cells: dict[bytes, list[tuple[Line, int]]] = {b"f": [], b"l": []}
    for number, text in lines_of(join_lines(data)):
        keyword = text.split(None, 1)[0]
        if keyword == b"v":
            positions.append((number, text[1:]))
        elif keyword in cells:
            line = (number, AFTER_POSITION.sub(b"", text[1:]))
            cells[keyword].append((line, len(positions)))
    vertices = coordinates(positions, least=2)
    table = whole_table([line for line, _ in cells[b"f"]])
    if table is not None and table.shape[1] >= 3 and (table > 0).all():
        return vertices, polygon_triangles(vertices, table - 1)
    kind, least, noun = b"l", 2, "polyline must have two points"
    if cells[b"f"]:
        kind, least, noun = b"f", 3, "face must have three corners"
    rows = []
    for line, count in cells[kind]:
        words = line[1].split()
        if len(words) < least:
            raise FileFormatError(f"A {noun} or more; line {line[0]} is {quote_line(line)}.")
        rows.append([corner_index(word, line, count) for word in words])
    if cells[b"f"]:
        return vertices, polygon_triangles(vertices, rows)
    pairs = [pair for row in rows for pair in pairwise(row)]
    return vertices, np.array(pairs, dtype=np.int64).reshape(-1, 2)


def join_lines(data: bytes) -> bytes:
    """Join lines of numbers that end in a backslash with the next line; keep all line numbers."""

    def join_match(match: re.Match[bytes]) -> bytes:
        text, n_joints = JOINT.subn(b" ", match[0])
        return text + b"\n" * n_joints  # lines that follow keep their numbers

    return CONTINUED.sub(join_match, data) if JOINT.search(data) else data


def corner_index(word: bytes, line: Line, n_so_far: int) -> int:
    """Return the vertex of a corner, from 0, if `n_so_far` vertices precede it.

    Raise FileFormatError if there is no such vertex, or a negative index goes back beyond the
    first.
    """
    index = whole(word, line, "A corner")
    if index == 0 or index < -n_so_far:
        raise FileFormatError(
            f"A corner must count vertices from 1, or back from -1; line {line[0]} is {quote_line(line)} "
            f"after {n_so_far} vertices."
        )
    return index - 1 if index > 0 else n_so_far + index


@record
class ObjSheet:
    """The content of an OBJ file that a triangle mesh does not store.

    Comments are dropped. Normals are kept to tell where creases are.

    Attributes
    ----------
    vertices : (n, 3) float
    tails : tuple of str
        For each vertex, the text after its coordinates: a weight or a color.
    normals : tuple
        Three numbers each.
    corners : (k, 3) int
        Of all polygons: a vertex, its texture coordinate from 1 or 0 for none, and its normal from
        0 or -1 for none.
    starts : (p + 1,) int
        Polygon i has the corners from start i to start i + 1.
    rows : tuple
        Lines to copy, and numbers of polygons, in the order of the file.
    dropped : tuple of str
        Kinds of lines that are not kept.
    """

    vertices: Float[np.ndarray, "n 3"]
    tails: tuple[str, ...]
    normals: tuple[tuple[float, ...], ...]
    corners: Int[np.ndarray, "k 3"]
    starts: Int[np.ndarray, " p1"]
    rows: tuple[str | int, ...]
    dropped: tuple[str, ...]


def read_sheet(data: bytes) -> ObjSheet:
    """Read an OBJ file with its polygons, textures and groups.

    Raise FileFormatError if a vertex or a face cannot be read.
    """
    positions: list[Line] = []
    tails: list[str] = []
    corners: list[tuple[int, int, int]] = []
    starts = [0]
    rows: list[str | int] = []
    normals: list[Line] = []
    dropped: set[str] = set()
    n_textures = 0
    for number, raw in enumerate(join_lines(data.removeprefix(codecs.BOM_UTF8)).splitlines(), 1):
        text = raw.partition(b"#")[0].strip()
        keyword = text.split(None, 1)[0] if text else b""
        if keyword == b"v":
            positions.append((number, text[1:]))
            tails.append(" ".join(word.decode("latin-1") for word in text.split()[4:]))
        elif keyword == b"f":
            rows.append(len(starts) - 1)
            line = (number, text[1:])
            counts = (len(positions), n_textures, len(normals))
            corners += (_corner(word, line, counts) for word in text.split()[1:])
            starts.append(len(corners))
        elif keyword == b"vn":
            normals.append((number, text[2:]))
        elif keyword in KEPT:
            n_textures += keyword == b"vt"
            rows.append(raw.strip().decode("latin-1"))  # names may contain #
        elif keyword:
            kind = keyword.decode("latin-1")[:20]
            dropped.add(OTHER_LINES.get(kind, f"lines that begin with {kind!r}"))
    table = np.array(corners, dtype=np.int64).reshape(-1, 3)
    # A corner whose normal the file does not hold has none.
    table[(table[:, 2] < 0) | (table[:, 2] >= len(normals)), 2] = -1
    return ObjSheet(
        coordinates(positions),
        tuple(tails),
        tuple(map(tuple, coordinates(normals).tolist())),
        table,
        np.array(starts),
        tuple(rows),
        tuple(sorted(dropped)),
    )


def _corner(word: bytes, line: Line, counts: tuple[int, int, int]) -> tuple[int, int, int]:
    """Read a corner, after so many vertices, texture coordinates and normals."""
    position, texture, normal = (*word.split(b"/"), b"", b"")[:3]
    vertex = corner_index(position, line, counts[0])
    place = whole(texture or b"0", line, "A texture coordinate")
    number = whole(normal or b"0", line, "A normal")
    place = place if place >= 0 else counts[1] + 1 + place
    number = number if number >= 0 else counts[2] + 1 + number
    return vertex, place, number - 1
