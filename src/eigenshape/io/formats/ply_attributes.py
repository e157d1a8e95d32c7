"""Attributes of PLY files: columns of vertices and faces beside positions and corners."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import FileFormatError
from certeig.kit.files import read_regular
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.polygons import triangulate_polygons
from eigenshape.io.attributes import Material, MeshAttributes, WriteJob, corner_normals
from eigenshape.io.formats.cells import list_corners
from eigenshape.io.formats.obj_attributes import add_image, find_beside
from eigenshape.io.formats.ply import (
    AXES,
    CORNERS,
    LABEL,
    Table,
    format_binary,
    format_text,
    parse_header,
    read_lists,
    read_tables,
)
from eigenshape.io.opening import SourceFile

IMAGE = re.compile(rb"(?m)^comment TextureFile[ \t]+(.+?)[ \t\r]*$")  # as MeshLab writes it
TINTS = ("red", "green", "blue")
NORMALS = ("nx", "ny", "nz")
# Names of texture coordinates of vertices; those of Blender are written
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
WEDGES = "texcoord"  # of faces: the coordinates of all corners, as MeshLab writes them


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the attributes of a PLY file; columns of numbers without a known meaning are fields."""
    tables, header = read_tables(source.data), parse_header(source.data)
    columns = {
        (element.name, column.name): column
        for element in header.elements.values()
        for column in element.columns.values()
        if element.count and column.name not in CORNERS
    }
    left = {key: None for key in columns if key[0] != "vertex" or key[1] not in AXES}

    def take(element: str, names: Sequence[str]) -> Float[np.ndarray, "rows k"] | None:
        """Return columns, if they are all there, and strike them off the list of those that are left."""
        if not all((element, name) in left for name in names):
            return None
        for name in names:
            del left[element, name]
        return np.column_stack([_numbers(tables[element][name]) for name in names])

    polygons = read_lists(tables, "face")
    polygon_of = np.repeat(np.arange(len(polygons)), [len(polygon) - 2 for polygon in polygons])
    are_faces = len(polygon_of) == mesh.n_faces  # not strips
    found: dict[str, Any] = {}
    if (normals := take("vertex", NORMALS)) is not None:
        found["normals"] = normals[mesh.faces]
    for pair in COORDINATES:
        if (coordinates := take("vertex", pair)) is not None:
            found["texture_coordinates"] = coordinates[mesh.faces]
    if are_faces and "texture_coordinates" not in found and ("face", WEDGES) in left:
        points = np.column_stack([_numbers(tables["vertex"][axis]) for axis in AXES])
        found["texture_coordinates"] = _wedges(tables["face"][WEDGES], polygons, points)
        del left["face", WEDGES]
    for element, rows in (("vertex", mesh.faces), ("face", np.column_stack([polygon_of] * 3))):
        names = [*TINTS, *(["alpha"] if (element, "alpha") in left else [])]
        tints = None if "colors" in found or len(rows) != mesh.n_faces else take(element, names)
        if tints is not None:
            scales = [1 if columns[element, name].is_whole else 255 for name in names]
            colors = np.full((len(tints), 4), 255, np.uint8)
            colors[:, : len(names)] = np.rint(np.nan_to_num(tints * scales).clip(0, 255))
            found["colors"] = colors[rows]
    label = columns.get(("face", LABEL))
    if are_faces and label and not label.length_kind:
        labels = _numbers(tables["face"][LABEL])[polygon_of].astype(np.int64)
        distinct, found["face_groups"] = np.unique(labels, return_inverse=True)
        found["groups"] = tuple(map(str, distinct.tolist()))
        del left["face", LABEL]
    fields = {}
    for element, name in list(left):  # numbers without a known meaning
        column = columns[element, name]
        is_of_faces = element == "face" and are_faces and mesh.n_faces != mesh.n_vertices
        if not column.length_kind and name not in fields and (element == "vertex" or is_of_faces):
            values = _numbers(tables[element][name])
            values = values.astype(column.kind) if column.is_whole else values
            fields[name] = values[polygon_of] if is_of_faces else values
            del left[element, name]
    others = [f"{name} of {element}" for element, name in left]
    if are_faces and len(polygons) < mesh.n_faces:
        others.append("polygons, of which triangles are made")
    materials, missing = _read_images(source, header.end)
    if materials:
        found |= {"materials": materials, "face_materials": np.zeros(mesh.n_faces, dtype=np.int64)}
    others += missing
    return replace(MeshAttributes.plain(mesh), fields=fields, others=tuple(others), **found)


def _read_images(source: SourceFile, end: int) -> tuple[tuple[Material, ...], list[str]]:
    """Return a material with the image that a comment names; if there is no such one, its name."""
    names = [name.decode("latin-1") for name in IMAGE.findall(source.data[:end])]
    path = find_beside(names[0], source.folder) if len(names) == 1 else None
    if path is None:
        return (), [f"the image {name[:80]!r}, which a comment names" for name in names]
    return (Material(path.stem, image=read_regular(path, "an image"), image_name=path.name),), []


def _wedges(
    rows: Any, polygons: Any, points: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "f 3 2"]:
    """Return the texture coordinates at the corners of triangles, from those of polygons."""
    if [len(row) for row in rows] != [2 * len(polygon) for polygon in polygons]:
        raise FileFormatError(
            f"{WEDGES} of a face must hold two numbers for each corner; it does not."
        )
    pairs = np.concatenate([_numbers(row) for row in rows]).reshape(-1, 2)
    lists = list_corners(polygons)
    places = np.arange(len(pairs))
    return pairs[triangulate_polygons(points[lists.corners], lists.starts, places)[0]]


def _numbers(values: Any) -> Float[np.ndarray, "..."]:
    return np.asarray(values).astype(np.float64)


def write(job: WriteJob) -> dict[Path, bytes]:
    """Write a PLY file with columns of vertices and faces."""
    mesh, held, labels, lost = job.mesh, job.attributes, job.face_labels, job.lost
    of_vertices: Table = {}
    of_faces: Table = {}
    if held.colors is not None:
        colors, fit = _of_vertices(mesh, held.colors, 1)
        names = [*TINTS, "alpha"] if (held.colors[..., 3] < 255).any() else TINTS
        if not fit and (held.colors == held.colors[:, :1]).all():
            of_faces |= dict(zip(names, held.colors[:, 0].T, strict=False))
        else:
            of_vertices |= dict(zip(names, colors.T, strict=False))
            lost += [] if fit else ["colors that differ at one vertex"]
    normals = corner_normals(held, mesh)
    if normals is not None:
        rows, fit = _of_vertices(mesh, normals, 1e-6)
        of_vertices |= dict(zip(NORMALS, rows.T, strict=True))
        lost += [] if fit else ["normals that differ at one vertex"]
    if held.texture_coordinates is not None:
        rows, fit = _of_vertices(mesh, held.texture_coordinates, 1e-6)
        of_vertices |= dict(zip(COORDINATES[0], rows.T, strict=True)) if fit else {}
        of_faces |= {} if fit else {WEDGES: held.texture_coordinates.reshape(-1, 6)}
    numbered = all(re.fullmatch(r"-?\d{1,9}", name) for name in held.groups)
    if labels is not None:
        of_faces[LABEL] = labels.astype(np.int32)
    elif held.groups and numbered and held.face_groups.min() >= 0:
        of_faces[LABEL] = np.array(held.groups, dtype=np.int32)[held.face_groups]
    for name, values in held.fields.items():
        table = of_vertices if len(values) == mesh.n_vertices else of_faces
        if values.ndim > 1 or re.search(r"\s", name) or name in {*table, LABEL}:
            lost.append(f"the field {name!r}")
        else:
            table[name] = values.astype(_kind(values))
    files: dict[Path, bytes] = {}
    comment, kinds = "", ["materials", "images"]
    material = held.materials[0] if held.materials and not held.face_materials.any() else None
    if material and material.image is not None:  # one image for all faces
        place = add_image(files, job.path, material.image_name, material.image)
        comment = f"TextureFile {place.name}"
        plain = replace(material, name=Path(material.image_name).stem, color=Material.color)
        kinds = [] if material == plain else ["materials"]
    job.lose(kinds if numbered and labels is None else [*kinds, "names of groups"])
    format_columns = format_binary if job.binary else format_text
    return {**files, job.path: format_columns(mesh, of_vertices, of_faces, comment=comment)}


def _kind(values: np.ndarray) -> type[np.generic]:
    """Return the type to write a field in."""
    if values.dtype == np.uint8:
        return np.uint8
    is_small = values.dtype.kind in "biu" and np.abs(values.astype(np.float64)).max() < 2**31
    return np.int32 if is_small else np.float64


def _of_vertices(
    mesh: TriangleMesh, at_corners: np.ndarray, step: float
) -> tuple[np.ndarray, bool]:
    """Return the values of vertices, and whether those of all their corners agree."""
    values = at_corners.reshape(-1, at_corners.shape[2])
    rows = np.full(
        (mesh.n_vertices, values.shape[1]), 255 if values.dtype == np.uint8 else 0, values.dtype
    )
    rows[mesh.faces.ravel()] = values
    gaps = np.abs(rows[mesh.faces.ravel()].astype(np.float64) - values)
    return rows, bool((gaps <= step).all())
