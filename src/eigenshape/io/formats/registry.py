"""The formats of files: their suffixes, what they hold, and the modules that read and write them.

This is the one list of suffixes: readers, writers, the command line and the studio ask it. The
command line imports it for its help, so it imports little.
"""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from certeig.kit.errors import FileFormatError

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
    "maps",
    "parcels",
    "volume",
    "beside",
    "scenes",
    "single",
    "upright",
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
          array, or a dictionary of arrays by kind. Further values are notes: sentences that say what
          the file holds and the shape does not, or what was made of it.
        - "points": `parse(data)` does so, and there are never cells.
        - "text": `format_text(mesh)` writes a mesh.
        - "binary": `format_binary(mesh)` does so.
        - "cloud": `format_points(points, suffix)` writes points.
        - "attributes": the file holds more than positions and faces. The module whose name ends in
          ``_attributes`` has `read_attributes(source, mesh)`, and `write(job)`, which returns the
          files to write. For the other formats with fields, `field_attributes` has them.
        - "fields": `parse_fields(data)` returns the functions on points, those on the simplices that
          are read, and notes, as `parse` does;
          `format_fields(mesh, of_points, of_cells)` writes them with the mesh.
        - "maps": the file holds functions on vertices and no mesh. `parse_fields(data)` returns them and
          an empty dictionary; `format_maps(mesh, of_points, suffix)` writes those of a mesh.
        - "parcels": the file holds a parcellation and no mesh. `parse_parcels(data, mesh)` returns
          it, and notes; `format_parcels(mesh, parcellation)` writes that of a mesh.
        - "volume": the file holds a number for each voxel. `parse_volume(data)` returns them, and
          the affine map from voxels to space.
        - "colors": colors of vertices can be written.
        - "labels": labels of faces can be written. Other formats with colors get a material for each.
        - "beside": parts of the file may lie in its folder, which the parsers take as well.
        - "scenes": the file may hold several scenes; `parse` takes the name or number of one.
        - "upright": the y axis points up, by the format (glTF) or by habit (OBJ).
        - "single": the binary form stores coordinates in single precision.
    """

    suffix: str
    module: str
    traits: tuple[Trait, ...]

    def load(self) -> Any:
        """Return the module."""
        return import_module(f"eigenshape.io.formats.{self.module}")

    def load_attributes(self) -> Any:
        """Return the module that reads and writes what is beside a mesh; None if nothing can be."""
        if "attributes" in self.traits:
            return import_module(f"eigenshape.io.formats.{self.module}_attributes")
        if "fields" in self.traits:
            return import_module("eigenshape.io.formats.field_attributes")
        return None


FORMATS = (
    Format(".off", "off", ("cells", "text")),
    Format(".obj", "obj", ("cells", "text", "colors", "attributes", "upright")),
    Format(".ply", "ply", ("cells", "text", "binary", "cloud", "colors", "labels", "attributes")),
    Format(".stl", "stl", ("cells", "text", "binary", "single")),
    Format(".glb", "gltf", ("cells", "binary", "colors", "attributes", "upright", "scenes")),
    Format(".gltf", "gltf", ("cells", "attributes", "beside", "upright", "scenes")),
    Format(".vtu", "vtu", ("cells", "binary", "fields")),
    Format(".vtp", "vtp", ("cells", "binary", "fields")),
    Format(".vtk", "vtk", ("cells", "binary", "fields")),
    Format(".npz", "npz", ("cells", "binary", "fields")),
    Format(".gii", "neuro.gifti", ("cells", "binary", "fields", "attributes", "beside", "single")),
    Format(".surf", "neuro.freesurfer", ("cells", "binary", "attributes", "single")),
    Format(".mniobj", "neuro.mni_obj", ("cells",)),
    Format(".mesh", "medit", ("cells",)),
    Format(".meshb", "medit", ("cells",)),
    Format(".msh", "gmsh", ("cells",)),
    Format(".swc", "neuro.swc", ("cells",)),
    Format(".xyz", "points", ("points", "cloud")),
    Format(".pts", "points", ("points", "cloud")),
    Format(".pcd", "pcd", ("points",)),
    Format(".func.gii", "neuro.gifti", ("maps", "beside")),
    Format(".shape.gii", "neuro.gifti", ("maps", "beside")),
    Format(".label.gii", "neuro.gifti", ("maps", "parcels", "beside")),
    Format(".dscalar.nii", "neuro.cifti", ("maps",)),
    Format(".dtseries.nii", "neuro.cifti", ("maps",)),
    Format(".dlabel.nii", "neuro.cifti", ("maps", "parcels")),
    Format(".nii", "neuro.nifti", ("maps", "volume")),
    Format(".nii.gz", "neuro.nifti", ("maps", "volume")),
    Format(".curv", "neuro.freesurfer", ("maps",)),
    Format(".mgh", "neuro.freesurfer", ("maps", "volume")),
    Format(".mgz", "neuro.freesurfer", ("maps", "volume")),
    Format(".annot", "neuro.annotations", ("parcels",)),
    Format(".label", "neuro.annotations", ("parcels",)),
)
# FreeSurfer names a surface by what it is, such as lh.pial and lh.thickness. Such files are
# recognized by their first bytes, and named by the hemisphere if they are yet to be written.
SIGNATURES = {
    b"\xff\xff\xfe": ".surf",
    b"\xff\xff\xfd": ".surf",
    b"\xff\xff\xff": ".curv",
    b"#!ascii version of": ".surf",
}
HEMISPHERES = ("lh.", "rh.")
GZ = ".gz"  # after the suffix of any format: the file is unpacked when it is read

OTHER_VTK = (".vti", ".vtr", ".vts", ".vtm", ".vtmb", ".pvtu", ".pvtp", ".vtkhdf")
VTK_REMEDY = ' In PyVista, pyvista.read(path).extract_surface().save("a.vtp") writes the surface.'

TABLES = (".txt", ".csv", ".asc", ".dat")
TABLE_REMEDY = " Points, x y z on each line, are read from a file whose name ends in .xyz."


def suffixes_with(*traits: Trait) -> tuple[str, ...]:
    """Return the suffixes of the formats that have one of some traits."""
    return tuple(known.suffix for known in FORMATS if set(traits) & set(known.traits))


MESH_FORMATS = suffixes_with("cells")  # suffixes of the files that `read_mesh` reads
SHAPE_FORMATS = suffixes_with("cells", "points")  # and those that `read_shape` reads
POINT_FORMATS = suffixes_with("points")
FIELD_FORMATS = suffixes_with("fields", "maps")
MAP_FORMATS = suffixes_with("maps")
PARCEL_FORMATS = suffixes_with("parcels")
VOLUME_FORMATS = suffixes_with("volume")
WRITTEN = suffixes_with("text", "binary")
WRITTEN_CLOUDS = suffixes_with("cloud")
WITH_MORE = suffixes_with("attributes", "fields")  # than positions and faces
UPRIGHT = suffixes_with("upright")
WITH_COLORS = suffixes_with("colors")


def format_of(suffix: str) -> Format:
    """Return the format of a known suffix."""
    return next(known for known in FORMATS if known.suffix == suffix)


def suffix_in(name: str) -> str:
    """Return the longest known suffix of the name of a file, otherwise what follows its last dot.

    A file that is packed, such as lh.surf.gii.gz, has the suffix of what is in it.
    """
    name = name.lower()
    fitting = [known.suffix for known in FORMATS if name.endswith(known.suffix) and name[0] != "."]
    if not fitting and name.endswith(GZ):
        return suffix_in(name.removesuffix(GZ)) or GZ
    return max(fitting, key=len, default=Path(name).suffix)


def is_upright(path: Path) -> bool:
    """Whether the y axis points up in files of this name."""
    return suffix_in(path.name) in UPRIGHT


def signed_suffix(path: Path) -> str:
    """Return the suffix of a file that is known by its first bytes, otherwise an empty text."""
    with path.open("rb") as file:
        head = file.read(20)
    return suffix_of_bytes(head, path.stat().st_size)


def suffix_of_bytes(head: bytes, size: int) -> str:
    """Return the suffix of the format whose first bytes or size a file has, or an empty text."""
    if size == 6 + 2 * int.from_bytes(head[:3]):
        return ".curv"  # its old form: the numbers of vertices and faces, then 16 bits a vertex
    suffix = next((each for start, each in SIGNATURES.items() if head.startswith(start)), "")
    # Old surfaces of quadrangles begin as functions do, which have a 1 in their header: one number
    # a vertex. In a surface, the first vertex has its y and z there.
    return ".surf" if suffix == ".curv" and int.from_bytes(head[11:15]) != 1 else suffix


def suffix_to_write(path: Path, known: tuple[str, ...]) -> str:
    """Return the suffix that names the format of a file that is to be written; see `suffix_of`."""
    suffix = suffix_of(path, None, known)
    if path.name.lower().endswith(GZ) and not suffix.endswith(GZ):
        raise FileFormatError(
            f"A file must be written unpacked; {path} ends in {GZ}. Write {path.stem}, and pack it by "
            "gzip: packed files are read as they are."
        )
    return suffix


def suffix_of(path: Path, file_format: str | None, known: tuple[str, ...]) -> str:
    """Return the suffix that names the format, in lower case.

    Raise FileFormatError if the suffix is not one of the known ones, or the path is a folder.
    """
    suffix = suffix_in(path.name if file_format is None else f"a.{file_format.removeprefix('.')}")
    if suffix not in [each.suffix for each in FORMATS]:
        if path.is_file():
            suffix = signed_suffix(path) or suffix
        elif path.name.startswith(HEMISPHERES):
            written = [each for each in SIGNATURES.values() if each in known]
            suffix = written[0] if written else suffix
    if suffix not in known:
        if path.is_dir():
            inside = sorted(each for each in path.iterdir() if suffix_in(each.name) in known)
            example = f", such as {inside[0]}" if inside else ""
            raise FileFormatError(f"{path} must be a file; it is a folder. Name a file{example}.")
        found = f"is {suffix!r}" if suffix else "has no suffix"
        remedies = {
            VOLUME_FORMATS: " es.io.read_volume reads the volume in it.",
            MAP_FORMATS: " es.io.read_fields reads the functions in it.",
            PARCEL_FORMATS: " es.io.read_parcellation reads the parcels in it.",
            OTHER_VTK: VTK_REMEDY,
            TABLES: TABLE_REMEDY if ".xyz" in known else "",
        }
        remedy = "".join(text for kind, text in remedies.items() if suffix in kind)
        raise FileFormatError(
            f"{path} must be of a known format, {', '.join(known)}; it {found}.{remedy}"
        )
    return suffix
