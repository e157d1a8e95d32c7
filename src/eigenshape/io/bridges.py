"""Conversion from and to trimesh and PyVista."""

import warnings
from typing import Any

import numpy as np

from certeig.kit.errors import FileFormatError
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape._extras import import_extra
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.formats.cells import CellLists, select_cells, split_sentence
from eigenshape.io.formats.vtk_cells import SIMPLEX_TYPES, sort_cells

EXTRA = "'eigenshape[bridges]'"


def from_trimesh(mesh: Any, *, dim: Integer = 2) -> TriangleMesh | PointCloud:
    """Convert a mesh or a point cloud of trimesh. Vertices keep their order.

    Parameters
    ----------
    mesh : trimesh.Trimesh or trimesh.PointCloud
    dim : int
        Dimension of the manifold that a point cloud samples.

    Returns
    -------
    TriangleMesh or PointCloud

    Raises
    ------
    InvalidShapeError
        If the object is neither a Trimesh nor a PointCloud, or is not a valid mesh.
    MissingExtraError
        If trimesh is not installed.

    See Also
    --------
    to_trimesh : The inverse conversion.

    Examples
    --------
    >>> import eigenshape as es
    >>> import trimesh
    >>> es.io.from_trimesh(trimesh.creation.box())
    TriangleMesh(8 vertices, 12 faces)
    """
    trimesh = import_extra("trimesh", EXTRA)
    if isinstance(mesh, trimesh.PointCloud):
        return PointCloud(np.asarray(mesh.vertices), dim)
    if not isinstance(mesh, trimesh.Trimesh):
        raise InvalidShapeError(
            f"mesh must be a Trimesh or a PointCloud of trimesh; it is a {type(mesh).__name__}."
        )
    return TriangleMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def to_trimesh(shape: ShapeLike) -> Any:
    """Convert a shape to trimesh. Vertices keep their order, and none are merged.

    Parameters
    ----------
    shape : ShapeLike
        A triangle mesh, or a point cloud in R³.

    Returns
    -------
    trimesh.Trimesh or trimesh.PointCloud

    Raises
    ------
    InvalidShapeError
        If the shape is neither a triangle mesh nor a point cloud in R³.
    MissingExtraError
        If trimesh is not installed.

    See Also
    --------
    from_trimesh : The inverse conversion.

    Examples
    --------
    >>> import eigenshape as es
    >>> surface = es.io.to_trimesh(es.icosphere(2))
    >>> surface.vertices.shape, surface.is_watertight
    ((162, 3), True)
    """
    shape = as_shape(shape)
    trimesh = import_extra("trimesh", EXTRA)
    if isinstance(shape, PointCloud) and shape.points.shape[1] == 3:
        return trimesh.PointCloud(shape.points.copy())
    if not isinstance(shape, TriangleMesh):
        raise InvalidShapeError(
            f"trimesh holds triangle meshes and point clouds in R^3; the shape is {shape!r}."
        )
    return trimesh.Trimesh(shape.vertices.copy(), shape.faces.copy(), process=False)


def from_pyvista(dataset: Any, *, dim: Integer = 2) -> Shape:
    """Convert a PolyData or UnstructuredGrid of PyVista.

    The cells of the highest dimension are taken, or the points if there are none. Polylines become
    segments; polygons and strips become triangles, hexahedra, wedges and pyramids tetrahedra.

    Parameters
    ----------
    dataset : pyvista.PolyData or pyvista.UnstructuredGrid
    dim : int
        Dimension of the manifold that a point cloud samples.

    Returns
    -------
    TriangleMesh, SimplicialMesh or PointCloud

    Raises
    ------
    InvalidShapeError
        If the object is neither of these, has polyhedra, or a cell cannot be split.
    MissingExtraError
        If PyVista is not installed.

    Warns
    -----
    UserWarning
        If solids were split, or cells with curved sides were read by their corners.

    Examples
    --------
    >>> import eigenshape as es
    >>> import pyvista
    >>> es.io.from_pyvista(pyvista.Plane(i_resolution=2, j_resolution=1))
    TriangleMesh(6 vertices, 4 faces)
    """
    pyvista = import_extra("pyvista", EXTRA)
    if not isinstance(dataset, pyvista.PolyData | pyvista.UnstructuredGrid):
        raise InvalidShapeError(
            f"dataset must be a PolyData or an UnstructuredGrid; it is a {type(dataset).__name__}."
        )
    grid = dataset.cast_to_unstructured_grid()
    points = np.asarray(grid.points, dtype=np.float64)
    kinds = np.asarray(grid.celltypes, dtype=np.int64)
    starts = np.asarray(pyvista.convert_array(grid.GetCells().GetOffsetsArray()), dtype=np.int64)
    lists = CellLists(starts, np.asarray(grid.cell_connectivity, dtype=np.int64))
    try:
        found = sort_cells(points, lists, kinds)
    except FileFormatError as err:
        raise InvalidShapeError(str(err)) from err
    simplices = select_cells(found.points, found.cells, None)
    for note in filter(None, [*found.notes, split_sentence(found.cells)]):
        warnings.warn(note, stacklevel=2)
    if not len(simplices):
        return PointCloud(found.points, dim)
    return (TriangleMesh if simplices.shape[1] == 3 else SimplicialMesh)(found.points, simplices)


def to_pyvista(shape: ShapeLike) -> Any:
    """Convert a shape to PyVista.

    Points in R¹ and R² get zeros as their other coordinates.

    Parameters
    ----------
    shape : ShapeLike
        In R¹, R² or R³.

    Returns
    -------
    pyvista.PolyData or pyvista.UnstructuredGrid
        A PolyData for a surface or a point cloud, otherwise an UnstructuredGrid.

    Raises
    ------
    InvalidShapeError
        If the shape has more than three coordinates.
    MissingExtraError
        If PyVista is not installed.

    Examples
    --------
    >>> import eigenshape as es
    >>> surface = es.io.to_pyvista(es.icosphere(2))
    >>> surface.n_points, surface.n_cells
    (162, 320)
    """
    shape = as_shape(shape)
    pyvista = import_extra("pyvista", EXTRA)
    ambient = shape.points.shape[1]
    if ambient > 3:
        raise InvalidShapeError(
            f"PyVista holds shapes in up to three dimensions; this shape lies in R^{ambient}."
        )
    points = np.pad(shape.points, ((0, 0), (0, 3 - ambient)))
    if isinstance(shape, PointCloud):
        return pyvista.PolyData(points)
    if shape.dim == 2:
        return pyvista.PolyData.from_regular_faces(points, shape.simplices)
    return pyvista.UnstructuredGrid({SIMPLEX_TYPES[shape.dim + 1]: shape.simplices}, points)
