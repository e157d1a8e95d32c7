"""Attributes of OBJ files: read with their materials and images, and written with them."""

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from certeig.kit.files import read_regular
from eigenshape._vectors import area_vectors, sum_rows, unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.polygons import cut_polygons
from eigenshape.io.attributes import Material, MeshAttributes, WriteJob, corner_normals
from eigenshape.io.formats.numbers import end_lines, rows_text
from eigenshape.io.formats.obj import ObjSheet, read_sheet
from eigenshape.io.opening import SourceFile

MAP = re.compile(r"(?im)^([ \t]*(?:map_\w+|bump|disp|decal|norm|refl)[ \t]+)(.+?)[ \t\r]*$")
PLAIN_MATERIAL = {"newmtl", "kd", "d", "tr", "map_kd", "ka", "ke", "ks", "ns", "ni", "illum"}
Files = dict[Path, bytes]  # to write, by path


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the attributes of an OBJ file, by face as in the mesh that was read."""
    sheet = read_sheet(source.data)
    coordinates = np.array(
        [[*map(float, row.split()[1:3]), 0.0][:2] for row in _rows(sheet, "vt")] or [[0.0, 0.0]]
    )
    places, polygon_of = _cut_polygons(sheet)
    _, textures, normals = np.moveaxis(sheet.corners[places], 2, 0)
    if textures.max() > len(coordinates):
        raise FileFormatError(
            f"A corner must name one of {len(coordinates)} texture coordinates; one names {textures.max()}."
        )
    groups, face_groups = _switches(sheet, ("g ", "o "))
    names, face_materials = _switches(sheet, ("usemtl ",))
    defined, others = _read_materials(sheet, source)
    if len(places) >= len(sheet.starts):
        others.append("polygons, of which triangles are made")
    if _rows(sheet, "o") and _rows(sheet, "g"):
        others.append("names of objects beside those of groups")
    if _rows(sheet, "s"):
        others.append("smoothing groups")
    others += sheet.dropped
    has_normals = (normals >= 0).any()
    return replace(
        MeshAttributes.plain(mesh),
        face_materials=face_materials[polygon_of],
        face_groups=face_groups[polygon_of],
        texture_coordinates=coordinates[textures - 1] if textures.any() else None,
        normals=np.array([*sheet.normals, (0.0, 0.0, 0.0)])[normals] if has_normals else None,
        colors=_colors(sheet, mesh),
        materials=tuple(defined.get(name, Material(_unicode(name))) for name in names),
        groups=tuple(map(_unicode, groups)),
        others=tuple(others),
        source=source,
    )


def _cut_polygons(sheet: ObjSheet) -> tuple[Int[np.ndarray, "f 3"], Int[np.ndarray, " f"]]:
    """Return three places among the corners of a sheet for each triangle, and its polygon."""
    points = sheet.vertices[sheet.corners[:, 0]]
    return cut_polygons(points, sheet.starts, np.arange(len(points)))[:2]


def _rows(sheet: ObjSheet, keyword: str) -> list[str]:
    return [row for row in sheet.rows if isinstance(row, str) and row.split(None, 1)[0] == keyword]


def _switches(sheet: ObjSheet, keywords: tuple[str, ...]) -> tuple[list[str], np.ndarray]:
    """Return the names that lines switch to, and the number of that of each polygon."""
    names: dict[str, int] = {}
    current, numbers = -1, []
    for row in sheet.rows:
        if not isinstance(row, str):
            numbers.append(current)
        elif row.startswith(keywords):
            name = row.split(None, 1)[1].strip()
            current = names.setdefault(name, len(names))
    return list(names), np.array(numbers, dtype=np.int64)


def _colors(sheet: ObjSheet, mesh: TriangleMesh) -> np.ndarray | None:
    """Return the colors behind coordinates at corners, if there are any; white where there is none."""
    tails = [tail.split() for tail in sheet.tails]
    if 3 not in map(len, tails):
        return None
    rows = [[*tail, "1"] if len(tail) == 3 else ["1"] * 4 for tail in tails]
    shares = np.nan_to_num(np.array(rows, float)).clip(0, 1)
    return np.rint(255 * shares).astype(np.uint8)[mesh.faces]


def _unicode(name: str) -> str:
    """Return a name that was read byte by byte as text."""
    try:
        return name.encode("latin-1").decode()
    except UnicodeDecodeError:
        return name


def find_beside(name: str, folder: Path) -> Path | None:
    """Return the file that a line names: in or below the folder, or there by its name alone."""
    root = folder.resolve()
    for wanted in (name.replace("\\", "/"), re.split(r"[\\/]", name)[-1]):
        with suppress(
            ValueError, OSError, RuntimeError
        ):  # a zero byte, a long name, a loop of links
            path = (root / wanted).resolve()
            if path.is_relative_to(root) and path.exists() and not path.is_dir():
                return path
    return None


def _material_files(sheet: ObjSheet, source: SourceFile) -> tuple[str, list[str]]:
    """Return the text of all libraries of materials, and sentences about those that are missing."""
    text, missing = "", []
    for row in _rows(sheet, "mtllib"):
        rest = _unicode(row.split(None, 1)[1])
        whole = find_beside(rest, source.folder)
        for name in [rest] if whole else rest.split():
            path = find_beside(name, source.folder)
            if path is None:
                missing.append(f"the materials of {name!r}, which is not in the folder of the file")
            elif path.stat().st_size:
                text += read_regular(path, "materials").decode("latin-1") + "\n"
    return text, missing


def _find_image(rest: str, folder: Path, lost: list[str]) -> Path | None:
    """Return the image that a line of a material names, behind its options, or note that it is lost."""
    name = _unicode(rest)
    path = find_beside(name, folder) or find_beside(name.rsplit(maxsplit=1)[-1], folder)
    if path is None:
        lost.append(f"the image {rest[:80]!r}, which is not in the folder of the file")
    return path


def _read_materials(sheet: ObjSheet, source: SourceFile) -> tuple[dict[str, Material], list[str]]:
    text, lost = _material_files(sheet, source)
    found: dict[str, Material] = {}
    for block in re.split(r"(?im)^[ \t]*newmtl[ \t]+", text)[1:]:
        name, *rows = map(str.strip, block.splitlines())
        pairs = [row.split(None, 1) for row in rows if row and row[0] != "#"]
        values = {pair[0].lower(): pair[1] for pair in pairs if len(pair) > 1}
        if set(values) - PLAIN_MATERIAL:
            lost.append("properties of materials other than color and image")
        red, green, blue = ([float(x) for x in values.get("kd", "1 1 1").split()[:3]] * 3)[:3]
        clear = float(values.get("tr", "0").split()[-1])
        alpha = float(values["d"].split()[-1]) if "d" in values else 1.0 - clear
        image, image_name = None, ""
        if "map_kd" in values:
            path = _find_image(values["map_kd"], source.folder, lost)
            if path:
                image, image_name = read_regular(path, "an image"), path.name
        found[name] = Material(_unicode(name), (red, green, blue, alpha), image, image_name)
    return found, lost


def write(job: WriteJob) -> Files:
    """Write an OBJ file with its materials and images beside it: that of the source, or a new one."""
    held, source = job.attributes, job.attributes.source
    if not source or source.suffix != ".obj" or held.from_file.mean() <= 0.5:
        job.lose(["fields"])
        return write_new(held, job.mesh, job.path)
    sheet = read_sheet(source.data)
    data = format_sheet(sheet, held, job.mesh)
    job.lost.extend(sheet.dropped)
    if job.path.absolute().parent.resolve() == source.folder.resolve():
        return {job.path: data}
    text, missing = _material_files(sheet, source)
    job.lost.extend(missing)
    if not text:
        return {job.path: data}
    files: Files = {}

    def link(match: re.Match[str]) -> str:
        image = _find_image(match[2], source.folder, job.lost)
        if image is None:
            return match[0]
        copy = add_image(files, job.path, image.name, read_regular(image, "an image"))
        return match[1] + copy.name.encode().decode("latin-1")

    materials = job.path.with_suffix(".mtl")
    files[materials] = MAP.sub(link, text).encode("latin-1")
    library = f"mtllib {materials.name}\n".encode()
    files[job.path] = library + re.sub(rb"(?m)^mtllib[ \t].*\n", b"", data)
    return files


def format_sheet(sheet: ObjSheet, attributes: MeshAttributes, mesh: TriangleMesh) -> bytes:
    """Write a repaired or deformed mesh with the remaining polygons, textures and groups.

    A polygon is kept if all its triangles still exist, and are those that a reader would cut it
    into. Otherwise its remaining triangles are written. Triangles that the file does not have, such
    as those of a filled hole, come last.

    Parameters
    ----------
    sheet : ObjSheet
        The content of the file that the attributes were read from.
    attributes : MeshAttributes
        Of the mesh after repairs.
    mesh : TriangleMesh
        The same faces, with the vertices to write.
    """
    rows, added = _remaining_rows(sheet, attributes, mesh)
    n_textures = len(_rows(sheet, "vt"))
    for face in added:
        group, material = attributes.face_groups[face], attributes.face_materials[face]
        rows += [f"g {_latin(attributes.groups[group])}"] if group >= 0 else []
        rows += [f"usemtl {_latin(attributes.materials[material].name)}"] if material >= 0 else []
        textures = [0, 0, 0]
        if attributes.texture_coordinates is not None:
            rows += rows_text("vt ", attributes.texture_coordinates[face])
            textures = [n_textures + number for number in (1, 2, 3)]
            n_textures += 3
        vertices = mesh.faces[face].tolist()
        rows.append([[*corner, -1] for corner in zip(vertices, textures, strict=True)])

    lines = _vertex_lines(sheet, attributes, mesh)
    faces = [content for content in rows if not isinstance(content, str)]
    normals, numbers = _normals(sheet, faces, mesh.vertices)
    lines += rows_text("vn ", normals)
    for content in rows:
        if isinstance(content, str):
            lines.append(content)
            continue
        lines.append("f")
        for vertex, texture, normal in content:
            number = numbers[vertex, sheet.normals[normal]] + 1 if normal >= 0 else 0
            lines[-1] += f" {_corner_text(vertex + 1, texture, number)}"
    return ("\n".join(lines) + "\n").encode("latin-1")


def _corner_text(vertex: int, texture: int, normal: int) -> str:
    """Write a corner; a texture coordinate or normal 0 is none."""
    return f"{vertex}/{texture or ''}/{normal or ''}".rstrip("/")


def _remaining_rows(
    sheet: ObjSheet, attributes: MeshAttributes, mesh: TriangleMesh
) -> tuple[list[str | list[list[int]]], list[int]]:
    """Return the lines and faces of a file that are left, and the faces that it does not have."""
    places, polygon_of = _cut_polygons(sheet)
    corners, starts = sheet.corners, sheet.starts
    # The new corners at the three corners of each triangle of the file that is still there
    file_corners = attributes.corners.indices[attributes.corners.indptr[:-1]].reshape(-1, 3)
    order = np.argsort(file_corners % 3, axis=1)
    is_old = attributes.from_file & (np.sort(file_corners % 3, axis=1) == np.arange(3)).all(axis=1)
    old_faces = np.flatnonzero(is_old)
    kept, firsts = np.unique(file_corners[old_faces, 0] // 3, return_index=True)
    kept_faces = old_faces[firsts]
    turns = np.full(len(places), -1)  # -1 if the triangle is gone, 1 if it is turned over
    turns[kept] = (order[kept_faces, 1] - order[kept_faces, 0]) % 3 == 2
    new_corners = np.full(places.shape, -1)
    new_corners[kept] = np.take_along_axis(mesh.faces[kept_faces], order[kept_faces], axis=1)
    # A polygon is whole if its triangles agree on their corners, and a reader cuts it into them.
    outlines = np.full(len(corners), -1)
    outlines[places[kept]] = new_corners[kept]
    cut, _, crossed = cut_polygons(mesh.vertices[outlines], starts, np.arange(len(corners)))
    first_triangles = starts - 2 * np.arange(len(starts))  # of each polygon
    is_same = (
        (turns >= 0)
        & (turns == turns[first_triangles[polygon_of]])
        & (outlines[places] == new_corners).all(axis=1)
        & (cut == places).all(axis=1)
        & ~np.isin(polygon_of, crossed)
    )
    is_whole = np.bincount(polygon_of[~is_same], minlength=len(starts) - 1) == 0

    rows: list[str | list[list[int]]] = []
    of_polygons = np.column_stack([outlines, corners[:, 1:]]).tolist()
    of_triangles = np.dstack([new_corners, corners[places][..., 1:]]).tolist()
    for row in sheet.rows:
        if isinstance(row, str):
            rows.append(row)
            continue
        triangles = range(first_triangles[row], first_triangles[row + 1])
        pieces = [(of_polygons[starts[row] : starts[row + 1]], turns[triangles[0]])]
        if not is_whole[row]:
            pieces = [(of_triangles[t], turns[t]) for t in triangles if turns[t] >= 0]
        for piece, is_turned in pieces:
            rows.append([piece[0], *piece[:0:-1]] if is_turned else piece)
    return rows, np.setdiff1d(np.arange(mesh.n_faces), kept_faces).tolist()


def _vertex_lines(sheet: ObjSheet, attributes: MeshAttributes, mesh: TriangleMesh) -> list[str]:
    """Write vertices, each with the weight or color that it has in the file."""
    lines = rows_text("v ", mesh.vertices)
    if not any(sheet.tails):
        return lines
    # A corner with one entry in its row is a corner of the file; a vertex without faces is itself.
    shared = min(mesh.n_vertices, len(sheet.vertices))
    stays = (attributes.mesh.vertices[:shared] == sheet.vertices[:shared]).all(axis=1)
    tails = {index: sheet.tails[index] for index in np.flatnonzero(stays).tolist()}
    file_vertices = sheet.corners[_cut_polygons(sheet)[0], 0].ravel()
    starts = attributes.corners.indptr
    singles = np.flatnonzero(np.diff(starts) == 1)
    sources = file_vertices[attributes.corners.indices[starts[singles]]]
    for vertex, source in zip(mesh.faces.ravel()[singles].tolist(), sources.tolist(), strict=True):
        tails[vertex] = sheet.tails[source]
    return [f"{line} {tails.get(index, '')}".rstrip() for index, line in enumerate(lines)]


def _normals(
    sheet: ObjSheet, faces: Sequence[Sequence[list[int]]], vertices: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "m 3"], dict[tuple[int, tuple[float, ...]], int]]:
    """Compute a normal for each vertex and each normal that it had, so that creases stay."""
    numbers: dict[tuple[int, tuple[float, ...]], int] = {}
    owners, triangles = [], []
    for row in faces:
        # The area vectors of a fan have the same sum as those of any other triangles.
        fan = [(row[0][0], one[0], two[0]) for one, two in pairwise(row[1:])]
        for vertex, _, normal in row:
            if normal >= 0:
                number = numbers.setdefault((vertex, sheet.normals[normal]), len(numbers))
                triangles += fan
                owners += [number] * len(fan)
    if not numbers:
        return np.empty((0, 3)), numbers
    vectors = area_vectors(vertices[np.array(triangles)])
    units = unit_vectors(sum_rows(np.array(owners), vectors))
    old = np.array([normal for _, normal in numbers])
    return np.where(units.any(axis=1, keepdims=True), units, old), numbers


def _latin(name: str) -> str:
    """Return a name as its bytes stand in a sheet."""
    return name.encode().decode("latin-1")


def write_new(attributes: MeshAttributes, mesh: TriangleMesh, path: Path) -> Files:
    """Write an OBJ file with groups and materials, and its materials and images beside it."""
    files: Files = {}
    lines: list[str] = []
    materials = attributes.materials
    of_faces = attributes.face_materials
    if materials and of_faces.min() < 0:  # a line usemtl holds for all faces that follow
        of_faces = np.where(of_faces < 0, len(materials), of_faces)
        materials = (*materials, Material("plain"))
    names = _distinct([material.name for material in materials])
    if materials:
        library = path.with_suffix(".mtl")
        lines.append(f"mtllib {library.name}")
        text = []
        for name, material in zip(names, materials, strict=True):
            red, green, blue, alpha = material.color
            text += [f"newmtl {name}", f"Kd {red:.6g} {green:.6g} {blue:.6g}", f"d {alpha:.6g}"]
            if material.image is not None:
                image = add_image(files, path, material.image_name, material.image)
                text.append(f"map_Kd {image.name}")
        files[library] = end_lines(text)
    vertices = rows_text("v ", mesh.vertices)
    if attributes.colors is not None:
        tints = np.ones((mesh.n_vertices, 3))
        tints[mesh.faces.ravel()] = attributes.colors.reshape(-1, 4)[:, :3] / 255
        vertices = [
            f"{row} {r:.4g} {g:.4g} {b:.4g}" for row, (r, g, b) in zip(vertices, tints, strict=True)
        ]
    lines += vertices
    columns = [mesh.faces.ravel() + 1]
    tables = {"vt": attributes.texture_coordinates, "vn": corner_normals(attributes, mesh)}
    for keyword, table in tables.items():
        if table is None:
            columns.append(np.zeros_like(columns[0]))
            continue
        rows = table.reshape(-1, table.shape[2])
        distinct, numbers = np.unique(rows, axis=0, return_inverse=True)
        lines += rows_text(f"{keyword} ", distinct)
        columns.append(numbers.ravel() + 1)
    corners = [_corner_text(*numbers) for numbers in np.column_stack(columns).tolist()]
    state = (-1, -1)
    for face in np.lexsort([of_faces, attributes.face_groups]).tolist():
        group, number = int(attributes.face_groups[face]), int(of_faces[face])
        if group != state[0]:
            lines.append(f"g {attributes.groups[group] or f'group_{group}'}")
        if number != state[1]:
            lines.append(f"usemtl {names[number]}")
        state = group, number
        lines.append("f " + " ".join(corners[3 * face : 3 * face + 3]))
    files[path] = end_lines(lines)
    return files


def add_image(files: Files, path: Path, name: str, data: bytes) -> Path:
    """Put an image beside an OBJ file, under another name if there is a different one already."""
    word, number = _word(name), 0
    place = path.with_name(word)
    while files.get(place, place.read_bytes() if place.is_file() else data) != data:
        number += 1
        place = path.with_name(f"{path.stem}_{number}_{word}")
    files[place] = data
    return place


def _word(name: str) -> str:
    """Return a name of which a line or a file name can be made."""
    return re.sub(r"[^\w.+-]+", "_", name) or "image"


def _distinct(names: list[str]) -> list[str]:
    """Return words that name materials, each another one."""
    words: list[str] = []
    for number, name in enumerate(names):
        word = _word(name) if name else f"material_{number}"
        words.append(f"{word}_{number}" if word in words else word)
    return words
