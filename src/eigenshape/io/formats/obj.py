"""Wavefront OBJ: positions and faces. `obj_attributes` reads the rest."""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cells import fans
from eigenshape.io.formats.text import (
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
AFTER_POSITION = re.compile(rb"(?<=\d)/\S*")  # a corner is position/texture/normal


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; without faces, the segments of lines; without both, none.

    Vertices are in the plane if all of them have two numbers.
    """
    positions: list[Line] = []
    polygons: list[Line] = []
    polylines: list[Line] = []
    n_so_far: dict[bytes, list[int]] = {b"f": [], b"l": []}
    for number, text in lines_of(join_lines(data)):
        keyword = text.split(None, 1)[0]
        if keyword == b"v":
            positions.append((number, text[1:]))
        elif keyword == b"f":
            polygons.append((number, AFTER_POSITION.sub(b"", text[1:])))
            n_so_far[keyword].append(len(positions))
        elif keyword == b"l":
            polylines.append((number, AFTER_POSITION.sub(b"", text[1:])))
            n_so_far[keyword].append(len(positions))
    vertices = coordinates(positions, least=2)
    return vertices, _triangles(polygons, n_so_far[b"f"]) if polygons else _segments(
        polylines, n_so_far[b"l"]
    )


def join_lines(data: bytes) -> bytes:
    """Join lines of numbers that end in a backslash with the next line; keep all line numbers."""
    return CONTINUED.sub(_join_match, data) if JOINT.search(data) else data


def _join_match(match: re.Match[bytes]) -> bytes:
    text, n_joints = JOINT.subn(b" ", match[0])
    return text + b"\n" * n_joints  # lines that follow keep their numbers


def _triangles(polygons: Sequence[Line], n_so_far: Sequence[int]) -> np.ndarray:
    table = whole_table(polygons)
    if table is not None and table.shape[1] >= 3 and (table > 0).all():
        return fans(table - 1)
    return fans([_corners(line, count) for line, count in zip(polygons, n_so_far, strict=True)])


def _corners(line: Line, n_so_far: int) -> list[int]:
    words = line[1].split()
    if len(words) < 3:
        raise FileFormatError(
            f"A face must have three corners or more; line {line[0]} is {quote_line(line)}."
        )
    return [corner_index(word, line, n_so_far) for word in words]


def _segments(polylines: Sequence[Line], n_so_far: Sequence[int]) -> np.ndarray:
    pairs: list[tuple[int, int]] = []
    for line, count in zip(polylines, n_so_far, strict=True):
        places = [corner_index(word, line, count) for word in line[1].split()]
        if len(places) < 2:
            raise FileFormatError(
                f"A polyline must have two points or more; line {line[0]} is {quote_line(line)}."
            )
        pairs += pairwise(places)
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def corner_index(word: bytes, line: Line, n_so_far: int) -> int:
    """Return the vertex of a corner, from 0, if `n_so_far` vertices precede it.

    Raises
    ------
    FileFormatError
        If there is no such vertex, or a negative index goes back beyond the first.
    """
    index = whole(word, line, "A corner")
    if index == 0 or index < -n_so_far:
        raise FileFormatError(
            f"A corner must count vertices from 1, or back from -1; line {line[0]} is {quote_line(line)} "
            f"after {n_so_far} vertices."
        )
    return index - 1 if index > 0 else n_so_far + index
