"""Triangle meshes: arrays that are checked once and then read-only."""

import base64
import sys
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows, index_rows
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.facet_lists import FacetTable, list_facets, state_without_facets

MOST_DRAWN = 200_000  # faces of a mesh that a notebook shows as a picture


@record
class TriangleMesh(ReadOnly):
    """A triangle mesh in R³.

    The constructor checks the structure: coordinates are finite, also those of vertices without a
    face, and faces index vertices. It accepts degenerate faces and vertices without a face, so that
    `repair` can be applied to such a mesh; functions that cannot work with them raise an error.

    Parameters
    ----------
    vertices : (n, 3) float
        Coordinates, in any length unit. They are copied, and the copy is read-only.
    faces : (f, 3) int
        Corners of each triangle, counter-clockwise if seen from outside. They are copied, and the
        copy is read-only.

    Raises
    ------
    InvalidShapeError
        If an array has the wrong shape or is empty, a coordinate is not finite, or a face does not
        index `vertices`. The message names the first row at fault.

    See Also
    --------
    as_mesh : Convert a mesh of another library.
    read_mesh : Read a mesh from a file.
    SimplicialMesh : Meshes of other dimensions.

    Examples
    --------
    >>> import eigenshape as es
    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = es.TriangleMesh(vertices, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> mesh
    TriangleMesh(4 vertices, 4 faces)
    >>> mesh.vertices[3]
    array([0., 0., 1.])
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
                f"A mesh must have faces; it has {len(points)} vertices and no face. "
                "Use PointCloud for points without faces."
            )
        vars(self).update(vertices=freeze(points), faces=freeze(corners))

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
        """The vertices, under the name used for meshes of any dimension."""
        return self.vertices

    @property
    def simplices(self) -> Int[np.ndarray, "f 3"]:
        """The faces, under the name used for meshes of any dimension."""
        return self.faces

    @property
    def n_points(self) -> int:
        """Number of vertices, n."""
        return len(self.vertices)

    @property
    def dim(self) -> int:
        """Dimension of a surface, 2."""
        return 2

    @cached_property
    def facets(self) -> FacetTable:
        """The facets of the simplices, as `facet_table` returns them: listed once for each mesh."""
        return list_facets(self.faces, len(self.points))

    __getstate__ = state_without_facets

    def __repr__(self) -> str:
        return f"TriangleMesh({self.n_vertices} vertices, {self.n_faces} faces)"

    def _portrait(self) -> str:
        """Return the counts, and a small picture, as HTML."""
        counts = f"<p>{self.n_vertices:,} vertices, {self.n_faces:,} faces</p>"
        if self.n_faces > MOST_DRAWN:
            return counts
        # Pictures are drawn in a room above this one. The short door, which is always loaded, knows it.
        draw_thumbnail = sys.modules["eigenshape"].retrieval.draw_thumbnail
        picture = base64.b64encode(draw_thumbnail(self)).decode()
        return f'<img alt="The mesh" src="data:image/png;base64,{picture}">{counts}'
