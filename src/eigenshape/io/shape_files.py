"""Read and write shapes of any kind; what a reader returns is checked before anybody sees it."""

from pathlib import Path
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._errors import FileFormatError, InvalidShapeError
from eigenshape._files import read_regular, replace_file
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io import mesh_files, obj, pcd, ply, points, unstructured, vtk_polydata

POINTS = {".pts": points.parse, ".xyz": points.parse, ".pcd": pcd.parse}
EITHER = {".ply": ply.parse_any, ".obj": obj.parse_any}
WRITERS = {".xyz": points.format_text, ".pts": points.format_counted, ".ply": ply.format_points}
FORMATS = (*mesh_files.FORMATS, *unstructured.READERS, *POINTS)


def read_shape(
    path: str | Path, *, file_format: str | None = None, dim: SupportsIndex = 2, drop_missing: bool = False
) -> Shape:
    """Read a shape of any kind: what the file holds decides what comes back.

    Triangles in space become a TriangleMesh, tetrahedra, segments and flat triangles a SimplicialMesh, points without
    anything between them a PointCloud. Where a file holds simplices of several dimensions the highest count: the
    boundary triangles of a tetrahedral mesh are passed over. Points keep their order, those that nothing uses too.
    Polylines become segments, in OBJ and in VTK's POLYDATA.

    Parameters
    ----------
    path : str or Path
        OFF, OBJ, PLY, STL, GLB; .mesh, .msh, .vtk, .vtu; .pts, .xyz, .pcd.
    file_format : str, optional
        One of these suffixes, with or without its dot; by default that of the path.
    dim : int
        Dimension of the manifold that a cloud samples.
    drop_missing : bool
        Whether points of a cloud that are not finite, as scanners mark what they missed, are dropped. By default they
        are refused.

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
        If `dim` is larger than the space around.
    OSError
        If the system cannot open the file.
    """
    path = Path(path)
    suffix = _suffix(path, file_format)
    data = read_regular(path)
    try:
        with np.errstate(all="ignore"):  # what overflows is found by the check of the shape
            coordinates, simplices = _parse(path, suffix, data)
            if not simplices.size:
                return PointCloud(_finite(coordinates, drop_missing), dim)
            if simplices.shape[1] == 3 and coordinates.shape[1] == 3:
                return TriangleMesh(coordinates, simplices)
            return SimplicialMesh(coordinates, simplices)
    except (FileFormatError, InvalidShapeError) as err:
        name = "" if str(err).startswith(str(path)) else f"{path}: "
        raise type(err)(f"{name}{err}") from err


def _parse(path: Path, suffix: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    if suffix in POINTS:
        return POINTS[suffix](data), np.empty((0, 0), dtype=np.int64)
    if suffix in EITHER:
        return EITHER[suffix](data)
    if suffix in mesh_files.FORMATS:
        return mesh_files.FORMATS[suffix](data)
    if suffix == ".vtk" and vtk_polydata.is_polydata(data):
        return vtk_polydata.parse(data)
    return unstructured.read(path, suffix, data)


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
    path: str | Path, *, file_format: str | None = None, dim: SupportsIndex = 2, drop_missing: bool = False
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
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise FileFormatError(f"{path} must end in {', '.join(WRITERS)} to hold points; it ends in {path.suffix!r}.")
    if cloud.points.shape[1] != 3:
        raise InvalidShapeError(f"Files of points hold three coordinates; these points have {cloud.points.shape[1]}.")
    replace_file(path, WRITERS[suffix](cloud.points))


def _suffix(path: Path, file_format: str | None) -> str:
    suffix = path.suffix.lower() if file_format is None else f".{file_format.lower().removeprefix('.')}"
    if suffix not in FORMATS:
        raise FileFormatError(f"{path} must be of a known format, {', '.join(FORMATS)}; it is {suffix!r}.")
    return suffix
