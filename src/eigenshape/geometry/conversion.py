"""What a caller may hand over as a shape, and what is said of everything else."""

import os
from collections.abc import Sequence
from typing import Any, Literal, Protocol, SupportsIndex, TypeAlias, runtime_checkable

import numpy as np
from typing_extensions import TypeAliasType

from eigenshape._arguments import attribute_of, describe_value
from eigenshape._arrays import as_array
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh

Cells = Literal["tetrahedra", "quads"]


@runtime_checkable
class HasFaces(Protocol):
    """What has arrays of vertices and faces, as a trimesh.Trimesh has."""

    @property
    def vertices(self) -> Any:
        """(n, 3) float."""

    @property
    def faces(self) -> Any:
        """(f, 3) int."""


@runtime_checkable
class HasPolygons(Protocol):
    """What has arrays of points and of polygons, each after the number of its corners, as a pyvista.PolyData has."""

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

BRIDGES = {
    "trimesh": "Pass scene.to_mesh() of a scene, from_trimesh(cloud, dim=2) of points.",
    "pyvista": "Pass dataset.extract_surface().triangulate() for its surface, or from_pyvista(dataset).",
}
TAKEN = "Pass a TriangleMesh, a trimesh.Trimesh, a pyvista.PolyData of triangles, or a pair (vertices, faces)."


def as_mesh(value: object, name: str = "mesh") -> TriangleMesh:
    """Return as a TriangleMesh what is one in all but type; every function that takes a mesh begins with this.

    Parameters
    ----------
    value : MeshLike
        A TriangleMesh, which is returned as it is; a trimesh.Trimesh; a pyvista.PolyData of triangles; a pair
        (vertices, faces) of arrays; or a SimplicialMesh of triangles in R³. Vertices and faces keep their order.
    name : str
        What to call it in a message.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    InvalidParameterError
        If it is anything else; the message names its type and the call that converts it.
    InvalidShapeError
        As TriangleMesh, if its arrays are not those of a mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.as_mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    TriangleMesh(3 vertices, 1 faces)
    """
    if isinstance(value, TriangleMesh):
        return value
    shape = _converted(value)
    if isinstance(shape, TriangleMesh):
        return shape
    if isinstance(shape, SimplicialMesh) and (shape.dim, shape.points.shape[1]) == (2, 3):
        return TriangleMesh(shape.points, shape.simplices)
    raise _refused(value, shape, f"{name} must be a triangle mesh", "read_mesh")


def as_simplicial(value: object, name: str = "mesh") -> Mesh:
    """Return as a mesh of any dimension what is one in all but type: a SimplicialMesh, or what `as_mesh` takes.

    Raises
    ------
    InvalidParameterError, InvalidShapeError
        As `as_mesh`.
    """
    if isinstance(value, TriangleMesh | SimplicialMesh):
        return value
    shape = _converted(value)
    if isinstance(shape, TriangleMesh | SimplicialMesh):
        return shape
    raise _refused(value, shape, f"{name} must be a mesh", "read_shape")


def as_shape(value: object, name: str = "shape") -> Shape:
    """Return as a shape what is one in all but type: a mesh of any dimension, a PointCloud, or what `as_mesh` takes.

    Raises
    ------
    InvalidParameterError, InvalidShapeError
        As `as_mesh`.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.as_shape(([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]]))
    SimplicialMesh(3 points in R^2, 1 simplices of dimension 2)
    """
    if isinstance(value, TriangleMesh | SimplicialMesh | PointCloud):
        return value
    shape = _converted(value)
    if shape is not None:
        return shape
    raise _refused(value, None, f"{name} must be a mesh or a cloud of points", "read_shape")


def _converted(value: object) -> Shape | None:
    """Return a value as the shape that it is in all but type, None where it is none."""
    if isinstance(value, TriangleMesh | SimplicialMesh | PointCloud):
        return value
    if isinstance(value, HasFaces):
        return from_arrays(np.asarray(value.vertices), np.asarray(value.faces))
    if isinstance(value, HasPolygons) and value.is_all_triangles and len(value.faces):
        return TriangleMesh(np.asarray(value.points), np.reshape(value.faces, (-1, 4))[:, 1:])
    if isinstance(value, Sequence) and not isinstance(value, str | bytes) and len(value) == 2:
        return from_arrays(value[0], value[1])
    return None


def _refused(value: object, shape: Shape | None, needed: str, reader: str) -> InvalidParameterError:
    """Return the error that names a value, the shape it was taken for, and what to pass instead."""
    given = (
        describe_value(value)
        if shape is None or shape is value
        else f"{describe_value(value)} that is a {shape!r}"
    )
    remedy = _remedy(value, reader) if shape is None else _use_of(shape)
    return InvalidParameterError(f"{needed}; it is {given}. {remedy}")


def _use_of(shape: Shape) -> str:
    """Say how a shape becomes the mesh that is needed, or what it serves."""
    if isinstance(shape, PointCloud):
        return "A cloud has no faces; point_cloud_laplacian(cloud) and persistence_diagram(cloud, values) take it."
    if shape.dim == 3:
        return "Pass boundary_surface(mesh), the triangles around the tetrahedra."
    if shape.dim == 2 and shape.points.shape[1] == 2:
        return "Pass TriangleMesh(numpy.pad(mesh.points, ((0, 0), (0, 1))), mesh.simplices)."
    return "cotangent_laplacian(mesh) and edge_graph(mesh) take a mesh of any dimension."


def _remedy(value: object, reader: str) -> str:
    """Say what makes a shape of a value that is none."""
    module = type(value).__module__.partition(".")[0]
    part = attribute_of(value, TriangleMesh | SimplicialMesh | PointCloud)
    if isinstance(value, str | os.PathLike):
        return f"Pass {reader}({os.fspath(value)!r})."
    if isinstance(value, np.ndarray):
        return "Pass PointCloud(points, dim=2) if it is points without faces; a mesh is a pair (vertices, faces)."
    return f"Pass its attribute {part}." if part else BRIDGES.get(module, TAKEN)


def from_arrays(
    points: ArrayLike,
    simplices: ArrayLike | None = None,
    *,
    dim: SupportsIndex = 2,
    cells: Cells | None = None,
) -> Shape:
    """Return the shape that arrays describe: a TriangleMesh where they can be one.

    Parameters
    ----------
    points : (n, d) float
    simplices : (s, m+1) int, optional
        Without them the points are a cloud of dimension `dim`.
    dim : int
    cells : "tetrahedra" or "quads", optional
        What rows of four indices are, which nothing else can tell. Quads become two triangles each, by the diagonal
        from their first corner.

    Raises
    ------
    InvalidParameterError
        If rows have four indices and `cells` does not say what they are, or `cells` is given with other rows.
    InvalidShapeError, InvalidParameterError
        As the three classes.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> es.from_arrays(square, [[0, 1, 2, 3]], cells="quads")
    TriangleMesh(4 vertices, 2 faces)
    """
    if cells not in (None, "tetrahedra", "quads"):
        raise InvalidParameterError(f"cells must be 'tetrahedra' or 'quads'; it is {cells!r}.")
    if simplices is None:
        return PointCloud(points, dim)
    corners = _width(simplices)
    if corners == 4 and cells is None:
        raise InvalidParameterError(
            "Rows of four indices are tetrahedra or quads, and it must be said which; simplices has such rows. Pass "
            "from_arrays(points, simplices, cells='tetrahedra') or from_arrays(points, simplices, cells='quads')."
        )
    if corners != 4 and cells is not None:
        raise InvalidParameterError(
            f"cells is for rows of four indices; cells is {cells!r} and rows of simplices have {corners}. Leave it out."
        )
    if cells == "quads":
        simplices = np.asarray(simplices)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    if (_width(points), _width(simplices)) == (3, 3):
        return TriangleMesh(points, simplices)
    return SimplicialMesh(points, simplices)


def _width(rows: ArrayLike) -> int | None:
    """Return the number of columns; None of what is no table, which the class of the shape refuses."""
    try:
        array = as_array(rows, "simplices")
    except ValueError:
        return None
    return int(array.shape[1]) if array.ndim == 2 else None
