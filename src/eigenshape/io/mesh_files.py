"""Read and write meshes; what a reader returns is checked before anybody sees it."""

from pathlib import Path
from types import ModuleType

import numpy as np
from jaxtyping import UInt8

from eigenshape._errors import FileFormatError, InvalidParameterError, InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io import glb, obj, off, ply, stl
from eigenshape.io.files import read_regular, replace_file

FORMATS = {".off": off, ".obj": obj, ".ply": ply, ".stl": stl, ".glb": glb}


def read_mesh(path: str | Path) -> TriangleMesh:
    """Read a triangle mesh from an OFF, OBJ, PLY, STL or GLB file.

    Vertices keep their order and are neither joined nor split, but in STL, which cannot say that corners are shared:
    there equal coordinates become one vertex. Polygons become fans of triangles.

    Parameters
    ----------
    path : str or Path
        The suffix, in any case, names the format.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    FileFormatError
        If the suffix is unknown, the path is no regular file, or the content is not what it declares.
    InvalidShapeError
        If a coordinate is not finite, or a face does not index the vertices.
    OSError
        If the system cannot open the file.
    """
    path = Path(path)
    module = _format_of(path)
    data = read_regular(path)
    try:
        return TriangleMesh(*module.parse(data))
    except FileFormatError as err:
        raise FileFormatError(f"{path}: {err}") from err
    except InvalidShapeError as err:
        raise InvalidShapeError(f"{path}: {err}") from err


def write_mesh(mesh: TriangleMesh, path: str | Path, *, colors: UInt8[np.ndarray, "n 3"] | None = None) -> None:
    """Write a mesh in the format that the suffix names; the file appears whole or not at all.

    OFF, OBJ and PLY read back exactly. STL and GLB hold single precision.

    Parameters
    ----------
    mesh : TriangleMesh
    path : str or Path
        PLY and STL are written in binary.
    colors : (n, 3) uint8, optional
        Red, green and blue of each vertex; PLY only.

    Raises
    ------
    FileFormatError
        If the suffix is unknown, or a coordinate does not fit the format.
    InvalidParameterError
        If colours are given for a format that does not take them, or not one a vertex.
    """
    path = Path(path)
    module = _format_of(path)
    if colors is None:
        replace_file(path, module.format_mesh(mesh))
        return
    if module is not ply or colors.shape != (mesh.n_vertices, 3):
        raise InvalidParameterError(
            f"colors must be ({mesh.n_vertices}, 3) and go to a PLY file; they are {colors.shape} and go to {path}."
        )
    replace_file(path, ply.format_mesh(mesh, colors=colors))


def _format_of(path: Path) -> ModuleType:
    if path.suffix.lower() not in FORMATS:
        raise FileFormatError(f"{path} must end in {', '.join(FORMATS)}; it ends in {path.suffix!r}.")
    return FORMATS[path.suffix.lower()]
