"""Scaling of meshes to size 1."""

from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import cdist

from certeig.kit.arguments import require_choice
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import triangle_areas
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices

Measure = Literal["box", "area", "diameter"]


def normalize_mesh(mesh: MeshLike, measure: Measure) -> TriangleMesh:
    """Scale a mesh to size 1, with the mean of its vertices at the origin.

    Parameters
    ----------
    mesh : MeshLike
    measure : {"box", "area", "diameter"}
        What becomes 1: the longest side of the axis-aligned bounding box (thesis 5.4), the surface
        area, or the largest distance between two vertices.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    InvalidParameterError
        If the measure is not one of the three.
    InvalidShapeError
        If all vertices are equal, or no face has area.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> sheet = es.shapes.grid(2, 2, width=3, height=4)
    >>> np.ptp(es.geometry.normalize_mesh(sheet, "box").vertices, axis=0).tolist()
    [0.75, 1.0, 0.0]
    >>> round(es.geometry.surface_area(es.geometry.normalize_mesh(sheet, "area")), 6)
    1.0
    >>> es.geometry.normalize_mesh(sheet, "diameter").vertices.max(axis=0).round(6).tolist()
    [0.3, 0.4, 0.0]
    """
    mesh = as_mesh(mesh)
    require_choice(measure, Measure, "measure")
    points, _ = scale_to_unit(mesh)
    if measure == "box":
        size = float(np.ptp(points, axis=0).max())
    elif measure == "area":
        sound = np.delete(mesh.faces, degenerate_simplices(mesh), axis=0)
        size = float(triangle_areas(points[sound]).sum()) ** 0.5
    else:
        # The ends of a diameter are corners of the convex hull: of the space, of a plane, or of a line.
        axes = np.linalg.svd(points, full_matrices=False)[2]
        along = points @ axes[0]
        corners = points[[np.argmin(along), np.argmax(along)]]
        for dimension in (3, 2):
            try:
                corners = points[ConvexHull(points @ axes[:dimension].T).vertices]
                break
            except QhullError:  # flat or straight: no hull with volume, or with area
                continue
        # All points of a sphere lie on its hull, so distances are computed for a thousand at a time.
        blocks = np.split(corners, range(1000, len(corners), 1000))
        size = max(float(cdist(rows, corners).max()) for rows in blocks)
    if not size > 0:
        raise InvalidShapeError(
            "A mesh must have a size above zero to be normalized; "
            f"its {mesh.n_vertices} vertices give size {size}."
        )
    return TriangleMesh(points / size, mesh.faces)
