"""Simplicial meshes of any dimension: arrays that are checked once and then read-only."""

from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from typing_extensions import TypeAliasType

from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows, index_rows
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.facet_lists import FacetTable, list_facets, state_without_facets
from eigenshape.geometry.mesh import TriangleMesh


@record
class SimplicialMesh(ReadOnly):
    """A mesh of m-simplices in R^d: segments, triangles, tetrahedra and so on.

    The constructor checks the structure, as that of `TriangleMesh` does. It accepts simplices
    without volume.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit, d ≥ 1. They are copied, and the copy is read-only.
    simplices : (s, m+1) int
        Corners of each simplex, 1 ≤ m ≤ d. They are copied, and the copy is read-only.

    Raises
    ------
    InvalidShapeError
        If an array has the wrong shape or is empty, m is not in 1..d, a coordinate is not finite,
        or a simplex does not index `points`. The message names the first row at fault.

    See Also
    --------
    TriangleMesh : Triangle meshes in R³.
    read_shape : Read a mesh of any dimension from a file.

    Examples
    --------
    A square in the plane, of two triangles.

    >>> import eigenshape as es
    >>> es.SimplicialMesh([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])
    SimplicialMesh(4 points in R^2, 2 simplices of dimension 2)
    """

    points: Float[np.ndarray, "n d"]
    simplices: Int[np.ndarray, "s corners"]

    def __init__(self, points: ArrayLike, simplices: ArrayLike) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A mesh must have points; it has none.")
        corners = index_rows(simplices, "simplices", None, len(coordinates))
        if not corners.size:
            raise InvalidShapeError(
                f"A mesh must have simplices; it has {len(coordinates)} points and no simplex. "
                "Use PointCloud for points without simplices."
            )
        dim, ambient = corners.shape[1] - 1, coordinates.shape[1]
        if not 1 <= dim <= ambient:
            raise InvalidShapeError(
                f"Simplices in R^{ambient} must have dimension 1..{ambient}; "
                f"these have {dim + 1} corners, which is dimension {dim}."
            )
        vars(self).update(points=freeze(coordinates), simplices=freeze(corners))

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)

    @property
    def n_simplices(self) -> int:
        """Number of simplices, s."""
        return len(self.simplices)

    @property
    def dim(self) -> int:
        """Dimension m of the simplices."""
        return int(self.simplices.shape[1]) - 1

    @cached_property
    def facets(self) -> FacetTable:
        """The facets of the simplices, as `facet_table` returns them: listed once for each mesh."""
        return list_facets(self.simplices, len(self.points))

    __getstate__ = state_without_facets

    def __repr__(self) -> str:
        where = f"{self.n_points} points in R^{self.points.shape[1]}"
        return f"SimplicialMesh({where}, {self.n_simplices} simplices of dimension {self.dim})"


Mesh = TypeAliasType("Mesh", TriangleMesh | SimplicialMesh)
