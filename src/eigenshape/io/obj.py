"""Wavefront OBJ: positions and faces; texture seams, normals, groups and materials are passed over."""

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.text import Line, coordinates, fans, lines_of, rows_text, shown, whole


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces; polygons become fans."""
    lines = lines_of(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" "))
    positions: list[Line] = []
    polygons = []
    for line in lines:
        if line.words[0] == "v":
            positions.append(line)
        elif line.words[0] == "f":
            polygons.append(_corners(line, len(positions)))
    vertices = coordinates(positions, skip=1)
    if not polygons:
        raise FileFormatError(f"An OBJ file must hold faces; it holds {len(vertices)} points and no face.")
    return vertices, fans(polygons)


def _corners(line: Line, n_so_far: int) -> list[int]:
    if len(line.words) < 4:
        raise FileFormatError(f"A face must have three corners or more; line {line.number} is {shown(line.words)}.")
    return [_index(word.partition("/")[0], line, n_so_far) for word in line.words[1:]]


def _index(word: str, line: Line, n_so_far: int) -> int:
    index = whole(word, line.number, "A corner")
    if index == 0 or index < -n_so_far:
        raise FileFormatError(
            f"A corner must count vertices from 1, or back from -1; line {line.number} is {shown(line.words)} "
            f"after {n_so_far} vertices."
        )
    return index - 1 if index > 0 else n_so_far + index


def format_mesh(mesh: TriangleMesh) -> bytes:
    """Write a mesh so that it reads back exactly."""
    lines = [*rows_text("v ", mesh.vertices), *rows_text("f ", mesh.faces + 1)]
    return ("\n".join(lines) + "\n").encode()
