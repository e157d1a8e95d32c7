"""Attributes of OBJ files: read with their materials and images, and written with them."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import (
    Material,
    MeshAttributes,
    WriteJob,
    corner_normals,
    plain_attributes,
)
from eigenshape.io.formats.obj_sheet import ObjSheet, format_sheet, read_sheet
from eigenshape.io.formats.text import rows_text
from eigenshape.io.sources import SourceFile

MAP = re.compile(r"(?im)^([ \t]*(?:map_\w+|bump|disp|decal|norm|refl)[ \t]+)(.+?)[ \t\r]*$")
PLAIN_MATERIAL = {"newmtl", "kd", "d", "tr", "map_kd", "ka", "ke", "ks", "ns", "ni", "illum"}
Files = dict[Path, bytes]  # to write, by path


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the attributes of an OBJ file, by face as in the mesh that was read."""
    sheet = read_sheet(source.data)
    # Each polygon is a fan of triangles around its first corner.
    corners = [
        (polygon[0], polygon[place], polygon[place + 1])
        for polygon in sheet.polygons
        for place in range(1, len(polygon) - 1)
    ]
    coordinates = np.array(
        [[*map(float, row.split()[1:3]), 0.0][:2] for row in _rows(sheet, "vt")] or [[0.0, 0.0]]
    )
    textures = np.array([[int(texture[1:] or 0) for _, texture, _ in row] for row in corners])
    if textures.max() > len(coordinates):
        raise FileFormatError(
            f"A corner must name one of {len(coordinates)} texture coordinates; one names {textures.max()}."
        )
    normals = np.array([[normal for _, _, normal in row] for row in corners])
    faces_of = np.array([len(polygon) - 2 for polygon in sheet.polygons])
    groups, face_groups = _switches(sheet, ("g ", "o "))
    names, face_materials = _switches(sheet, ("usemtl ",))
    defined, others = _read_materials(sheet, source)
    if (faces_of > 1).any():
        others.append("polygons, of which triangles are made")
    if _rows(sheet, "o") and _rows(sheet, "g"):
        others.append("names of objects beside those of groups")
    if _rows(sheet, "s"):
        others.append("smoothing groups")
    others += sheet.dropped
    has_normals = (normals >= 0).any()
    return replace(
        plain_attributes(mesh),
        face_materials=np.repeat(face_materials, faces_of),
        face_groups=np.repeat(face_groups, faces_of),
        texture_coordinates=coordinates[textures - 1] if textures.any() else None,
        normals=np.array(sheet.normals)[normals] if has_normals else None,
        colors=_colors(sheet)[mesh.faces]
        if any(len(t.split()) == 3 for t in sheet.tails)
        else None,
        materials=tuple(defined.get(name, Material(_unicode(name))) for name in names),
        groups=tuple(map(_unicode, groups)),
        others=tuple(others),
        source=source,
    )


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


def _colors(sheet: ObjSheet) -> np.ndarray:
    """Return the colors behind coordinates; vertices without one are white."""
    table = np.full((len(sheet.tails), 4), 255, np.uint8)
    for number, tail in enumerate(sheet.tails):
        words = tail.split()
        if len(words) == 3:
            table[number, :3] = np.rint(255 * np.nan_to_num(np.array(words, float)).clip(0, 1))
    return table


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
        path = (root / wanted).resolve()
        if path.is_relative_to(root) and path.is_file():
            return path
    return None


def _material_files(sheet: ObjSheet, source: SourceFile) -> tuple[str, list[str]]:
    """Return the text of all libraries of materials, and the names of those that are missing."""
    text, missing = "", []
    for row in _rows(sheet, "mtllib"):
        rest = _unicode(row.split(None, 1)[1])
        whole = find_beside(rest, source.path.parent)
        for name in [rest] if whole else rest.split():
            path = find_beside(name, source.path.parent)
            if path is None:
                missing.append(name)
            elif path.stat().st_size:
                text += read_regular(path, "materials").decode("latin-1") + "\n"
    return text, missing


def _image_of(rest: str, folder: Path) -> Path | None:
    """Return the image that a line of a material names, behind its options."""
    return find_beside(_unicode(rest), folder) or find_beside(
        _unicode(rest.rsplit(maxsplit=1)[-1]), folder
    )


def _read_materials(sheet: ObjSheet, source: SourceFile) -> tuple[dict[str, Material], list[str]]:
    text, missing = _material_files(sheet, source)
    lost = [
        f"the materials of {name!r}, which is not in the folder of the file" for name in missing
    ]
    found: dict[str, Material] = {}
    for name, lines in _material_blocks(text):
        values = {key: rest for key, rest in lines if rest}
        if set(values) - PLAIN_MATERIAL:
            lost.append("properties of materials other than color and image")
        red, green, blue = ([float(x) for x in values.get("kd", "1 1 1").split()[:3]] * 3)[:3]
        alpha = float(values.get("d", "1").split()[-1]) if "d" in values else 1.0
        alpha = (
            1.0 - float(values["tr"].split()[-1]) if "tr" in values and "d" not in values else alpha
        )
        image, image_name = None, ""
        if "map_kd" in values:
            path = _image_of(values["map_kd"], source.path.parent)
            if path is None:
                lost.append(
                    f"the image {values['map_kd'][:80]!r}, which is not in the folder of the file"
                )
            else:
                image, image_name = read_regular(path, "an image"), path.name
        found[name] = Material(_unicode(name), (red, green, blue, alpha), image, image_name)
    return found, lost


def _material_blocks(text: str) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    for block in re.split(r"(?im)^[ \t]*newmtl[ \t]+", text)[1:]:
        name, *rows = block.splitlines()
        words = [
            row.strip().split(None, 1) for row in rows if row.strip() and row.strip()[0] != "#"
        ]
        yield name.strip(), [(pair[0].lower(), pair[1] if len(pair) > 1 else "") for pair in words]


def write(job: WriteJob) -> Files:
    """Write an OBJ file with its materials and images beside it: that of the source, or a new one."""
    held, source = job.attributes, job.attributes.source
    if source and source.suffix == ".obj" and held.from_file.mean() > 0.5:
        files, lost = rewrite(source, held, job.mesh, job.path)
        job.lost.extend(lost)
        return files
    job.lose(["fields"])
    return write_new(held, job.mesh, job.path)


def rewrite(
    source: SourceFile, attributes: MeshAttributes, mesh: TriangleMesh, path: Path
) -> tuple[Files, list[str]]:
    """Write an OBJ file again with other positions, its materials and images beside it."""
    sheet = read_sheet(source.data)
    data = format_sheet(sheet, attributes, mesh.vertices)
    if path.absolute().parent.resolve() == source.path.absolute().parent.resolve():
        return {path: data}, [*sheet.dropped]
    text, missing = _material_files(sheet, source)
    lost = [*sheet.dropped] + [
        f"the materials of {name!r}, which is not in the folder of the file" for name in missing
    ]
    if not text:
        return {path: data}, lost
    files: Files = {}

    def link(match: re.Match[str]) -> str:
        image = _image_of(match[2], source.path.parent)
        if image is None:
            lost.append(f"the image {match[2][:80]!r}, which is not in the folder of the file")
            return match[0]
        copy = _add_image(files, path, image.name, read_regular(image, "an image"))
        return match[1] + copy.name.encode().decode("latin-1")

    materials = path.with_suffix(".mtl")
    files[materials] = MAP.sub(link, text).encode("latin-1")
    library = f"mtllib {materials.name}".encode()
    data = re.sub(rb"(?m)^mtllib[ \t].*\n", b"", data)
    files[path] = library + b"\n" + data
    return files, lost


def write_new(attributes: MeshAttributes, mesh: TriangleMesh, path: Path) -> Files:
    """Write an OBJ file with groups and materials, and its materials and images beside it."""
    files: Files = {}
    lines: list[str] = []
    materials = attributes.materials
    of_faces = attributes.face_materials
    if materials and of_faces.min() < 0:  # a line usemtl holds for all faces that follow
        of_faces = np.where(of_faces < 0, len(materials), of_faces)
        materials = (*materials, Material("plain"))
    names = _distinct([material.name for material in materials], "material")
    if materials:
        library = path.with_suffix(".mtl")
        lines.append(f"mtllib {library.name}")
        text = []
        for name, material in zip(names, materials, strict=True):
            red, green, blue, alpha = material.color
            text += [f"newmtl {name}", f"Kd {red:.6g} {green:.6g} {blue:.6g}", f"d {alpha:.6g}"]
            if material.image is not None:
                image = _add_image(files, path, material.image_name, material.image)
                text.append(f"map_Kd {image.name}")
        files[library] = ("\n".join(text) + "\n").encode()
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
        distinct, numbers = np.unique(
            table.reshape(-1, table.shape[2]), axis=0, return_inverse=True
        )
        lines += rows_text(f"{keyword} ", distinct)
        columns.append(numbers.ravel() + 1)
    corners = [
        f"{v}" if not t and not n else f"{v}/{t or ''}" + (f"/{n}" if n else "")
        for v, t, n in np.column_stack(columns).tolist()
    ]
    state = (-1, -1)
    for face in np.lexsort([of_faces, attributes.face_groups]).tolist():
        group, number = int(attributes.face_groups[face]), int(of_faces[face])
        if group != state[0]:
            lines.append(f"g {attributes.groups[group] or f'group_{group}'}")
        if number != state[1] and number >= 0:
            lines.append(f"usemtl {names[number]}")
        state = group, number
        lines.append("f " + " ".join(corners[3 * face : 3 * face + 3]))
    files[path] = ("\n".join(lines) + "\n").encode()
    return files


def _add_image(files: Files, path: Path, name: str, data: bytes) -> Path:
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


def _distinct(names: list[str], noun: str) -> list[str]:
    """Return words that name materials, each another one."""
    words: list[str] = []
    for number, name in enumerate(names):
        word = _word(name) if name else f"{noun}_{number}"
        words.append(f"{word}_{number}" if word in words else word)
    return words
