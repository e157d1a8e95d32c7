"""Read and write meshes; what a reader returns is checked before anybody sees it."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from eigenshape._errors import FileFormatError, InvalidParameterError, InvalidShapeError
from eigenshape._files import read_regular, replace_file
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io import glb, obj, off, ply, stl

FORMATS = {".off": off.parse, ".obj": obj.parse, ".ply": ply.parse, ".stl": stl.parse, ".glb": glb.parse}
TEXT = {".off": off.format_mesh, ".obj": obj.format_mesh, ".ply": ply.format_text, ".stl": stl.format_text}
BINARY = {".ply": ply.format_binary, ".stl": stl.format_binary, ".glb": glb.format_mesh}


def read_mesh(path: str | Path, *, file_format: str | None = None) -> TriangleMesh:
    """Read a triangle mesh from an OFF, OBJ, PLY, STL or GLB file.

    Vertices keep their order and are neither joined nor split, but in STL, which cannot say that corners are shared:
    there equal coordinates become one vertex. Polygons become fans of triangles around their first corner. Colours,
    normals, textures and materials are passed over. The file is read whole into memory.

    Parameters
    ----------
    path : str or Path
    file_format : str, optional
        "off", "obj", "ply", "stl" or "glb", in any case; by default the suffix says it.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is no regular file, or the content is not what it declares.
    InvalidShapeError
        If a coordinate is not finite, a face does not index the vertices, or there is none.
    OSError
        If the system cannot open the file; FileNotFoundError where there is none.
    """
    path = Path(path)
    parse = FORMATS[_suffix(path, file_format)]
    data = read_regular(path)
    try:
        with np.errstate(all="ignore"):  # what overflows is found by the check of the mesh
            return TriangleMesh(*parse(data))
    except (FileFormatError, InvalidShapeError) as err:
        raise type(err)(f"{path}: {err}") from err


def write_mesh(
    mesh: TriangleMesh, path: str | Path, *, binary: bool | None = None, colors: UInt8[np.ndarray, "n 3"] | None = None
) -> None:
    """Write a mesh in the format that the suffix names; the file appears whole or not at all.

    OFF, OBJ and PLY read back exactly, vertex by vertex. STL keeps triangles only, GLB and binary STL single
    precision.

    Parameters
    ----------
    mesh : TriangleMesh
    path : str or Path
    binary : bool, optional
        PLY and STL: binary by default. OFF and OBJ are text, GLB is binary.
    colors : (n, 3) uint8, optional
        Red, green and blue of each vertex; PLY only.

    Raises
    ------
    FileFormatError
        If the suffix is unknown, or coordinates do not fit into single precision where the format has no other.
    InvalidParameterError
        If the format has no such kind, or takes no colours, or they are not one a vertex.
    OSError
        If the system cannot write there.
    """
    path = Path(path)
    suffix = _suffix(path, None)
    write = _writer(suffix, suffix in BINARY if binary is None else binary)
    if colors is not None:
        write = partial(write, colors=_colors(colors, mesh, suffix))
    try:
        data = write(mesh)
    except FileFormatError as err:
        raise FileFormatError(f"{path} cannot hold the mesh. {err}") from err
    replace_file(path, data)


def _suffix(path: Path, file_format: str | None) -> str:
    suffix = path.suffix.lower() if file_format is None else f".{file_format.lower().removeprefix('.')}"
    if suffix not in FORMATS:
        raise FileFormatError(f"{path} must be of a known format, {', '.join(FORMATS)}; it is {suffix!r}.")
    return suffix


def _writer(suffix: str, binary: bool) -> Callable[..., bytes]:
    writers: dict[str, Callable[..., bytes]] = {**(BINARY if binary else TEXT)}
    if suffix not in writers:
        raise InvalidParameterError(f"binary={binary} is for {', '.join(writers)}; the suffix is {suffix}.")
    return writers[suffix]


def _colors(colors: np.ndarray, mesh: TriangleMesh, suffix: str) -> np.ndarray:
    if suffix != ".ply" or colors.dtype != np.uint8 or colors.shape != (mesh.n_vertices, 3):
        raise InvalidParameterError(
            f"colors must be ({mesh.n_vertices}, 3) uint8 and go to a PLY file; they are {colors.shape} {colors.dtype} "
            f"and go to {suffix}."
        )
    return colors
