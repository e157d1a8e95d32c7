"""Read and write shapes of any kind; what a reader returns is checked before anybody sees it."""

from pathlib import Path
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._errors import FileFormatError, InvalidShapeError
from eigenshape._files import read_regular, replace_file
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io import pcd, ply, points
from eigenshape.io.cells import CellKind, require_kind
from eigenshape.io.parsing import MESH_FORMATS, naming, parse_mesh, suffix_of

POINTS = {".pts": points.parse, ".xyz": points.parse, ".pcd": pcd.parse}
WRITERS = {".xyz": points.format_text, ".pts": points.format_counted, ".ply": ply.format_points}
FORMATS = (*MESH_FORMATS, *POINTS)


def read_shape(
    path: str | Path,
    *,
    file_format: str | None = None,
    dim: SupportsIndex = 2,
    drop_missing: bool = False,
    cells: CellKind | None = None,
) -> Shape:
    """Read a shape of any kind: what the file holds decides what comes back.

    Triangles in space become a TriangleMesh, tetrahedra, segments and flat triangles a SimplicialMesh, points without
    anything between them a PointCloud. Where a file holds simplices of several dimensions the highest count: the
    boundary triangles of a tetrahedral mesh are passed over. Points keep their order, those that nothing uses too.
    Polylines become segments, in OBJ and in VTK files.

    Legacy VTK files of POLYDATA write tetrahedra and quads alike, as polygons of four corners. They are taken for quads
    where all are flat or where they join as the faces of a surface do, and for tetrahedra where most share three
    corners with another and some side belongs to more than two. Where neither is so, `cells` must say it.

    Parameters
    ----------
    path : str or Path
        OFF, OBJ, PLY, STL, GLB, glTF; .mesh, .msh, .vtk, .vtu; .pts, .xyz, .pcd.
    file_format : str, optional
        One of these suffixes, with or without its dot; by default that of the path.
    dim : int
        Dimension of the manifold that a cloud samples.
    drop_missing : bool
        Whether points of a cloud that are not finite, as scanners mark what they missed, are dropped. By default they
        are refused.
    cells : {"triangles", "quads", "tetrahedra"}, optional
        The cells to read, such as the boundary triangles of a tetrahedral mesh; "quads" become two triangles each and
        bring the triangles between them along. By default those of the highest dimension.

    Returns
    -------
    TriangleMesh, SimplicialMesh or PointCloud

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is no regular file, the content is not what it declares, or cells are no
        simplices.
    InvalidShapeError
        If a coordinate is not finite, a simplex does not index the points, or there is none.
    InvalidParameterError
        If `dim` is larger than the space around, or `cells` unknown.
    OSError
        If the system cannot open the file.
    """
    path = Path(path)
    suffix = suffix_of(path, file_format, FORMATS)
    require_kind(cells)
    data = read_regular(path)
    with naming(path):
        if suffix in POINTS:
            return PointCloud(_finite(POINTS[suffix](data), drop_missing), dim)
        coordinates, simplices = parse_mesh(path, suffix, data, cells)
        if not len(simplices):
            return PointCloud(_finite(coordinates, drop_missing), dim)
        if simplices.shape[1] == 3 and coordinates.shape[1] == 3:
            return TriangleMesh(coordinates, simplices)
        return SimplicialMesh(coordinates, simplices)


def _finite(coordinates: Float[np.ndarray, "n d"], drop_missing: bool) -> Float[np.ndarray, "m d"]:
    finite = np.isfinite(coordinates).all(axis=1)
    if drop_missing or finite.all():
        return coordinates[finite]
    first = int(np.argmin(finite))
    raise InvalidShapeError(
        f"points must be finite; point {first} is {coordinates[first].tolist()} ({np.count_nonzero(~finite)} such). "
        "Scanners mark so what they missed: drop_missing=True, or --drop-missing, leaves it out."
    )


def read_points(
    path: str | Path,
    *,
    file_format: str | None = None,
    dim: SupportsIndex = 2,
    drop_missing: bool = False,
) -> PointCloud:
    """Read a cloud of points; faces and cells between them are passed over.

    Parameters
    ----------
    path, file_format, dim, drop_missing
        As in `read_shape`.

    Returns
    -------
    PointCloud

    Raises
    ------
    FileFormatError, InvalidShapeError, InvalidParameterError, OSError
        As `read_shape`.
    """
    found = read_shape(path, file_format=file_format, dim=dim, drop_missing=drop_missing)
    return found if isinstance(found, PointCloud) else PointCloud(found.points, dim)


def write_points(cloud: PointCloud, path: str | Path) -> None:
    """Write the points of a cloud in space to an XYZ, PTS or binary PLY file, which reads back exactly.

    Raises
    ------
    FileFormatError
        If the suffix is another.
    InvalidShapeError
        If the points are not in R³.
    OSError
        If the system cannot write there.
    """
    require_type(cloud, PointCloud, "cloud")
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise FileFormatError(
            f"{path} must end in {', '.join(WRITERS)} to hold points; it ends in {path.suffix!r}."
        )
    if cloud.points.shape[1] != 3:
        raise InvalidShapeError(
            f"Files of points hold three coordinates; these points have {cloud.points.shape[1]}."
        )
    replace_file(path, WRITERS[suffix](cloud.points))
