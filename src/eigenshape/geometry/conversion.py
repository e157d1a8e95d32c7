"""Conversion of arguments to shapes, and errors that name the call that converts the rest."""

import os
from collections.abc import Sequence
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
from typing_extensions import TypeAliasType

from certeig.kit.arguments import attribute_of, describe_value, require_choice
from certeig.kit.arrays import as_array
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows, index_rows
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.polygons import triangulate_polygons
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh

Cells = Literal["tetrahedra", "quads"]


@runtime_checkable
class HasFaces(Protocol):
    """An object with arrays of vertices and faces, such as a trimesh.Trimesh."""

    @property
    def vertices(self) -> Any:
        """(n, 3) float."""

    @property
    def faces(self) -> Any:
        """(f, 3) int."""


@runtime_checkable
class HasPolygons(Protocol):
    """An object with points and polygons, such as a pyvista.PolyData.

    Each polygon is stored as the number of its corners followed by their indices.
    """

    @property
    def points(self) -> Any:
        """(n, 3) float."""

    @property
    def faces(self) -> Any:
        """(4f,) int."""

    @property
    def is_all_triangles(self) -> Any:
        """Whether every polygon has three corners."""


Pair: TypeAlias = tuple[ArrayLike, ArrayLike]
MeshLike = TypeAliasType("MeshLike", TriangleMesh | SimplicialMesh | HasFaces | HasPolygons | Pair)
ShapeLike = TypeAliasType("ShapeLike", MeshLike | PointCloud)

# What to pass instead of an object of another library that is no triangle mesh.
BRIDGES = {
    "trimesh": "Pass scene.to_mesh() for a scene, or from_trimesh(cloud, dim=2) for points.",
    "pyvista": (
        "Pass dataset.extract_surface().triangulate() for its surface, or from_pyvista(dataset)."
    ),
}
ACCEPTED = (
    "Pass a TriangleMesh, a trimesh.Trimesh, a pyvista.PolyData of triangles, "
    "or a pair (vertices, faces)."
)


def as_mesh(value: object, name: str = "mesh") -> TriangleMesh:
    """Convert a mesh of another library, or a pair of arrays, to a TriangleMesh.

    Every function that takes a triangle mesh calls this, so it is rarely needed by itself.

    Parameters
    ----------
    value : MeshLike
        One of: a TriangleMesh, which is returned unchanged; a trimesh.Trimesh; a pyvista.PolyData
        of triangles; a pair (vertices, faces) of arrays; a SimplicialMesh of triangles in R³.
        Vertices and faces keep their order.
    name : str
        Name of the argument in error messages.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    InvalidParameterError
        If the value has another type. The message names the type and the call that converts it.
    InvalidShapeError
        If the arrays do not form a mesh, as in `TriangleMesh`.

    See Also
    --------
    from_arrays : Build a shape of any kind from arrays.
    read_mesh : Read a mesh from a file.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.as_mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    TriangleMesh(3 vertices, 1 faces)
    """
    shape = _convert(value)
    if isinstance(shape, TriangleMesh):
        return shape
    if isinstance(shape, SimplicialMesh) and (shape.dim, shape.points.shape[1]) == (2, 3):
        return TriangleMesh(shape.points, shape.simplices)
    raise _conversion_error(value, shape, f"{name} must be a triangle mesh", "read_mesh")


def as_simplicial(value: object, name: str = "mesh") -> Mesh:
    """Convert a value to a mesh of any dimension: a SimplicialMesh, or whatever `as_mesh` takes.

    Errors are those of `as_mesh`.
    """
    shape = _convert(value)
    if isinstance(shape, TriangleMesh | SimplicialMesh):
        return shape
    raise _conversion_error(value, shape, f"{name} must be a mesh", "read_shape")


def as_shape(value: object, name: str = "shape") -> Shape:
    """Convert a value to a shape: a mesh of any dimension, or a point cloud.

    Parameters
    ----------
    value : ShapeLike
        A SimplicialMesh or a PointCloud, which are returned unchanged, or whatever `as_mesh` takes.
    name : str
        Name of the argument in error messages.

    Returns
    -------
    TriangleMesh, SimplicialMesh or PointCloud

    Raises
    ------
    InvalidParameterError, InvalidShapeError
        As in `as_mesh`.

    See Also
    --------
    as_mesh : The same, for functions that need a triangle mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.as_shape(([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]]))
    SimplicialMesh(3 points in R^2, 1 simplices of dimension 2)
    """
    shape = _convert(value)
    if shape is not None:
        return shape
    raise _conversion_error(value, None, f"{name} must be a mesh or a point cloud", "read_shape")


def _convert(value: object) -> Shape | None:
    """Return the shape that a value describes, or None if it describes none."""
    if isinstance(value, TriangleMesh | SimplicialMesh | PointCloud):
        return value
    if isinstance(value, HasFaces):
        return from_arrays(np.asarray(value.vertices), np.asarray(value.faces))
    if isinstance(value, HasPolygons) and value.is_all_triangles and len(value.faces):
        return TriangleMesh(np.asarray(value.points), np.reshape(value.faces, (-1, 4))[:, 1:])
    if isinstance(value, Sequence) and not isinstance(value, str | bytes) and len(value) == 2:
        return from_arrays(value[0], value[1])
    return None


def _conversion_error(
    value: object, shape: Shape | None, needed: str, reader: str
) -> InvalidParameterError:
    """Return the error that names a value, the shape it was taken for, and what to pass instead."""
    given = describe_value(value)
    if shape is not None and shape is not value:
        given += f" that is a {shape!r}"
    module = type(value).__module__.partition(".")[0]
    part = attribute_of(value, TriangleMesh | SimplicialMesh | PointCloud)
    if isinstance(shape, PointCloud):
        remedy = (
            "A point cloud has no faces; "
            "point_cloud_laplacian(cloud), persistence_diagram(cloud, values) and "
            "calculus.heat_distances(cloud, sources) take it."
        )
    elif shape is not None and shape.dim == 3:
        remedy = "Pass boundary_surface(mesh), the triangles around the tetrahedra."
    elif shape is not None and shape.dim == 2 and shape.points.shape[1] == 2:
        remedy = "Pass TriangleMesh(numpy.pad(mesh.points, ((0, 0), (0, 1))), mesh.simplices)."
    elif shape is not None:
        remedy = "cotangent_laplacian(mesh) and edge_graph(mesh) take a mesh of any dimension."
    elif isinstance(value, str | os.PathLike):
        remedy = f"Pass {reader}({os.fspath(value)!r})."
    elif isinstance(value, np.ndarray):
        remedy = (
            "Pass PointCloud(points, dim=2) if these are points without faces; "
            "a mesh is a pair (vertices, faces)."
        )
    else:
        remedy = f"Pass its attribute {part}." if part else BRIDGES.get(module, ACCEPTED)
    return InvalidParameterError(f"{needed}; it is {given}. {remedy}")


def from_arrays(
    points: ArrayLike,
    simplices: ArrayLike | None = None,
    *,
    dim: Integer = 2,
    cells: Cells | None = None,
) -> Shape:
    """Build a shape from arrays of points and simplices.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit.
    simplices : (s, m+1) int, optional
        Corners of each simplex: 2 for segments, 3 for triangles, 4 for tetrahedra or quads. Without
        simplices the shape is a point cloud.
    dim : int
        Dimension of a point cloud; not used for meshes.
    cells : "tetrahedra" or "quads", optional
        Meaning of rows of four indices; required for such rows. A quad becomes two triangles that
        share the diagonal from its first corner, or the other one if that lies outside.

    Returns
    -------
    TriangleMesh, SimplicialMesh or PointCloud
        A TriangleMesh for triangles in R³.

    Raises
    ------
    InvalidParameterError
        If rows have four indices and `cells` is not given, or `cells` is given for other rows.
    InvalidShapeError
        If the arrays do not form a shape, as in the three classes, or a quad crosses itself.

    See Also
    --------
    as_mesh : Convert a mesh of another library.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> es.geometry.from_arrays(square, [[0, 1, 2, 3]], cells="quads")
    TriangleMesh(4 vertices, 2 faces)
    """
    if cells is not None:
        require_choice(cells, Cells, "cells")
    if simplices is None:
        return PointCloud(points, dim)
    corners = _width(simplices)
    if corners == 4 and cells is None:
        raise InvalidParameterError(
            "cells must be given for rows of four indices; simplices has such rows. "
            "Pass from_arrays(points, simplices, cells='tetrahedra') "
            "or from_arrays(points, simplices, cells='quads')."
        )
    if corners != 4 and cells is not None:
        raise InvalidParameterError(
            f"cells must be given only for rows of four indices; cells is {cells!r} "
            f"and rows of simplices have {corners}. Leave cells out."
        )
    if cells == "quads":
        places = finite_rows(points, "points")
        rows = index_rows(simplices, "simplices", 4, len(places))
        starts = np.arange(0, rows.size + 1, 4)
        simplices, _ = triangulate_polygons(places, starts, rows.ravel())
    if (_width(points), _width(simplices)) == (3, 3):
        return TriangleMesh(points, simplices)
    return SimplicialMesh(points, simplices)


def _width(rows: ArrayLike) -> int | None:
    """Return the number of columns, or None if the value is not two-dimensional.

    The class of the shape raises the error for such a value.
    """
    try:
        array = as_array(rows, "simplices")
    except ValueError:
        return None
    return int(array.shape[1]) if array.ndim == 2 else None
