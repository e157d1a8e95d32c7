"""A triangle mesh is a value: checked once, then read-only."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import finite_rows, frozen, index_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._typing import ArrayLike


@dataclass(frozen=True, eq=False, init=False)
class TriangleMesh:
    """Points in space and the triangles between them.

    What is checked here is structure: finite coordinates, also of vertices that no face uses, and faces that
    index them. Whether the geometry serves (no zero-area face, no loose vertex) is asked by whoever needs it,
    so that a repair can start from a mesh that is valid and not yet good.

    Parameters
    ----------
    vertices : (n, 3) float
        Coordinates, in any length unit. Copied, then read-only.
    faces : (f, 3) int
        Corners of each triangle, counter-clockwise seen from outside. Copied, then read-only.

    Raises
    ------
    InvalidShapeError
        If an array has the wrong shape or is empty, a coordinate is not finite, or a face does not index
        `vertices`; the message names the first row at fault.
    """

    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "f 3"]

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points = finite_rows(vertices, "vertices", 3)
        if not len(points):
            raise InvalidShapeError("A mesh must have vertices; it has none.")
        corners = index_rows(faces, "faces", 3, len(points))
        if not len(corners):
            raise InvalidShapeError(
                f"A mesh must have faces; it has {len(points)} vertices and no face."
            )
        object.__setattr__(self, "vertices", frozen(points))
        object.__setattr__(self, "faces", frozen(corners))

    @property
    def n_vertices(self) -> int:
        """Number of vertices, n."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of triangles, f."""
        return len(self.faces)

    @property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """The vertices, by the name that they have in meshes of any dimension."""
        return self.vertices

    @property
    def simplices(self) -> Int[np.ndarray, "f 3"]:
        """The faces, by the name that they have in meshes of any dimension."""
        return self.faces

    @property
    def n_points(self) -> int:
        """Number of vertices, n."""
        return len(self.vertices)

    @property
    def dim(self) -> int:
        """Dimension of a surface, 2."""
        return 2

    def __repr__(self) -> str:
        return f"TriangleMesh({self.n_vertices} vertices, {self.n_faces} faces)"
