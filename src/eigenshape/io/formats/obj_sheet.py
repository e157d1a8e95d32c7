"""Rewriting of OBJ files for a changed mesh, with their polygons, textures and groups."""

import codecs
from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

from eigenshape.geometry.measure import area_vectors
from eigenshape.io.attributes import MeshAttributes, unit_rows
from eigenshape.io.formats.cells import fans
from eigenshape.io.formats.obj import corner_index, join_lines
from eigenshape.io.formats.text import (
    Line,
    coordinates,
    rows_text,
    whole,
)

KEPT = (b"vt", b"o", b"g", b"s", b"usemtl", b"mtllib")
OTHER_LINES = {"l": "polylines", "p": "points"}
ORDERS = tuple(permutations(range(3)))
TURNED = ((0, 2, 1), (1, 0, 2), (2, 1, 0))  # the permutations in ORDERS that reverse a face
# A vertex, "/7" where it has the texture coordinate 7, and the number of its normal or -1.
Corner = tuple[int, str, int]
# New vertices, the corners of the file that they belong to, and whether their order is reversed.
Piece = tuple[Sequence[int], Sequence[Corner], bool]


@dataclass(frozen=True, eq=False)
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
    polygons : tuple
        The corners of each face.
    rows : tuple
        Lines to copy, and numbers of polygons, in the order of the file.
    dropped : tuple of str
        Kinds of lines that are not kept.
    """

    vertices: Float[np.ndarray, "n 3"]
    tails: tuple[str, ...]
    normals: tuple[tuple[float, ...], ...]
    polygons: tuple[tuple[Corner, ...], ...]
    rows: tuple[str | int, ...]
    dropped: tuple[str, ...]


def read_sheet(data: bytes) -> ObjSheet:
    """Read an OBJ file with its polygons, textures and groups.

    Raises
    ------
    FileFormatError
        If a vertex or a face cannot be read.
    """
    positions: list[Line] = []
    tails: list[str] = []
    polygons: list[tuple[Corner, ...]] = []
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
            rows.append(len(polygons))
            line = (number, text[1:])
            counts = (len(positions), n_textures, len(normals))
            corners = (_corner(word, line, counts) for word in text.split()[1:])
            polygons.append(tuple(corners))
        elif keyword == b"vn":
            normals.append((number, text[2:]))
        elif keyword in KEPT:
            n_textures += keyword == b"vt"
            rows.append(raw.strip().decode("latin-1"))  # names may contain #
        elif keyword:
            kind = keyword.decode("latin-1")[:20]
            dropped.add(OTHER_LINES.get(kind, f"lines that begin with {kind!r}"))
    return ObjSheet(
        coordinates(positions),
        tuple(tails),
        tuple(map(tuple, coordinates(normals).tolist())),
        # A corner whose normal the file does not hold has none.
        tuple(
            tuple((v, t, n if 0 <= n < len(normals) else -1) for v, t, n in polygon)
            for polygon in polygons
        ),
        tuple(rows),
        tuple(sorted(dropped)),
    )


def _corner(word: bytes, line: Line, counts: tuple[int, int, int]) -> Corner:
    """Read a corner, after so many vertices, texture coordinates and normals."""
    position, texture, normal = (*word.split(b"/"), b"", b"")[:3]
    vertex = corner_index(position, line, counts[0])
    place = whole(texture, line, "A texture coordinate") if texture else 0
    number = whole(normal, line, "A normal") if normal else 0
    return (
        vertex,
        f"/{place if place > 0 else counts[1] + 1 + place}" if texture else "",
        (number - 1 if number > 0 else counts[2] + number) if normal else -1,
    )


def format_sheet(
    sheet: ObjSheet, attributes: MeshAttributes, moved: Float[np.ndarray, "k 3"]
) -> bytes:
    """Write a repaired or deformed mesh with the remaining polygons, textures and groups.

    A polygon is kept if all its triangles still exist. Otherwise its remaining triangles are
    written. Triangles that the file does not have, such as those of a filled hole, come last.

    Parameters
    ----------
    sheet : ObjSheet
        The content of the file that the mesh was read from.
    attributes : MeshAttributes
        Of the mesh after repairs, which do not move vertices.
    moved : (k, 3) float
        Coordinates to write.
    """
    mesh = attributes.mesh
    places, old_places, new_places = _places(sheet.vertices, mesh.vertices)
    first = np.full(places, -1)
    first[old_places[::-1]] = np.arange(len(old_places))[::-1]
    sources = first[new_places]
    shared = min(len(old_places), len(new_places))
    stayed = old_places[:shared] == new_places[:shared]
    sources[:shared][stayed] = np.arange(shared)[stayed]
    tails = [sheet.tails[source] if source >= 0 else "" for source in sources]
    vertices = rows_text("v ", moved)
    lines = [f"{row} {tail}".rstrip() for row, tail in zip(vertices, tails, strict=True)]

    triangles, added = _match_triangles(sheet, mesh.faces, old_places, new_places)
    rows: list[str | list[Corner]] = []
    for line in sheet.rows:
        rows += [line] if isinstance(line, str) else _pieces(sheet.polygons[line], triangles[line])
    n_textures = sum(
        isinstance(line, str) and line.split(None, 1)[0] == "vt" for line in sheet.rows
    )
    for face in added:
        group, material = attributes.face_groups[face], attributes.face_materials[face]
        rows += [f"g {_latin(attributes.groups[group])}"] if group >= 0 else []
        rows += [f"usemtl {_latin(attributes.materials[material].name)}"] if material >= 0 else []
        textures = [""] * 3
        if attributes.texture_coordinates is not None:
            rows += rows_text("vt ", attributes.texture_coordinates[face])
            textures = [f"/{n_textures + number}" for number in (1, 2, 3)]
            n_textures += 3
        corners = zip(mesh.faces[face].tolist(), textures, strict=True)
        rows.append([(vertex, texture, -1) for vertex, texture in corners])
    normals, numbers = _normals(sheet, rows, moved)
    lines += rows_text("vn ", normals)
    for row in rows:
        if isinstance(row, str):
            lines.append(row)
            continue
        lines.append("f")
        for vertex, texture, normal in row:
            number = numbers.get((vertex, sheet.normals[normal])) if normal >= 0 else None
            tail = "" if number is None else f"{'' if texture else '/'}/{number + 1}"
            lines[-1] += f" {vertex + 1}{texture}{tail}"
    return ("\n".join(lines) + "\n").encode("latin-1")


def _latin(name: str) -> str:
    """Return a name as its bytes stand in a sheet."""
    return name.encode().decode("latin-1")


def _normals(
    sheet: ObjSheet, rows: Sequence[str | list[Corner]], vertices: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "m 3"], dict[tuple[int, tuple[float, ...]], int]]:
    """Compute a normal for each vertex and each normal that it had, so that creases stay."""
    numbers: dict[tuple[int, tuple[float, ...]], int] = {}
    owners, triangles = [], []
    for row in rows:
        if isinstance(row, str):
            continue
        corners = fans([[vertex for vertex, _, _ in row]]).tolist()
        for vertex, _, normal in row:
            if normal >= 0:
                key = (vertex, sheet.normals[normal])
                number = numbers.setdefault(key, len(numbers))
                triangles += corners
                owners += [number] * len(corners)
    if not numbers:
        return np.empty((0, 3)), numbers
    vectors = area_vectors(vertices[np.array(triangles)])
    sums = np.column_stack([np.bincount(owners, weights=column) for column in vectors.T])
    units, old = unit_rows(sums), np.array([normal for _, normal in numbers])
    return np.where(units.any(axis=1, keepdims=True), units, old), numbers


def _places(
    old: np.ndarray, new: np.ndarray
) -> tuple[int, Int[np.ndarray, " n"], Int[np.ndarray, " k"]]:
    """Return how many places there are at which vertices lie, and that of each old and each new vertex."""
    # Adding 0.0 makes -0.0 equal to 0.0.
    distinct, numbers = np.unique(np.concatenate([old, new]) + 0.0, axis=0, return_inverse=True)
    return len(distinct), numbers.ravel()[: len(old)], numbers.ravel()[len(old) :]


Triangles = list[
    tuple[Sequence[int], bool] | None
]  # of a polygon: new corners and whether it is turned, or none


def _match_triangles(
    sheet: ObjSheet,
    faces: Int[np.ndarray, "f 3"],
    old_places: Int[np.ndarray, " n"],
    new_places: Int[np.ndarray, " k"],
) -> tuple[list[Triangles], list[int]]:
    """Find the face of each triangle of each polygon, by place, and the numbers of faces of no polygon."""
    by_places: defaultdict[tuple[int, ...], deque[int]] = defaultdict(deque)
    for face, places in enumerate(np.sort(new_places[faces], axis=1).tolist()):
        by_places[tuple(places)].append(face)
    found: list[Triangles] = []
    for polygon in sheet.polygons:
        corners = [vertex for vertex, _, _ in polygon]
        triangles: Triangles = []
        for index in range(1, len(corners) - 1):
            wanted = old_places[[corners[0], corners[index], corners[index + 1]]].tolist()
            left = by_places[tuple(sorted(wanted))]
            corners_of = faces[left.popleft()].tolist() if left else None
            triangles.append(corners_of and _fit_corners(corners_of, wanted, new_places))
        found.append(triangles)
    return found, [face for left in by_places.values() for face in left]


def _fit_corners(
    face: list[int], wanted: list[int], places: Int[np.ndarray, " k"]
) -> tuple[Sequence[int], bool]:
    """Permute the corners of a face into the order of the given places."""
    orders = (
        order for order in ORDERS if places[[face[place] for place in order]].tolist() == wanted
    )
    order = next(orders)  # the sorted places agree, so there is one
    return [face[place] for place in order], order in TURNED


def _pieces(polygon: Sequence[Corner], triangles: Triangles) -> list[list[Corner]]:
    """Return the remaining part of a polygon: the whole, perhaps reversed, or some triangles."""
    whole_polygon = _whole(triangles)
    if whole_polygon is not None:
        pieces: list[Piece] = [(whole_polygon[0], polygon, whole_polygon[1])]
    else:
        pieces = [
            (triangle[0], (polygon[0], polygon[index], polygon[index + 1]), triangle[1])
            for index, triangle in enumerate(triangles, 1)
            if triangle is not None
        ]
    rows = []
    for vertices, old, is_turned in pieces:
        corners = [(new, *corner[1:]) for new, corner in zip(vertices, old, strict=True)]
        rows.append([corners[0], *corners[:0:-1]] if is_turned else corners)
    return rows


def _whole(triangles: Triangles) -> tuple[list[int], bool] | None:
    """Return the corners of a polygon with all its triangles; None if one is missing or reversed.

    Triangles that are all reversed make a reversed polygon.
    """
    if not triangles or triangles[0] is None:
        return None
    vertices, is_turned = [*triangles[0][0][:2]], triangles[0][1]
    for triangle in triangles:
        if (
            triangle is None
            or triangle[1] != is_turned
            or [*triangle[0][:2]] != [vertices[0], vertices[-1]]
        ):
            return None
        vertices.append(triangle[0][2])
    return vertices, is_turned
