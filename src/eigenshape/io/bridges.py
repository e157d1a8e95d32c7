"""Bridges to plain arrays, trimesh and PyVista."""

from importlib import import_module
from types import ModuleType
from typing import Any, SupportsIndex

import numpy as np

from eigenshape._errors import InvalidShapeError, MissingExtraError
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh

VTK_CELLS = {1: 3, 2: 5, 3: 10}  # VTK's numbers for segment, triangle and tetrahedron
POINTS, LINES = (1, 2), (3, 4)  # those of a point and of several, of a segment and of a polyline


def to_arrays(shape: ShapeLike) -> tuple[np.ndarray, np.ndarray | None]:
    """Return copies of points (n, d) and simplices (s, m+1) that may be written to; None for a cloud's simplices."""
    shape = as_shape(shape)
    return shape.points.copy(), None if isinstance(shape, PointCloud) else shape.simplices.copy()


def from_trimesh(mesh: Any, *, dim: SupportsIndex = 2) -> TriangleMesh | PointCloud:
    """Take over a trimesh.Trimesh, or a trimesh.PointCloud of dimension `dim`, vertex by vertex.

    Raises
    ------
    InvalidShapeError
        If it is neither, or not a valid mesh.
    MissingExtraError
        If trimesh is not installed.
    """
    trimesh = _extra("trimesh")
    if isinstance(mesh, trimesh.PointCloud):
        return PointCloud(np.asarray(mesh.vertices), dim)
    if not isinstance(mesh, trimesh.Trimesh):
        raise InvalidShapeError(
            f"A Trimesh or PointCloud of trimesh is taken; this is a {type(mesh).__name__}."
        )
    return TriangleMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def to_trimesh(shape: ShapeLike) -> Any:
    """Return a trimesh.Trimesh or trimesh.PointCloud with the same points in the same order; nothing is merged.

    Raises
    ------
    InvalidShapeError
        If the shape is neither a triangle mesh nor a cloud in R³.
    MissingExtraError
        If trimesh is not installed.
    """
    shape = as_shape(shape)
    trimesh = _extra("trimesh")
    if isinstance(shape, PointCloud) and shape.points.shape[1] == 3:
        return trimesh.PointCloud(shape.points.copy())
    if not isinstance(shape, TriangleMesh):
        raise InvalidShapeError(
            f"Only triangle meshes and clouds in R^3 fit into trimesh; this is {shape!r}."
        )
    return trimesh.Trimesh(shape.vertices.copy(), shape.faces.copy(), process=False)


def from_pyvista(dataset: Any, *, dim: SupportsIndex = 2) -> Shape:
    """Take over a PyVista PolyData or UnstructuredGrid: its simplices of the highest dimension, or its points.

    Polylines become segments.

    Raises
    ------
    InvalidShapeError
        If it is neither, or has cells that are no simplices.
    MissingExtraError
        If PyVista is not installed.
    """
    pyvista = _extra("pyvista")
    if not isinstance(dataset, pyvista.PolyData | pyvista.UnstructuredGrid):
        raise InvalidShapeError(
            f"A PolyData or UnstructuredGrid is taken; this is a {type(dataset).__name__}."
        )
    grid = dataset.cast_to_unstructured_grid()
    points = np.asarray(grid.points, dtype=np.float64)
    kinds = np.asarray(grid.celltypes)
    starts = np.asarray(pyvista.convert_array(grid.GetCells().GetOffsetsArray()), dtype=np.int64)
    corners = np.asarray(grid.cell_connectivity, dtype=np.int64)
    _require_simplices(kinds)
    for dim_of_cells in (3, 2):
        at = starts[:-1][kinds == VTK_CELLS[dim_of_cells]]
        if at.size:
            cells = corners[at[:, None] + np.arange(dim_of_cells + 1)]
            return (
                TriangleMesh(points, cells) if dim_of_cells == 2 else SimplicialMesh(points, cells)
            )
    segments = _segments(kinds, np.diff(starts), corners)
    return SimplicialMesh(points, segments) if segments.size else PointCloud(points, dim)


def _segments(kinds: np.ndarray, sizes: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the pairs of points that follow each other in segments and polylines."""
    cell = np.repeat(np.arange(len(sizes)), sizes)
    chained = (cell[1:] == cell[:-1]) & np.isin(kinds, LINES)[cell[1:]]
    return np.column_stack([corners[:-1][chained], corners[1:][chained]])


def _require_simplices(kinds: np.ndarray) -> None:
    others = np.setdiff1d(kinds, [*POINTS, *LINES, *VTK_CELLS.values()])
    if others.size:
        count = np.count_nonzero(kinds == others[0])
        raise InvalidShapeError(
            f"Cells must be simplices; {count} are of VTK's type {others[0]}. Triangulate them first."
        )


def to_pyvista(shape: ShapeLike) -> Any:
    """Return a PolyData of a surface or a cloud, or an UnstructuredGrid of segments or tetrahedra, in R³.

    Points of R¹ and R² get zeros for what they lack.

    Raises
    ------
    InvalidShapeError
        If the shape lies beyond R³.
    MissingExtraError
        If PyVista is not installed.
    """
    shape = as_shape(shape)
    pyvista = _extra("pyvista")
    ambient = shape.points.shape[1]
    if ambient > 3:
        raise InvalidShapeError(
            f"Only shapes in R^3 fit into PyVista; this one lies in R^{ambient}."
        )
    points = np.pad(shape.points, ((0, 0), (0, 3 - ambient)))
    if isinstance(shape, PointCloud):
        return pyvista.PolyData(points)
    if shape.dim == 2:
        return pyvista.PolyData.from_regular_faces(points, shape.simplices)
    return pyvista.UnstructuredGrid({VTK_CELLS[shape.dim]: shape.simplices}, points)


def _extra(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as err:
        raise MissingExtraError(
            f"{name} must be installed; it is not. pip install 'eigenshape[bridges]' does it."
        ) from err
