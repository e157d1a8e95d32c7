"""Lengths, areas, volumes, normals and turns, accurate at any scale of the coordinates."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.simplices import at_points, in_length, scaled_corners, size_one
from eigenshape.geometry.topology import edge_table

# How much the rotation of points follows a given one, as a share of their moments: a rotation about
# the own axis of a limb as round as a finger, or of an eye, is hardly shown by its points.
FOLLOW = 0.02
ONE_PLACE = 1e-14  # mean square distance, in sizes², that is lost in rounding


def scale_to_unit(mesh: TriangleMesh) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Return the vertices relative to their mean, scaled to size 1, and the scale.

    The scale is a power of two, so dividing by it is exact. Squares and cubes of the scaled
    coordinates neither overflow nor underflow, whatever the unit of the mesh.
    """
    points, scale = size_one(mesh.vertices)
    points, inner_scale = size_one(points - points.mean(axis=0))
    return points, scale * inner_scale


def area_vectors(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, "f 3"]:
    """Return the unit normal of each triangle times its area."""
    a, b, c = corners.transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def triangle_areas(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, " f"]:
    """Return the area of each triangle, in the unit of its corners."""
    return np.linalg.norm(area_vectors(corners), axis=1)


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
    mesh = as_mesh(mesh)
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
    return float(in_length(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, scale, 3).sum())


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


def mean_normals(mesh: TriangleMesh) -> Float[np.ndarray, "n 3"]:
    """Return `vertex_normals` of any mesh; normals of neighbors that disagree cancel in part."""
    vectors = area_vectors(scaled_corners(mesh)[0])
    sums = [at_points(mesh, vectors[:, axis]) for axis in range(3)]
    return unit_vectors(np.column_stack(sums))


def unit_vectors(vectors: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
    """Give vectors the length 1, and make zeros of those without one."""
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)


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


def bounding_box(shape: Shape) -> tuple[Float[np.ndarray, " d"], Float[np.ndarray, " d"]]:
    """Return the lowest and the highest corner of the box around all points."""
    return shape.points.min(axis=0), shape.points.max(axis=0)


def mean_radius(points: Float[np.ndarray, "n 3"]) -> float:
    """Return the root mean square distance of points from their middle."""
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))


def nearest_rotations(matrices: Float[np.ndarray, "k d d"]) -> Float[np.ndarray, "k d d"]:
    """Return the rotation nearest to each matrix in the Frobenius norm (Kabsch 1976)."""
    return rotations_and_stretches(matrices)[0]


def rotations_and_stretches(
    matrices: Float[np.ndarray, "*k d d"],
) -> tuple[Float[np.ndarray, "*k d d"], Float[np.ndarray, "*k d"]]:
    """Return the rotation R nearest to each matrix M, and signed stretches, whose sum is trace(RᵀM).

    They are the singular values; the smallest is negative if M reflects.
    """
    left, stretches, right = np.linalg.svd(matrices)
    # A reflection becomes a rotation by a change of sign along the smallest singular value.
    signs = np.sign(np.linalg.det(left @ right))
    left[..., -1] *= signs[..., None]
    stretches[..., -1] *= signs
    return left @ right, stretches


class Similarities(NamedTuple):
    """Rotation, factor of size, and center before and after, of k similarity transformations."""

    rotations: Float[np.ndarray, "k 3 3"]
    factors: Float[np.ndarray, " k"]
    before: Float[np.ndarray, "k 3"]
    after: Float[np.ndarray, "k 3"]

    def move(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 3"]:
        """Move a point by each, or all points by one."""
        turned = np.einsum("...ij,...j->...i", self.rotations, points - self.before)
        return self.after + self.factors[:, None] * turned


def fit_similarities(
    average: Callable[[Float[np.ndarray, "n c"]], Float[np.ndarray, "k c"]],
    before: Float[np.ndarray, "n 3"],
    after: Float[np.ndarray, "n 3"],
    follow: Float[np.ndarray, "3 3"] | None = None,
) -> Similarities:
    """Fit similarities to n pairs of points by least squares, one for each of k weighted means (Umeyama 1991).

    `average` returns the k means of each column of a table; it defines the weights. Rotations follow
    a given one where points hardly show how they are turned.
    """
    # About the middle and in unit size, so that moments keep their digits
    middles = before.mean(axis=0), after.mean(axis=0)
    (one, size), (two, size_after) = size_one(before - middles[0]), size_one(after - middles[1])
    products = np.einsum("ni,nj->nij", two, one).reshape(-1, 9)
    means = average(np.column_stack([one, two, products, np.sum(one**2, axis=1)]))
    center, there = means[:, :3], means[:, 3:6]
    moments = means[:, 6:15].reshape(-1, 3, 3) - there[:, :, None] * center[:, None, :]
    spreads = means[:, 15] - np.sum(center**2, axis=1)
    if follow is not None:
        moments += FOLLOW * np.linalg.norm(moments, axis=(1, 2), keepdims=True) * follow
    rotations, stretches = rotations_and_stretches(moments)
    # Points in one place have no size: they keep theirs.
    has_size = spreads > ONE_PLACE
    factors = np.divide(stretches.sum(axis=1), spreads, out=np.ones_like(spreads), where=has_size)
    return Similarities(
        rotations,
        factors * (size_after / size),
        middles[0] + size * center,
        middles[1] + size_after * there,
    )
