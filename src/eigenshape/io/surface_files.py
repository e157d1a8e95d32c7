"""Read a surface from a file of any kind: a mesh as it is, one made of points, or the boundary of tetrahedra."""

from collections.abc import Sequence

import numpy as np

from eigenshape._typing import FileLike
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair as apply_repairs
from eigenshape.geometry.repairs.repair import suggest_repairs
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.io.formats import pcd
from eigenshape.io.formats.registry import SHAPE_FORMATS
from eigenshape.io.mesh_files import parse_file, require_finite, require_surface
from eigenshape.io.opening import SourceFile, naming, open_file
from eigenshape.scans.frames import triangulate_frame
from eigenshape.scans.reconstruction import reconstruct_surface


def read_surface(
    path: FileLike,
    *,
    repair: Sequence[str] = (),
    file_format: str | None = None,
    scene: str | int | None = None,
) -> RepairedMesh[TriangleMesh]:
    r"""Read a mesh, or make a surface of tetrahedra, points or a depth scan; repair it.

    A depth scan is a PCD file with more than one row: pixels that are neighbors on its grid and in
    space are joined, as a camera at the origin sees them, and the surface faces the camera. Points
    without an order become the surface whose normals fit theirs (Poisson reconstruction). It is
    closed where they leave only small holes, and rounds off what is thinner than a few times the
    distance between them. Points that are not finite, with the faces at them, and all but the
    first of equal points of a cloud are left out. Of tetrahedra it is the boundary. Triangles in
    the plane are taken at z = 0.

    Parameters
    ----------
    path : str, Path, bytes or binary file
        A file of any format of `read_shape`.
    repair : sequence of str
        Names of repairs, as `es.repair` takes them, such as ["auto"].
    file_format : str, optional
        Suffix of the format. By default the suffix of the path.
    scene : str or int, optional
        Name or number of the scene of a glTF file. By default the one that the file names.

    Returns
    -------
    RepairedMesh
        The surface, with a report that says what it was made of and what was repaired. It is empty
        for a mesh without repairs. The source of a vertex is its point in the file, or the nearest
        one.

    Raises
    ------
    FileFormatError, InvalidShapeError, InvalidParameterError, OSError
        As in `read_mesh` and `repair`, or if no surface can be made of the points: there are fewer than 100, or
        it would miss more than a tenth of them.

    See Also
    --------
    read_mesh : Read a mesh, and nothing else.
    eigenshape.retrieval.build_index : Index such files.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.xyz")
    >>> es.io.write_points(es.PointCloud(es.icosphere(3).vertices), path)
    >>> ball = es.io.read_surface(path)
    >>> es.geometry.is_closed(ball.mesh)
    True
    >>> ball.report
    ('reconstruct_surface made 2,000 vertices and 3,996 faces of 642 points',)
    """
    source = open_file(path, file_format, SHAPE_FORMATS, scene)
    with naming(source.path):
        made = _surface_of(source)
        done = apply_repairs(made.mesh, repair)
    # Verbs look for seams by themselves: that there are none is not worth a sentence.
    same = np.array_equal(done.mesh.vertices, made.mesh.vertices) and np.array_equal(
        done.mesh.faces, made.mesh.faces
    )
    return RepairedMesh(
        done.mesh,
        made.report if same else made.report + done.report,
        made.source_vertices[done.source_vertices],
    )


def _surface_of(source: SourceFile) -> RepairedMesh[TriangleMesh]:
    points, simplices = parse_file(source, None)
    n_rows = pcd.n_rows(source.data) if source.suffix == ".pcd" else 1
    if n_rows > 1:
        return triangulate_frame(points.reshape(n_rows, -1, 3))
    points, simplices, kept, report = require_finite(points, simplices, drop_missing=True)
    if len(simplices):
        if simplices.shape[1] == 4:
            solid = SimplicialMesh(points, simplices)
            surface = boundary_surface(solid)
            taken = (
                f"boundary_surface took the {surface.n_faces:,} triangles around "
                f"{solid.n_simplices:,} tetrahedra"
            )
            return RepairedMesh(surface, (*report, taken), kept[boundary_vertices(solid)])
        if simplices.shape[1] == 3 and points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
            report += ("a mesh in the plane was taken at z = 0",)
        require_surface(points, simplices)
        return RepairedMesh(TriangleMesh(points, simplices), report, kept)
    cloud = PointCloud(points)
    different = apply_repairs(cloud, suggest_repairs(cloud))
    made = reconstruct_surface(different.cloud)
    sources = kept[different.source_points[made.source_vertices]]
    return RepairedMesh(made.mesh, (*report, *different.report, *made.report), sources)
