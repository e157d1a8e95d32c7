"""The formats of files: their suffixes, what they hold, and the modules that read and write them.

This is the one list of suffixes: readers, writers, the command line and the studio ask it. The
command line imports it for its help, so it imports little.
"""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from eigenshape._errors import FileFormatError
from eigenshape._files import require_regular

CellKind = Literal["triangles", "quads", "tetrahedra"]
"""The kinds of cells that can be requested from a file."""

Trait = Literal[
    "cells",
    "points",
    "text",
    "binary",
    "cloud",
    "colors",
    "labels",
    "attributes",
    "fields",
    "beside",
]


@dataclass(frozen=True)
class Format:
    """A format of files.

    Attributes
    ----------
    suffix : str
    module : str
        The module of `eigenshape.io.formats` with the functions that the traits name.
    traits : tuple of str
        - "cells": `parse(data)` returns the points, and the cells: the triangles or segments as an
          array, or a dictionary of arrays by kind.
        - "points": `parse(data)` does so, and there are never cells.
        - "text": `format_text(mesh)` writes a mesh.
        - "binary": `format_binary(mesh)` does so.
        - "cloud": `format_points(points, suffix)` writes points.
        - "attributes": the file holds more than positions and faces. The module whose name ends in
          ``_attributes`` has `read_attributes(source, mesh)`, and `write(job)`, which returns the
          files to write.
        - "fields": `parse_fields(data)` returns the functions on points and those on cells;
          `format_fields(mesh, of_points, of_cells)` writes them with the mesh.
        - "colors": colors of vertices can be written.
        - "labels": labels of faces can be written. Other formats with colors get a material for each.
        - "beside": parts of the file lie in its folder, which `parse` takes as well.
    """

    suffix: str
    module: str
    traits: tuple[Trait, ...]

    def load(self, ending: str = "") -> Any:
        """Return the module, or the one that goes with it, such as ``ply_attributes``."""
        return import_module(f"eigenshape.io.formats.{self.module}{ending}")


FORMATS = (
    Format(".off", "off", ("cells", "text")),
    Format(".obj", "obj", ("cells", "text", "colors", "attributes")),
    Format(".ply", "ply", ("cells", "text", "binary", "cloud", "colors", "labels", "attributes")),
    Format(".stl", "stl", ("cells", "text", "binary")),
    Format(".glb", "gltf", ("cells", "binary", "colors", "attributes")),
    Format(".gltf", "gltf", ("cells", "attributes", "beside")),
    Format(".vtu", "vtu", ("cells", "binary", "fields")),
    Format(".vtk", "vtk", ("cells", "binary", "fields")),
    Format(".npz", "npz", ("cells", "binary", "fields")),
    Format(".mesh", "medit", ("cells",)),
    Format(".meshb", "medit", ("cells",)),
    Format(".msh", "gmsh", ("cells",)),
    Format(".xyz", "points", ("points", "cloud")),
    Format(".pts", "points", ("points", "cloud")),
    Format(".pcd", "pcd", ("points",)),
)


def suffixes_with(*traits: Trait) -> tuple[str, ...]:
    """Return the suffixes of the formats that have one of some traits."""
    return tuple(known.suffix for known in FORMATS if set(traits) & set(known.traits))


MESH_FORMATS = suffixes_with("cells")  # suffixes of the files that `read_mesh` reads
SHAPE_FORMATS = suffixes_with("cells", "points")  # and those that `read_shape` reads
POINT_FORMATS = suffixes_with("points")
FIELD_FORMATS = suffixes_with("fields")
WRITTEN = suffixes_with("text", "binary")
WRITTEN_CLOUDS = suffixes_with("cloud")
WITH_MORE = suffixes_with("attributes", "fields")  # than positions and faces
WITH_COLORS = suffixes_with("colors")


def format_of(suffix: str) -> Format:
    """Return the format of a known suffix."""
    return next(known for known in FORMATS if known.suffix == suffix)


def suffix_of(path: Path, file_format: str | None, known: tuple[str, ...]) -> str:
    """Return the suffix that names the format, in lower case.

    Raise FileFormatError if the suffix is not one of the known ones, or the path is a folder.
    """
    suffix = path.suffix if file_format is None else f".{file_format.removeprefix('.')}"
    suffix = suffix.lower()
    if suffix not in known:
        if path.is_dir():
            require_regular(path)
        found = f"is {suffix!r}" if suffix else "has no suffix"
        raise FileFormatError(f"{path} must be of a known format, {', '.join(known)}; it {found}.")
    return suffix
