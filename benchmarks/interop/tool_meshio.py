"""meshio writes and reads."""

import itertools
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
from exchange import Shape, Writer, field_arrays, plain_fields, serve

SURFACE_KINDS = {3: "triangle", 4: "quad"}
ORDER = ("hexahedron", "wedge", "pyramid", "tetra")


def mesh_of(shape: Shape) -> meshio.Mesh:
    """Return a shape as meshio has it: a block for each kind of cell, and fields block by block."""
    blocks: list[tuple[str, list[list[int]]]] = []
    for corners in [*shape.get("polygons", []), *shape.get("lines", [])]:
        kind = SURFACE_KINDS.get(len(corners), "polygon")
        pieces = [corners]
        if "lines" in shape:
            kind = "line"
            pieces = [list(pair) for pair in itertools.pairwise(corners)]
        if blocks and blocks[-1][0] == kind and len(blocks[-1][1][0]) == len(pieces[0]):
            blocks[-1][1].extend(pieces)
        else:
            blocks.append((kind, pieces))
    blocks += [(kind, shape["cells"][kind]) for kind in ORDER if kind in shape.get("cells", {})]
    sizes = np.cumsum([len(block) for _, block in blocks])[:-1]
    point_data = {
        name: values.astype(np.uint8) if values.dtype == bool else values
        for name, values in field_arrays(shape.get("point_fields", {})).items()
    }
    cell_data = {
        name: np.split(values.astype(np.uint8) if values.dtype == bool else values, sizes)
        for name, values in field_arrays(shape.get("cell_fields", {})).items()
    }
    if "colors" in shape:
        colors = np.array(shape["colors"], np.uint8)
        point_data |= dict(zip(("red", "green", "blue"), colors.T, strict=True))
    if "texture" in shape:
        point_data |= dict(zip(("s", "t"), np.array(shape["texture"]).T, strict=True))
    return meshio.Mesh(np.array(shape["points"]), blocks, point_data, cell_data)


def writer_of(name: str, **options: object) -> Callable[[Shape, Path], None]:
    """Return a call that writes one of meshio's formats."""

    def write(shape: Shape, path: Path) -> None:
        mesh = mesh_of(shape)
        if name in ("ply", "vtk", "vtk42"):  # whose names have no spaces
            mesh.point_data.pop("is seen", None)
        if name == "ply":
            mesh.point_data.pop("vector", None)
        else:  # s and t mean nothing there
            mesh.point_data.pop("s", None)
            mesh.point_data.pop("t", None)
        meshio.write(path, mesh, file_format=name, **options)

    return write


def read(path: Path) -> Shape:
    """Read a file by its suffix."""
    mesh = meshio.read(path)
    found: Shape = {"points": mesh.points, "polygons": [], "cells": {}, "lines": []}
    surface, solid = [], []
    for number, block in enumerate(mesh.cells):
        if block.type in ("triangle", "quad", "polygon"):
            found["polygons"] += [list(map(int, corners)) for corners in block.data]
            surface.append(number)
        elif block.type == "line":
            found["lines"] += block.data.tolist()
            solid.append(number)
        elif block.type in ORDER:
            found["cells"].setdefault(block.type, []).extend(block.data.tolist())
            solid.append(number)
    chosen = surface if surface and not solid else solid
    data = {
        name: np.concatenate([np.asarray(blocks[number]) for number in chosen])
        for name, blocks in mesh.cell_data.items()
        if chosen
    }
    found["point_fields"] = plain_fields(mesh.point_data)
    found["cell_fields"] = plain_fields(data)
    tints = [name for name in ("red", "green", "blue") if name in mesh.point_data]
    if len(tints) == 3:
        found["colors"] = np.column_stack([mesh.point_data[name] for name in tints])
    if {"s", "t"} <= set(mesh.point_data):
        found["texture"] = np.column_stack([mesh.point_data["s"], mesh.point_data["t"]])
    if "obj:vt" in mesh.point_data:
        found["texture"] = mesh.point_data["obj:vt"][:, :2]
    return found


if __name__ == "__main__":
    solids = ("prism", "fields", "solids", "curves", "far", "seam")
    surfaces = ("prism", "far", "seam", "colors")
    serve(
        meshio.__version__,
        {
            "VTU": Writer(".vtu", writer_of("vtu"), solids),
            "VTU, text": Writer(".vtu", writer_of("vtu", binary=False), solids),
            "VTU, lzma": Writer(".vtu", writer_of("vtu", compression="lzma"), solids),
            "VTK 5.1": Writer(".vtk", writer_of("vtk"), solids),
            "VTK 5.1, text": Writer(".vtk", writer_of("vtk", binary=False), solids),
            "VTK 4.2": Writer(".vtk", writer_of("vtk42"), solids),
            "VTK 4.2, text": Writer(".vtk", writer_of("vtk42", binary=False), solids),
            "PLY": Writer(".ply", writer_of("ply"), (*surfaces, "fields")),
            "PLY, text": Writer(".ply", writer_of("ply", binary=False), (*surfaces, "fields")),
            "STL": Writer(".stl", writer_of("stl", binary=True), ("far", "seam")),
            "STL, text": Writer(".stl", writer_of("stl"), ("far", "seam")),
            "OBJ": Writer(".obj", writer_of("obj"), ("prism", "far", "seam")),
            "OFF": Writer(".off", writer_of("off"), ("far", "seam")),
            "MSH 2.2": Writer(".msh", writer_of("gmsh22"), ("solids", "far", "curves")),
            "MSH 4.1": Writer(".msh", writer_of("gmsh"), ("far", "curves")),
            "MSH 4.1, text": Writer(".msh", writer_of("gmsh", binary=False), ("far",)),
            "MSH, Ansys": Writer(".msh", writer_of("ansys"), ("far",)),
            "Medit": Writer(".mesh", writer_of("medit"), ("solids", "far", "curves")),
            "Medit, binary": Writer(".meshb", writer_of("medit"), ("solids", "far")),
        },
        dict.fromkeys(
            (".vtu", ".vtk", ".ply", ".stl", ".obj", ".off", ".msh", ".mesh", ".meshb"), read
        ),
    )
