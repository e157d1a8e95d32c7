"""Read and write meshes. The content of a file is checked before a mesh is returned."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int, UInt8

from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape._files import as_path, read_regular, replace_file
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io import glb, obj, off, ply, stl
from eigenshape.io.cell_kinds import CellKind
from eigenshape.io.cells import require_kind
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
    r"""Read a triangle mesh from a file.

    Vertices keep their order and are neither merged nor split. The exception is STL, which does not
    store shared vertices: there, corners with equal coordinates become one vertex. Polygons become
    fans of triangles around their first corner. Colors, normals, textures and materials are
    ignored. The whole file is read into memory.

    Parameters
    ----------
    path : str or Path
        A file in OFF, OBJ, PLY, STL, GLB or glTF, or a surface in .mesh, .msh, .vtk or .vtu.
    file_format : str, optional
        Suffix of the format, such as "ply" or ".ply". By default the suffix of the path.
    cells : {"triangles", "quads", "tetrahedra"}, optional
        Kind of cells to read, if the file holds several kinds or does not name the kind; see
        `read_shape`.

    Returns
    -------
    TriangleMesh
        With vertices (n, 3) in the unit of the file.

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is not a regular file, the content differs from what its
        header declares, or it holds no triangles in R³.
    InvalidShapeError
        If a coordinate is not finite, or a face has an index that is not that of a vertex.
    InvalidParameterError
        If `cells` is unknown.
    OSError
        If the system cannot open the file, such as FileNotFoundError.

    See Also
    --------
    read_shape : Read a shape of any kind, also tetrahedra, curves and points.
    write_mesh : Write a mesh.
    repair : Repair a mesh with faults.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "square.off")
    >>> _ = path.write_text("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    >>> mesh = es.read_mesh(path)
    >>> mesh.faces.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    path = as_path(path)
    suffix = suffix_of(path, file_format, MESH_FORMATS)
    require_kind(cells)
    data = read_regular(path)
    with naming(path):
        points, simplices = parse_mesh(path, suffix, data, cells)
        require_surface(points, simplices)
        return TriangleMesh(points, simplices)


def require_surface(points: np.ndarray, simplices: np.ndarray) -> None:
    """Raise an error if simplices are no triangles in R³."""
    if not len(simplices):
        raise FileFormatError(
            f"A mesh file must hold triangles; it holds {len(points)} points and no face. "
            "read_points reads points, and es.io.read_surface makes a surface of them."
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
    """Write a mesh to a file, in the format of its suffix.

    The file appears complete or not at all. `read_mesh` reads OFF, OBJ and PLY back exactly. STL
    stores triangles without shared vertices; GLB and binary STL store single precision.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices and f faces.
    path : str or Path
        Must end in .off, .obj, .ply, .stl or .glb.
    binary : bool, optional
        Whether to write binary data. By default True for PLY and STL. OFF and OBJ are always text,
        GLB always binary.
    colors : (n, 3) uint8, optional
        Red, green and blue of each vertex; only for PLY.
    face_labels : (f,) int, optional
        A whole number of 32 bits for each face, such as the number of its part. Only for PLY, where
        it is the property `label` of faces.

    Raises
    ------
    FileFormatError
        If the suffix is unknown, or the format has only single precision and coordinates do not fit
        into it.
    InvalidParameterError
        If the format has no such binary or text form, if it takes no colors or labels, or if their
        shapes are wrong.
    OSError
        If the system cannot write the file.

    See Also
    --------
    read_mesh : Read a mesh.
    eigenshape.plot.value_colors, eigenshape.plot.part_colors : Compute colors.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.ply")
    >>> es.write_mesh(mesh, path, colors=es.plot.value_colors(mesh.vertices[:, 1]))
    >>> bool((es.read_mesh(path).vertices == mesh.vertices).all())
    True
    """
    mesh = as_mesh(mesh)
    path = as_path(path)
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
