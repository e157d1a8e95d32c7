"""Operators by name, with what each takes."""

import inspect
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import scipy.sparse as sp

from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.clouds.cloud_kernel import checked_laplacian, point_cloud_laplacian
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.clouds.kernel import KernelOptions, UnevenSpacingError
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_laplacian
from eigenshape.operators.graph import graph_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.robust import robust_laplacian

MESHES = (TriangleMesh, SimplicialMesh)
GRAPHS = (*MESHES, sp.sparray)


@dataclass(frozen=True)
class Operator(Shown):
    """An operator that can be built by name.

    Attributes
    ----------
    build : callable
        Maps a shape and options to a `Laplacian`.
    shapes : tuple of types
        Types of shapes on which the operator is defined.
    description : str
        One line that says what the operator is.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.operators.OPERATORS["cotangent"].description
    'linear finite elements'
    >>> es.operators.OPERATORS["cotangent"].options
    ('mass', 'conductivity')
    """

    build: Callable[..., Laplacian]
    shapes: tuple[type, ...]
    description: str

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options, which are the arguments of `build` after the shape."""
        given = self.build.keywords if isinstance(self.build, partial) else {}
        _, *names = inspect.signature(self.build).parameters
        return tuple(name for name in names if name not in given)


# The operator of each name. Whatever lists operators reads this table.
OPERATORS: dict[str, Operator] = {
    "cotangent": Operator(cotangent_laplacian, MESHES, "linear finite elements"),
    "p2": Operator(
        partial(fem_laplacian, order=2), MESHES, "quadratic finite elements, nodes on edges too"
    ),
    "p3": Operator(
        partial(fem_laplacian, order=3),
        MESHES,
        "cubic finite elements, nodes inside triangles too",
    ),
    "robust": Operator(
        robust_laplacian, (TriangleMesh, PointCloud), "linear elements on intrinsic triangles"
    ),
    "mesh": Operator(mesh_laplacian, MESHES, "Gaussian kernel, weighted by volumes"),
    "point-cloud": Operator(
        point_cloud_laplacian, (PointCloud,), "Gaussian kernel, weights from tangent planes"
    ),
    "combinatorial": Operator(
        partial(graph_laplacian, kind="combinatorial"), GRAPHS, "edges of weight 1"
    ),
    "weighted": Operator(
        partial(graph_laplacian, kind="weighted"),
        GRAPHS,
        "weights of the graph, or 1/length on a mesh",
    ),
    "normalized": Operator(
        partial(graph_laplacian, kind="normalized"), GRAPHS, "eigenvalues in 0..2"
    ),
}


def build_laplacian(
    shape: ShapeLike | sp.sparray, operator: str | None = None, **options: Any
) -> Laplacian:
    """Build a Laplace operator by its name.

    Parameters
    ----------
    shape : ShapeLike or (n, n) sparse
        A mesh, a point cloud, or the adjacency matrix of a graph.
    operator : str, optional
        A name in `es.operators.OPERATORS`. The default is "cotangent" for meshes, "point-cloud" for
        points and "weighted" for graphs. Surface points in R³ that are too uneven for the kernel of
        "point-cloud" get "robust", with a warning, if no option is given.
    **options
        Options of the operator, such as `mass` or `t`.

    Returns
    -------
    Laplacian

    Raises
    ------
    InvalidParameterError
        If there is no operator of this name, it is not defined on such a shape, or it does not have
        one of the options.
    InvalidShapeError
        If the operator cannot be built on this shape.

    Warns
    -----
    UserWarning
        If points get the robust operator by default.

    See Also
    --------
    cotangent_laplacian, robust_laplacian, mesh_laplacian, point_cloud_laplacian : The operators.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> es.build_laplacian(ball).n_points
    162
    >>> es.build_laplacian(ball, "p2").n_points  # nodes on the edges too
    642
    >>> es.build_laplacian(ball, "cotangent", mass="averaged").mass.nnz
    1122
    """
    if not isinstance(shape, sp.sparray):
        shape = as_shape(shape)
    default = "point-cloud" if isinstance(shape, PointCloud) else "weighted"
    name = operator or ("cotangent" if isinstance(shape, MESHES) else default)
    if name not in OPERATORS:
        raise InvalidParameterError(
            f"operator must be one of {', '.join(OPERATORS)}; it is {name!r}."
        )
    entry = OPERATORS[name]
    if not isinstance(shape, entry.shapes):
        fitting = [other for other, its in OPERATORS.items() if isinstance(shape, its.shapes)]
        hint = f"It is for {', '.join(fitting)}." if fitting else "No operator is for that."
        raise InvalidParameterError(
            f"The {name} operator takes {' or '.join(kind.__name__ for kind in entry.shapes)}; the shape is a "
            f"{type(shape).__name__}. {hint}"
        )
    unknown = [option for option in options if option not in entry.options]
    if unknown:
        raise InvalidParameterError(
            f"The {name} operator takes {', '.join(entry.options) or 'no options'}; the option {unknown[0]} was given."
        )
    if operator is not None or options or not isinstance(shape, PointCloud):
        return entry.build(shape, **options)
    # The kernel operator, or the robust one if points are too uneven for one width.
    found: Laplacian | UnevenSpacingError
    try:
        found, fault = checked_laplacian(shape, KernelOptions(correct="log", form="random-walk"))
        if not fault:
            return found
    except UnevenSpacingError as error:
        found, fault = error, ""
    # A width that reaches the farthest point would blur all others: no width is right.
    if shape.dim == 2 and shape.points.shape[1] == 3:
        with suppress(InvalidShapeError):
            robust = robust_laplacian(shape)
            warnings.warn(
                "The points are too uneven for a kernel of one width, so robust_laplacian joins "
                "each point with its nearest ones. Pass a heat time t to use the kernel.",
                stacklevel=2,
            )
            return robust
    if isinstance(found, UnevenSpacingError):
        raise found
    warnings.warn(fault, stacklevel=2)
    return found
