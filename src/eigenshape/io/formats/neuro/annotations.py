"""Annotation and label files of FreeSurfer: parcels with names and colors, and one parcel as a list of vertices.

Read: annotations of versions 1 and 2, and labels.
Kept: names, colors and opacity of parcels.
Named: parcels of one color, black and transparent ones; points without a vertex.
Refused: an annotation without its table of colors; writing parcels of one color.
"""

from typing import Any

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape._arrays import find_keys
from eigenshape.features.parcellation import Parcellation
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import NO_PARCEL, find_labels, shared_keys
from eigenshape.io.formats.numbers import Cursor, coordinates, lines_of, whole, wholes

WHAT = "An annotation file"
PACKING = np.array([1, 2**8, 2**16])  # of red, green and blue into the number of a parcel
OPAQUE = 255.0  # full opacity of a color in bytes; files have the transparency, 255 - opacity


def parse_parcels(data: bytes, mesh: TriangleMesh) -> tuple[Any, ...]:
    """Return the parcels of an annotation, or the one of a label file of a mesh; and notes."""
    if data.startswith(b"#!ascii"):
        return _parse_label(data, mesh.n_vertices)
    cursor = Cursor(data, WHAT)

    def take_whole() -> int:
        return cursor.one(">i4")

    def take_text() -> str:
        size = take_whole()
        return cursor.take(">u1", size).tobytes().rstrip(b"\0").decode("utf-8", "replace")

    n_vertices = take_whole()
    rows = cursor.wholes(">i4", 2 * n_vertices).reshape(-1, 2)
    vertices, values = rows[np.argsort(rows[:, 0])].T
    odd = np.flatnonzero(vertices != np.arange(n_vertices))
    if odd.size:
        raise FileFormatError(
            f"{WHAT} must list each of its {n_vertices} vertices once; it does not list {odd[0]} once."
        )
    if cursor.place == len(data) or take_whole() != 1:
        raise FileFormatError(
            f"{WHAT} must have a table of names and colors after its {n_vertices} vertices; it has none."
        )
    # Version 2 has -2, then the largest number, and a number before each name; version 1 has its
    # number of parcels.
    n_parcels = take_whole()
    is_new = n_parcels < 0
    if n_parcels < -1 and n_parcels != -2:
        raise FileFormatError(f"The version of {WHAT} must be 1 or 2; it is {-n_parcels}.")
    if is_new:
        take_whole()
    take_text()  # where the table is from
    n_parcels = take_whole() if is_new else n_parcels
    names, colors = [], []
    for _ in range(n_parcels):
        if is_new:
            take_whole()
        names.append(take_text())
        colors.append(cursor.wholes(">i4", 4))
    table = np.array(colors).reshape(-1, 4)
    bad = np.flatnonzero(((table < 0) | (table > OPAQUE)).any(axis=1))
    if bad.size:
        raise FileFormatError(
            f"Colors of {WHAT} must lie in 0..255; that of {names[bad[0]]!r} is {table[bad[0]].tolist()}."
        )
    keys = table[:, :3] @ PACKING
    found = find_labels("Colors of an annotation file", keys, values)
    notes = shared_keys("colors", keys, names, values[values != 0])
    # The number 0 is that of black, and of vertices in no parcel; nibabel and FreeSurfer's tools
    # take it for the latter.
    black = np.flatnonzero((values == 0) & (found >= 0))
    if black.size and names[found[black[0]]].lower() not in ("unknown", NO_PARCEL):
        notes.append(
            f"black stands for no parcel in an annotation, and it is the color of "
            f"{names[found[black[0]]]!r}: its {black.size} vertices have the label -1"
        )
    found[values == 0] = -1
    hidden = np.intersect1d(found, np.flatnonzero(table[:, 3] == OPAQUE))
    if hidden.size:
        notes.append(
            f"the last number of a color in an annotation is its transparency, and that of "
            f"{names[hidden[0]]!r} is 255 ({hidden.size} such), so it has the opacity 0. If opacity was "
            "meant, set it to 1 in a copy of the colors, and make a Parcellation with that"
        )
    rgba = np.column_stack([table[:, :3], OPAQUE - table[:, 3]]) / OPAQUE
    return Parcellation(found, tuple(names), rgba), *notes


def _parse_label(data: bytes, n_points: int) -> tuple[Any, ...]:
    lines = lines_of(data)  # the first line is a comment
    count = whole(lines[0][1], lines[0], "The number of vertices") if lines else -1
    if count != len(lines) - 1:
        raise FileFormatError(
            f"A label file must hold as many vertices as it declares; it declares {count} and holds "
            f"{max(len(lines) - 1, 0)}."
        )
    numbers = coordinates(lines[1:])[:, 0] if count else np.empty(0)
    vertices = wholes(numbers, "Vertices of a label file")
    bad = np.flatnonzero((vertices < -1) | (vertices >= n_points))
    if bad.size:
        raise FileFormatError(
            f"A label file must belong to the surface, whose vertices are 0..{n_points - 1}; it "
            f"lists {vertices[bad[0]]}."
        )
    # Points of a volume that FreeSurfer has not assigned to vertices. Their places are no help: they
    # are those on one surface, such as the white one, and the mesh may be another.
    n_loose = int((vertices < 0).sum())
    notes = [f"{n_loose} of its {count} points have no vertex, but -1, and are left out"]
    labels = np.full(n_points, -1)
    labels[vertices[vertices >= 0]] = 0
    return Parcellation(labels, ("label",)), *notes[: n_loose > 0]


def format_parcels(mesh: TriangleMesh, parcellation: Parcellation, suffix: str) -> bytes:
    """Write an annotation, or the one parcel of a label file."""
    if suffix == ".label":
        if len(parcellation.names) != 1:
            raise FileFormatError(
                f"A label file holds one parcel; there are {len(parcellation.names)}. Write .annot."
            )
        (vertices,) = np.nonzero(parcellation.labels == 0)
        rows = [
            f"{vertex} {x!r} {y!r} {z!r} 0.0"
            for vertex, (x, y, z) in zip(vertices, mesh.vertices[vertices].tolist(), strict=True)
        ]
        return "\n".join(["#!ascii label", str(len(rows)), *rows, ""]).encode()
    table = np.rint(OPAQUE * parcellation.colors).astype(np.int64)
    table[:, 3] = OPAQUE - table[:, 3]
    keys = table[:, :3] @ PACKING
    firsts = find_keys(keys, keys)
    bad = np.flatnonzero((firsts != np.arange(len(keys))) | (keys == 0))
    if bad.size:
        twin = firsts[bad[0]]
        raise FileFormatError(
            f"Parcels of {WHAT} must differ in their colors, and none is black; that of "
            f"{parcellation.names[twin]!r} is {table[twin, :3].tolist()}. Write .label.gii, which keeps "
            "any colors."
        )
    of_vertices = np.where(parcellation.labels < 0, 0, np.append(keys, 0)[parcellation.labels])

    def numbers(*values: int) -> bytes:
        return np.array(values, ">i4").tobytes()

    def text(name: str) -> bytes:
        word = name.encode() + b"\0"
        return numbers(len(word)) + word

    pairs = np.column_stack([np.arange(mesh.n_vertices), of_vertices]).astype(">i4").tobytes()
    head = numbers(1, -2, len(keys)) + text("eigenshape") + numbers(len(keys))
    entries = [
        numbers(number) + text(name) + numbers(*color)
        for number, (name, color) in enumerate(zip(parcellation.names, table.tolist(), strict=True))
    ]
    return numbers(mesh.n_vertices) + pairs + head + b"".join(entries)
