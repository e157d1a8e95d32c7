"""What a file is by its first bytes, whatever its name says."""

import re
from typing import NamedTuple

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.registry import format_of

LOOKED_AT = 4096  # bytes; what comes before the first element of XML or JSON fits into them


class Kind(NamedTuple):
    """A kind of file.

    Attributes
    ----------
    noun : str
    suffix : str
        Of the format as which it is read; empty if there is none.
    remedy : str
        What to do with a file that is not read.
    """

    noun: str
    suffix: str = ""
    remedy: str = "Save it from the program that made it in a format of its list."


UNPACK = "Unpack it, and read what is in it."
DOWNLOAD = "The address of a page was saved in place of the file; save the file itself."
ARCHIVE = Kind("a ZIP archive, as .zip and .3mf files are", remedy=UNPACK)  # .npz is one, too
# Patterns of the first bytes, in the order in which they are tried.
KINDS = {
    rb"ply[\r\n]": Kind("a PLY file", ".ply"),
    rb"(ST)?C?N?C?4?n?OFF\b": Kind("an OFF file", ".off"),
    rb"glTF": Kind("a GLB file", ".glb"),
    rb"# vtk DataFile": Kind("a legacy VTK file", ".vtk"),
    rb"\s*\$MeshFormat": Kind("a gmsh file", ".msh"),
    rb"\s*MeshVersionFormatted": Kind("a Medit file", ".mesh"),
    rb"# \.PCD": Kind("a PCD file", ".pcd"),
    rb"solid\s.*\s+facet\b": Kind("an STL file", ".stl"),
    rb"\xff\xff[\xfd\xfe]|#!ascii version of": Kind("a surface of FreeSurfer", ".surf"),
    rb"\xff\xff\xff\xff": Kind(
        "a patch of FreeSurfer",
        remedy="Read the whole surface, and cut it by es.geometry.mask_surface.",
    ),
    # The first numbers are shares of light: in text, or floats from 0 to 1 in either byte order.
    rb"P\s+[\d.]|p(?=.{0,23}[\x00\x80-\xff])([\x00=>?]...|...[\x00=>?])": Kind(
        "an MNI object", ".mniobj"
    ),
    rb"ascii\s+VOID|binar(ABCD|DCBA)": Kind("a mesh of BrainVISA", remedy="Save it as GIFTI, .gii."),
    rb"\s*\{.*\"asset\"\s*:": Kind("a glTF file", ".gltf"),
    rb"\s*<.*<VTKFile[^>]*\"UnstructuredGrid\"": Kind("a VTU file", ".vtu"),
    rb"\s*<.*<VTKFile[^>]*\"PolyData\"": Kind("a VTP file", ".vtp"),
    rb"\s*<.*<GIFTI\b": Kind("a GIFTI file", ".gii"),
    rb"\s*(<\?xml[^>]*>\s*)?<(!DOCTYPE )?html": Kind("a page of HTML", remedy=DOWNLOAD),
    rb"version https://git-lfs": Kind(
        "a pointer of Git LFS", remedy="The file itself is not there; get it by `git lfs pull`."
    ),
    rb"\xff\xfe|\xfe\xff": Kind(
        "text in UTF-16", remedy="Save it as UTF-8, for instance from a text editor."
    ),
    rb"PK\x03\x04": ARCHIVE,
    rb"BZh|\xfd7zXZ|\x28\xb5\x2f\xfd|7z\xbc\xaf|Rar!": Kind("a packed file", remedy=UNPACK),
    rb"\x89HDF": Kind("an HDF5 file"),
    rb"Kaydara FBX|; FBX": Kind("an FBX file", remedy="Save it as GLB."),
    rb"BLENDER": Kind("a file of Blender", remedy="Export it as GLB, PLY or OBJ."),
    rb"\s*<.*<COLLADA\b": Kind("a COLLADA file", remedy="Save it as GLB."),
    rb"#VRML|#X3D": Kind("a VRML file", remedy="Save it as PLY or GLB."),
    rb"ISO-10303-21": Kind("a STEP file", remedy="Mesh it, and save it as STL."),
    rb"\x89PNG|\xff\xd8\xff[\xdb\xe0\xe1\xee]|%PDF|GIF8": Kind("a picture or a document"),
}  # fmt: skip
COMPILED = {re.compile(pattern, re.DOTALL): kind for pattern, kind in KINDS.items()}


def recognize(data: bytes) -> Kind | None:
    """Return what a file is by its first bytes; None if they may be anything."""
    head = data[:LOOKED_AT]
    return next((kind for pattern, kind in COMPILED.items() if pattern.match(head)), None)


def require_content(found: Kind | None, suffix: str) -> None:
    """Raise an error if the first bytes of a file are those of another format than its suffix."""
    if found is None or (suffix == ".npz" and found is ARCHIVE):
        return
    remedy = found.remedy
    if found.suffix:
        if format_of(found.suffix).module == format_of(suffix).module:
            return
        remedy = f"Let its name end in {found.suffix}, or pass file_format={found.suffix!r}."
    raise FileFormatError(f"A file in {suffix} must hold that format; it is {found.noun}. {remedy}")
