"""Read and write shapes of any kind. The content of a file is checked before a shape is returned."""

from collections.abc import Sequence
from pathlib import Path

from certeig.kit.arguments import require_type
from certeig.kit.files import as_path, replace_file
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape._typing import FileLike
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.repairs.repair_report import RepairedCloud, RepairedMesh
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh
from eigenshape.io.formats.cells import require_kind
from eigenshape.io.formats.registry import (
    SHAPE_FORMATS,
    WRITTEN_CLOUDS,
    CellKind,
    format_of,
    suffix_to_write,
)
from eigenshape.io.mesh_files import parse_file, require_finite
from eigenshape.io.opening import naming, open_file


def read_shape(
    path: FileLike,
    *,
    file_format: str | None = None,
    dim: Integer = 2,
    drop_missing: bool = False,
    cells: CellKind | None = None,
    scene: str | int | None = None,
) -> Shape:
    r"""Read a shape of any kind from a file.

    The content decides the type. Triangles in R³ become a TriangleMesh; tetrahedra, segments and
    triangles in the plane a SimplicialMesh; points without cells a PointCloud. If a file holds
    simplices of several dimensions, those of the highest dimension are read, and the others, such
    as the boundary triangles of a tetrahedral mesh, are ignored. Points keep their order, and
    points that no simplex uses are kept. Polylines in OBJ and VTK files become segments.

    Legacy VTK files with POLYDATA store tetrahedra and quads in the same way, as polygons of four
    corners. They are read as quads if all are flat or if they join like the faces of a surface, and
    as tetrahedra if most share three corners with another and some side belongs to more than two.
    In other cases `cells` must be given.

    Parameters
    ----------
    path : str, Path, bytes or binary file
        A file of a format in `eigenshape.io.SHAPE_FORMATS`, such as .ply, .msh, .vtu or .xyz, also
        packed by gzip; its content; or the file, open for reading bytes.
    file_format : str, optional
        Suffix of the format, such as "ply" or ".ply". By default the suffix of the path. Bytes that
        do not begin with the name of their format need it.
    dim : int
        Dimension of the manifold that a point cloud samples.
    drop_missing : bool
        Whether to leave out points that are not finite, and the simplices at them. Scanners write
        such points if they measured nothing. By default they raise an error.
    cells : {"triangles", "quads", "tetrahedra"}, optional
        Kind of cells to read, such as the boundary triangles of a tetrahedral mesh. Quads become
        two triangles each, and triangles between them are read too. By default the cells of the
        highest dimension.
    scene : str or int, optional
        Name or number of the scene of a glTF file. By default the one that the file names.

    Returns
    -------
    TriangleMesh, SimplicialMesh or PointCloud

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is not a regular file, the content differs from what its
        header declares, or cells are not simplices.
    InvalidShapeError
        If a coordinate is not finite, a simplex has an index that is not that of a point, or there
        are no points.
    InvalidParameterError
        If `dim` is larger than the number of coordinates, or `cells` is unknown.
    OSError
        If the system cannot open the file.

    See Also
    --------
    read_mesh : Read triangles only.
    read_points : Read points only.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "curve.obj")
    >>> _ = path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2 3")
    >>> curve = es.read_shape(path)
    >>> curve.dim, curve.simplices.tolist()
    (1, [[0, 1], [1, 2]])
    """
    found = load_shape(
        path,
        ("drop_missing",) if drop_missing else (),
        file_format=file_format,
        dim=dim,
        cells=cells,
        scene=scene,
    )
    return found.cloud if isinstance(found, RepairedCloud) else found.mesh


def load_shape(
    path: FileLike,
    repairs: Sequence[str] = (),
    *,
    file_format: str | None = None,
    dim: Integer = 2,
    cells: CellKind | None = None,
    scene: str | int | None = None,
) -> RepairedMesh[Mesh] | RepairedCloud:
    """Read a shape as `read_shape` does, repair it, and report what was left out and done."""
    require_kind(cells)
    source = open_file(path, file_format, SHAPE_FORMATS, scene)
    with naming(source.path):
        points, simplices = parse_file(source, cells)
        n_cells, n_corners = simplices.shape
        drop_missing = "auto" in repairs or "drop_missing" in repairs
        points, simplices, kept, left_out = require_finite(
            points, simplices, drop_missing=drop_missing
        )
        if not n_cells:
            cloud = repair(PointCloud(points, dim), repairs)
            return RepairedCloud(cloud.cloud, left_out + cloud.report, kept[cloud.source_points])
        in_space = n_corners == points.shape[1] == 3
        mesh = (TriangleMesh if in_space else SimplicialMesh)(points, simplices)
        done = repair(mesh, repairs)
        return RepairedMesh(done.mesh, left_out + done.report, kept[done.source_vertices])


def read_points(
    path: FileLike,
    *,
    file_format: str | None = None,
    dim: Integer = 2,
    drop_missing: bool = False,
) -> PointCloud:
    r"""Read a point cloud from a file. Faces and cells are ignored.

    Parameters
    ----------
    path : str, Path, bytes or binary file
        A file of any format of `read_shape`.
    file_format : str, optional
        Suffix of the format. By default the suffix of the path.
    dim : int
        Dimension of the manifold that the points sample.
    drop_missing : bool
        Whether to leave out points that are not finite.

    Returns
    -------
    PointCloud

    Raises
    ------
    FileFormatError, InvalidShapeError, InvalidParameterError, OSError
        As in `read_shape`.

    See Also
    --------
    eigenshape.io.write_points : Write a point cloud.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "corners.xyz")
    >>> _ = path.write_text("0 0 0\n1 0 0\n0 1 0\n")
    >>> cloud = es.io.read_points(path, dim=2)
    >>> cloud.points.shape, cloud.dim
    ((3, 3), 2)
    """
    found = read_shape(path, file_format=file_format, dim=dim, drop_missing=drop_missing)
    return found if isinstance(found, PointCloud) else PointCloud(found.points, dim)


def write_points(cloud: PointCloud, path: str | Path) -> None:
    """Write a point cloud in R³ to an XYZ, PTS or binary PLY file.

    `read_points` reads the file back exactly.

    Parameters
    ----------
    cloud : PointCloud
    path : str or Path
        Must end in .xyz, .pts or .ply.

    Raises
    ------
    FileFormatError
        If the path has another suffix.
    InvalidShapeError
        If the points are not in R³.
    OSError
        If the system cannot write the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.xyz")
    >>> cloud = es.PointCloud(es.icosphere(1).vertices, dim=2)
    >>> es.io.write_points(cloud, path)
    >>> bool((es.io.read_points(path).points == cloud.points).all())
    True
    """
    require_type(cloud, PointCloud, "cloud")
    path = as_path(path)
    suffix = suffix_to_write(path, WRITTEN_CLOUDS)
    if cloud.points.shape[1] != 3:
        raise InvalidShapeError(
            f"Files of points hold three coordinates; these points have {cloud.points.shape[1]}."
        )
    replace_file(path, format_of(suffix).load().format_points(cloud.points, suffix))
