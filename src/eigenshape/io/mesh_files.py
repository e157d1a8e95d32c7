"""Read and write meshes; what a reader returns is checked before anybody sees it."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int, UInt8

from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape._files import read_regular, replace_file
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io import glb, obj, off, ply, stl
from eigenshape.io.cells import CellKind, require_kind
from eigenshape.io.parsing import MESH_FORMATS, naming, parse_mesh, suffix_of

TEXT = {
    ".off": off.format_mesh,
    ".obj": obj.format_mesh,
    ".ply": ply.format_text,
    ".stl": stl.format_text,
}
BINARY = {".ply": ply.format_binary, ".stl": stl.format_binary, ".glb": glb.format_mesh}
WRITTEN = tuple({**TEXT, **BINARY})


def read_mesh(
    path: str | Path, *, file_format: str | None = None, cells: CellKind | None = None
) -> TriangleMesh:
    """Read a triangle mesh from a file of any format that can hold one.

    Vertices keep their order and are neither joined nor split, but in STL, which cannot say that corners are shared:
    there equal coordinates become one vertex. Polygons become fans of triangles around their first corner. Colors,
    normals, textures and materials are passed over. The file is read whole into memory.

    Parameters
    ----------
    path : str or Path
        OFF, OBJ, PLY, STL, GLB, glTF; surfaces in .mesh, .msh, .vtk, .vtu.
    file_format : str, optional
        One of these suffixes, with or without its dot, in any case; by default that of the path.
    cells : {"triangles", "quads", "tetrahedra"}, optional
        The cells to read, where the file holds several kinds or does not say which; see `read_shape`.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is no regular file, the content is not what it declares, or it holds no
        triangles in space.
    InvalidShapeError
        If a coordinate is not finite, a face does not index the vertices, or there is none.
    InvalidParameterError
        If `cells` is unknown.
    OSError
        If the system cannot open the file; FileNotFoundError where there is none.
    """
    path = Path(path)
    suffix = suffix_of(path, file_format, MESH_FORMATS)
    require_kind(cells)
    data = read_regular(path)
    with naming(path):
        points, simplices = parse_mesh(path, suffix, data, cells)
        _require_surface(points, simplices)
        return TriangleMesh(points, simplices)


def _require_surface(points: np.ndarray, simplices: np.ndarray) -> None:
    if not len(simplices):
        raise FileFormatError(
            f"A mesh file must hold triangles; it holds {len(points)} points and no face, and no repair makes faces."
        )
    n_corners, dim = simplices.shape[1], points.shape[1]
    if (n_corners, dim) != (3, 3):
        what = {2: "segments", 3: "triangles", 4: "tetrahedra"}[n_corners]
        remedy = (
            ' cells="triangles" reads the triangles beside them, if there are any.'
            if n_corners == 4
            else ""
        )
        raise FileFormatError(
            f"A mesh file must hold triangles in R^3; it holds {len(simplices)} {what} in R^{dim}, which read_shape "
            f"reads.{remedy}"
        )


def write_mesh(
    mesh: MeshLike,
    path: str | Path,
    *,
    binary: bool | None = None,
    colors: UInt8[np.ndarray, "n 3"] | None = None,
    face_labels: Int[np.ndarray, " f"] | None = None,
) -> None:
    """Write a mesh in the format that the suffix names; the file appears whole or not at all.

    OFF, OBJ and PLY read back exactly, vertex by vertex. STL keeps triangles only, GLB and binary STL single
    precision.

    Parameters
    ----------
    mesh : MeshLike
    path : str or Path
    binary : bool, optional
        PLY and STL: binary by default. OFF and OBJ are text, GLB is binary.
    colors : (n, 3) uint8, optional
        Red, green and blue of each vertex; PLY only.
    face_labels : (f,) int, optional
        A whole number of 32 bits for each face, such as its part; PLY only, as the property `label` of faces.

    Raises
    ------
    FileFormatError
        If the suffix is unknown, or coordinates do not fit into single precision where the format has no other.
    InvalidParameterError
        If the format has no such kind, takes no colors or labels, or they are not one a vertex or face.
    OSError
        If the system cannot write there.
    """
    mesh = as_mesh(mesh)
    path = Path(path)
    suffix = suffix_of(path, None, WRITTEN)
    write = _writer(suffix, suffix in BINARY if binary is None else binary)
    if colors is not None:
        write = partial(write, colors=_colors(colors, mesh, suffix))
    if face_labels is not None:
        write = partial(write, face_labels=_labels(face_labels, mesh, suffix))
    try:
        data = write(mesh)
    except FileFormatError as err:
        raise FileFormatError(f"{path} cannot hold the mesh. {err}") from err
    replace_file(path, data)


def _writer(suffix: str, binary: bool) -> Callable[..., bytes]:
    writers: dict[str, Callable[..., bytes]] = {**(BINARY if binary else TEXT)}
    if suffix not in writers:
        raise InvalidParameterError(
            f"binary={binary} is for {', '.join(writers)}; the suffix is {suffix}."
        )
    return writers[suffix]


def _colors(colors: np.ndarray, mesh: TriangleMesh, suffix: str) -> np.ndarray:
    if suffix != ".ply" or colors.dtype != np.uint8 or colors.shape != (mesh.n_vertices, 3):
        raise InvalidParameterError(
            f"colors must be ({mesh.n_vertices}, 3) uint8 and go to a PLY file; they are {colors.shape} {colors.dtype} "
            f"and go to {suffix}."
        )
    return colors


def _labels(labels: np.ndarray, mesh: TriangleMesh, suffix: str) -> np.ndarray:
    if suffix != ".ply" or labels.shape != (mesh.n_faces,):
        raise InvalidParameterError(
            f"face_labels must be ({mesh.n_faces},) and go to a PLY file; they are {labels.shape} and go to {suffix}."
        )
    beyond = np.flatnonzero(labels != labels.astype(np.int32))
    if beyond.size:
        raise InvalidParameterError(
            f"face_labels must fit into 32 bits; that of face {beyond[0]} is {labels[beyond[0]]}."
        )
    return labels
