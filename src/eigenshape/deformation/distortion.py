"""Measure how much a deformation stretches, squeezes and folds a shape."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from eigenshape._vectors import area_vectors, size_one
from eigenshape.deformation.rigidity import edge_weights, fit_turns
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import edge_lengths
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian


@record
class Distortion(ReadOnly):
    """Changes of edges and faces in a deformation.

    Attributes
    ----------
    edge_error : float
        Root mean square of the relative changes of edge lengths, without unit.
    edge_error_of_box : float
        Root mean square of the changes of edge lengths, divided by the diagonal of the bounding
        box, as in table 6.2 of the thesis.
    area_ratios : (f,) float
        Area of each face after the deformation, divided by its area before.
    flipped : (k,) int
        Faces whose normal is turned by more than 90 degrees from its direction before, rotated by
        the mean of the fitted rotations at the corners.

    See Also
    --------
    measure_distortion : Compute the distortion.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> larger = es.TriangleMesh(1.1 * mesh.vertices, mesh.faces)
    >>> distortion = es.deformation.measure_distortion(mesh, larger)
    >>> round(distortion.edge_error, 6), len(distortion.flipped)
    (0.1, 0)
    """

    edge_error: float
    edge_error_of_box: float
    area_ratios: Float[np.ndarray, " f"]
    flipped: Int[np.ndarray, " k"]


def measure_distortion(before: MeshLike, after: MeshLike) -> Distortion:
    """Measure how much edges and faces change between two poses of a mesh.

    Parameters
    ----------
    before, after : MeshLike
        Two meshes with the same faces.

    Returns
    -------
    Distortion

    Raises
    ------
    InvalidParameterError
        If the faces differ.
    InvalidShapeError
        If a face of `before` has no area.

    Examples
    --------
    A sphere that is scaled by 1.1:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> larger = es.TriangleMesh(1.1 * mesh.vertices, mesh.faces)
    >>> distortion = es.deformation.measure_distortion(mesh, larger)
    >>> round(distortion.edge_error, 6)
    0.1
    >>> distortion.area_ratios[:3].round(6)
    array([1.21, 1.21, 1.21])
    """
    before = as_mesh(before, "before")
    after = as_mesh(after, "after")
    require_poses(before, after)
    rest, scale = size_one(before.vertices)
    old, new = (TriangleMesh(points, before.faces) for points in (rest, after.vertices / scale))
    lengths = edge_lengths(old)
    change = edge_lengths(new) - lengths
    normals, turned = (area_vectors(mesh.vertices[mesh.faces]) for mesh in (old, new))
    edges = edge_weights(old, cotangent_laplacian(old).stiffness)
    turns = fit_turns(edges, old.vertices, new.vertices)[old.faces]
    # Scalar product of the new normal with the old one, turned by the rotation of each corner.
    away = np.einsum("fcij,fj,fi->f", turns, normals, turned) < 0
    return Distortion(
        float(np.sqrt(np.mean((change / lengths) ** 2))),
        float(np.sqrt(np.mean(change**2)) / np.linalg.norm(np.ptp(rest, axis=0))),
        np.linalg.norm(turned, axis=1) / np.linalg.norm(normals, axis=1),
        np.flatnonzero(away),
    )


def require_poses(before: TriangleMesh, after: TriangleMesh) -> None:
    """Raise an error if two meshes do not have the same faces."""
    if before.n_vertices != after.n_vertices or not np.array_equal(before.faces, after.faces):
        raise InvalidParameterError(
            f"Poses of one mesh must have the same faces; these are {before} and {after}."
        )
