"""Rewriting of OBJ files for a changed mesh, with their polygons, textures and groups."""

import codecs
from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.obj import corner_index, join_lines
from eigenshape.io.text import Line, coordinates, rows_text, whole

KEPT = (b"vt", b"o", b"g", b"s", b"usemtl", b"mtllib")
ORDERS = tuple(permutations(range(3)))
TURNED = ((0, 2, 1), (1, 0, 2), (2, 1, 0))  # the permutations in ORDERS that reverse a face
Corner = tuple[int, str]  # a vertex, and "/7" where it has the texture coordinate 7


@dataclass(frozen=True, eq=False)
class ObjSheet:
    """The content of an OBJ file that a triangle mesh does not store.

    Normals, points, polylines and comments are dropped; normals are wrong after a change.

    Attributes
    ----------
    vertices : (n, 3) float
    tails : tuple of str
        For each vertex, the text after its coordinates: a weight or a color.
    polygons : tuple
        The corners of each face.
    rows : tuple
        Lines to copy, and numbers of polygons, in the order of the file.
    """

    vertices: Float[np.ndarray, "n 3"]
    tails: tuple[str, ...]
    polygons: tuple[tuple[Corner, ...], ...]
    rows: tuple[str | int, ...]


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
            corners = (_corner(word, line, len(positions), n_textures) for word in text.split()[1:])
            polygons.append(tuple(corners))
        elif keyword in KEPT:
            n_textures += keyword == b"vt"
            rows.append(raw.strip().decode("latin-1"))  # names may contain #
    return ObjSheet(coordinates(positions), tuple(tails), tuple(polygons), tuple(rows))


def _corner(word: bytes, line: Line, n_vertices: int, n_textures: int) -> Corner:
    position, _, rest = word.partition(b"/")
    texture = rest.partition(b"/")[0]
    vertex = corner_index(position, line, n_vertices)
    if not texture:
        return vertex, ""
    place = whole(texture, line, "A texture coordinate")
    return vertex, f"/{place if place > 0 else n_textures + 1 + place}"


def format_sheet(
    sheet: ObjSheet, mesh: TriangleMesh, moved: Float[np.ndarray, "k 3"] | None = None
) -> bytes:
    """Write a repaired or deformed mesh with the remaining polygons, textures and groups.

    A polygon is kept if all its triangles still exist. Otherwise its remaining triangles are
    written. Triangles that the file does not have, such as those of a filled hole, come last and
    have no texture.

    Parameters
    ----------
    sheet : ObjSheet
        The content of the file that the mesh was read from.
    mesh : TriangleMesh
        The mesh after repairs, which do not move vertices.
    moved : (k, 3) float, optional
        Coordinates to write instead of those of the mesh.
    """
    places, old_places, new_places = _places(sheet.vertices, mesh.vertices)
    first = np.full(places, -1)
    first[old_places[::-1]] = np.arange(len(old_places))[::-1]
    sources = first[new_places]
    shared = min(len(old_places), len(new_places))
    stayed = old_places[:shared] == new_places[:shared]
    sources[:shared][stayed] = np.arange(shared)[stayed]
    tails = [sheet.tails[source] if source >= 0 else "" for source in sources]
    vertices = rows_text("v ", mesh.vertices if moved is None else moved)
    lines = [f"{row} {tail}".rstrip() for row, tail in zip(vertices, tails, strict=True)]

    triangles, added = _match_triangles(sheet, mesh.faces, old_places, new_places)
    for row in sheet.rows:
        lines += (
            [row] if isinstance(row, str) else _polygon_rows(sheet.polygons[row], triangles[row])
        )
    return ("\n".join([*lines, *rows_text("f ", added + 1)]) + "\n").encode("latin-1")


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
) -> tuple[list[Triangles], Int[np.ndarray, "a 3"]]:
    """Find the face of each triangle of each polygon, by place, and the faces of no polygon."""
    by_places: defaultdict[tuple[int, ...], deque[list[int]]] = defaultdict(deque)
    for face, places in zip(
        faces.tolist(), np.sort(new_places[faces], axis=1).tolist(), strict=True
    ):
        by_places[tuple(places)].append(face)
    found: list[Triangles] = []
    for polygon in sheet.polygons:
        corners = [vertex for vertex, _ in polygon]
        triangles: Triangles = []
        for index in range(1, len(corners) - 1):
            wanted = old_places[[corners[0], corners[index], corners[index + 1]]].tolist()
            left = by_places[tuple(sorted(wanted))]
            triangles.append(_fit_corners(left.popleft(), wanted, new_places) if left else None)
        found.append(triangles)
    added = [face for left in by_places.values() for face in left]
    return found, np.array(added, dtype=np.int64).reshape(-1, 3)


def _fit_corners(
    face: list[int], wanted: list[int], places: Int[np.ndarray, " k"]
) -> tuple[Sequence[int], bool]:
    """Permute the corners of a face into the order of the given places."""
    orders = (
        order for order in ORDERS if places[[face[place] for place in order]].tolist() == wanted
    )
    order = next(orders)  # the sorted places agree, so there is one
    return [face[place] for place in order], order in TURNED


def _polygon_rows(polygon: Sequence[Corner], triangles: Triangles) -> list[str]:
    """Write the remaining part of a polygon: the whole, perhaps reversed, or some triangles."""
    textures = [texture for _, texture in polygon]
    whole_polygon = _whole(triangles)
    if whole_polygon is not None:
        vertices, is_turned = whole_polygon
        pieces = [([*zip(vertices, textures, strict=True)], is_turned)]
    else:
        pieces = []
        for index, triangle in enumerate(triangles, 1):
            if triangle is not None:
                of_corners = (textures[0], textures[index], textures[index + 1])
                pieces.append(([*zip(triangle[0], of_corners, strict=True)], triangle[1]))
    rows = []
    for corners, is_turned in pieces:
        turned = [corners[0], *corners[:0:-1]] if is_turned else corners
        rows.append("f " + " ".join(f"{vertex + 1}{texture}" for vertex, texture in turned))
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
