"""Lengths, areas, volumes and normals, accurate at any scale of the coordinates."""

import numpy as np
from jaxtyping import Float

from eigenshape._corners import in_length, mean_normals, scaled_corners
from eigenshape._vectors import area_vectors, row_dots, size_one, triangle_areas, unit_vectors
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.topology import edge_table


def face_areas(mesh: MeshLike) -> Float[np.ndarray, " f"]:
    """Compute the area of each face.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    (f,) float
        Areas, in length²; 0 for a degenerate face.

    See Also
    --------
    surface_area : The sum of the areas.
    dual_volumes : The area at each vertex.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.face_areas(es.shapes.grid(1, 1)).tolist()
    [0.5, 0.5]
    """
    mesh = as_mesh(mesh)
    corners, scale = scaled_corners(mesh)
    return in_length(triangle_areas(corners), scale, 2)


def surface_area(mesh: MeshLike) -> float:
    """Compute the total area of a surface.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    float
        Area, in length².

    See Also
    --------
    face_areas : The area of each face.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.surface_area(es.shapes.grid(4, 4, width=2, height=3))
    6.0
    """
    return float(face_areas(mesh).sum())


def enclosed_volume(mesh: MeshLike) -> float:
    """Compute the signed volume that a surface encloses.

    Parameters
    ----------
    mesh : MeshLike
        Closed, in any length unit. For an open mesh the result is the volume between the surface
        and the mean of its corners.

    Returns
    -------
    float
        Volume, in length³; positive if the faces of a closed mesh face outward.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.

    Examples
    --------
    >>> import eigenshape as es
    >>> cube = es.geometry.boundary_surface(es.shapes.box(2, 2, 2, sides=(1, 2, 3)))
    >>> round(es.geometry.enclosed_volume(cube), 6)
    6.0
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    corners, scale = scaled_corners(mesh)
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return float(in_length(row_dots(a, np.cross(b, c)) / 6, scale, 3).sum())


def face_normals(mesh: MeshLike) -> Float[np.ndarray, "f 3"]:
    """Compute the unit normal of each face.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    (f, 3) float
        Normals, pointing to the side from which the corners are seen counter-clockwise; zero for a
        face without area.

    See Also
    --------
    vertex_normals : Normals at the vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.face_normals(es.shapes.grid(1, 1)).tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    """
    mesh = as_mesh(mesh)
    return unit_vectors(area_vectors(scaled_corners(mesh)[0]))


def vertex_normals(mesh: MeshLike) -> Float[np.ndarray, "n 3"]:
    """Compute the unit normal at each vertex: the mean of its faces' normals, weighted by area.

    Parameters
    ----------
    mesh : MeshLike
        Consistently oriented.

    Returns
    -------
    (n, 3) float
        Normals; zero at a vertex without faces, or where the normals cancel.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.

    See Also
    --------
    face_normals : Normals of the faces.

    Examples
    --------
    At each vertex of a sphere around the origin, the normal points away from the origin.

    >>> import eigenshape as es
    >>> sphere = es.icosphere(2)
    >>> cosines = (es.geometry.vertex_normals(sphere) * sphere.vertices).sum(axis=1)
    >>> bool(cosines.min() > 0.999)
    True
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    return mean_normals(mesh)


def edge_lengths(mesh: MeshLike) -> Float[np.ndarray, " e"]:
    """Compute the length of each edge.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.

    Returns
    -------
    (e,) float
        Lengths, in the order of the edges of `edge_table`.

    See Also
    --------
    edge_table : The edges.
    mean_side_length : The mean over the sides of all faces.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.edge_lengths(es.shapes.grid(1, 1)).round(4).tolist()
    [1.0, 1.0, 1.4142, 1.0, 1.0]
    """
    mesh = as_mesh(mesh)
    ends, scale = size_one(mesh.vertices[edge_table(mesh).edges])
    return in_length(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), scale, 1)
