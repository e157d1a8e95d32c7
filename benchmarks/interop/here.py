"""What eigenshape reads of the files of others, and what it writes for them, with all that it says."""

import json
import re
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from interop.exchange import as_list
from scipy.sparse import eye_array

import eigenshape as es

Shape = dict[str, Any]
# VTK's files hold colors and texture coordinates as fields, and so they come.
FIELDS_OF_VTK = {"colors": "RGB", "texture": "Texture Coordinates"}
KINDS = {2: "lines", 3: "polygons", 4: "cells"}


def listen(work: Callable[[], Any]) -> tuple[Any, list[str], str]:
    """Do something, and return its result, the warnings, and the error that ended it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result, error = work(), ""
        except es.EigenshapeError as err:
            result, error = None, f"{err}"
    # A path before a message is no word about what the file holds.
    messages = [re.sub(r"^/\S+: ", "", str(each.message)) for each in caught]
    return result, messages, error


def read_here(path: Path) -> Shape:
    """Read a file as other programs answer: with lists instead of arrays."""
    return json.loads(json.dumps(read_all(path), default=as_list))


def read_all(path: Path) -> Shape:
    """Read a surface with its attributes, and what is no surface as a shape with its fields."""
    shape = es.read_shape(path)
    if isinstance(shape, es.TriangleMesh):
        mesh, attributes = es.read_mesh(path, attributes=True)
        for other in attributes.others:
            warnings.warn(f"{path}: only a file of the same format keeps {other}", stacklevel=1)
        found: Shape = {"points": mesh.vertices, "polygons": mesh.faces}
        if attributes.texture_coordinates is not None:
            found["corner_texture"] = attributes.texture_coordinates
        if attributes.colors is not None:
            found["corner_colors"] = attributes.colors
        for key, name in FIELDS_OF_VTK.items():
            if name in attributes.fields:
                found[key] = attributes.fields[name]
        return found | sorted_fields(attributes.fields, mesh.n_vertices, mesh.n_faces)
    found = {"points": shape.points}
    if isinstance(shape, es.SimplicialMesh):
        kind = KINDS[shape.simplices.shape[1]]
        found[kind] = {"tetra": shape.simplices} if kind == "cells" else shape.simplices
        if path.suffix in (".vtu", ".vtp", ".vtk"):  # the formats of such shapes that hold fields
            fields = es.io.read_fields(path)
            found |= sorted_fields(fields, len(shape.points), len(shape.simplices))
    return found


def sorted_fields(fields: Any, n_points: int, n_cells: int) -> Shape:
    """Return fields of points and of cells; those with other numbers of rows are of neither."""
    sorted_by_rows: Shape = {"point_fields": {}, "cell_fields": {}}
    for name, values in fields.items():
        entry = {"type": values.dtype.name, "values": values}
        if len(values) == n_points:
            sorted_by_rows["point_fields"][name] = entry
        else:
            sorted_by_rows["cell_fields"][name] = entry
    return sorted_by_rows


def write_here(shape: Shape, path: Path) -> None:
    """Write a shape with what belongs to it, as far as the format is said to hold it."""
    fields = {
        name: np.array(each["values"], each["type"])
        for name, each in shape.get("point_fields", {}).items()
    }
    for name, each in shape.get("cell_fields", {}).items():
        values = np.array(each["values"], each["type"])
        fields[name] = values[shape["owners"]] if "owners" in shape else values
    points = np.array(shape["points"])
    if "triangles" not in shape:
        solid, owners = simplices_of(shape, points)
        if "cells" in shape:
            for name in shape["cell_fields"]:
                fields[name] = fields[name][owners]
        es.io.write_fields(solid, path, fields)
        return
    mesh = es.TriangleMesh(points, np.array(shape["triangles"]))
    if fields and path.suffix in (".vtu", ".vtk", ".vtp"):
        es.io.write_fields(mesh, path, fields)
        return
    none = np.full(mesh.n_faces, -1)
    attributes = es.io.MeshAttributes(
        mesh,
        eye_array(3 * mesh.n_faces, format="csr"),
        face_parts=np.zeros(mesh.n_faces, dtype=int),
        face_materials=none,
        face_groups=none,
        texture_coordinates=np.array(shape["texture"])[mesh.faces] if "texture" in shape else None,
        fields=fields,
    )
    colors = np.array(shape["colors"], np.uint8) if "colors" in shape else None
    es.write_mesh(mesh, path, colors=colors, attributes=attributes)


def simplices_of(shape: Shape, points: np.ndarray) -> tuple[es.SimplicialMesh, np.ndarray]:
    """Return curves as segments and solids as tetrahedra, and the cell that each is a piece of."""
    if "lines" in shape:
        pairs = [pair for row in shape["lines"] for pair in pairwise(row)]
        owners = np.repeat(np.arange(len(shape["lines"])), [len(row) - 1 for row in shape["lines"]])
        return es.SimplicialMesh(points, np.array(pairs)), owners
    blocks, counts = [], []
    for kind, cells in shape["cells"].items():
        block = np.array(cells)
        if kind != "tetra":
            block = es.geometry.split_solids(points, block).simplices
        blocks.append(block)
        counts += [len(block) // len(cells)] * len(cells)
    solid = es.SimplicialMesh(points, np.concatenate(blocks))
    return solid, np.repeat(np.arange(len(counts)), counts)


def write_again(source: Path, path: Path) -> None:
    """Read a file with its attributes, and write it again in its format."""
    mesh, attributes = es.read_mesh(source, attributes=True)
    es.write_mesh(mesh, path, attributes=attributes)
