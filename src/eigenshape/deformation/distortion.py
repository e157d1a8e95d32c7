"""How much a deformation stretches, squeezes and folds a shape."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidParameterError
from eigenshape.deformation.rigidity import edge_weights, fitted_turns
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, bounding_box, edge_lengths
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import size_one
from eigenshape.operators.cotangent import cotangent_laplacian


@dataclass(frozen=True, eq=False)
class Distortion:
    """What a deformation did to edges and faces.

    Attributes
    ----------
    edge_error : float
        Root mean square of the relative changes of edge lengths.
    edge_error_of_box : float
        Root mean square of the changes, over the diagonal of the box: the unit of table 6.2 of the thesis.
    area_ratios : (f,) float
        Area of each face, after over before.
    flipped : (k,) int
        Faces that look away from where the rotations of their corners, on the mean, would turn them.
    """

    edge_error: float
    edge_error_of_box: float
    area_ratios: Float[np.ndarray, " f"]
    flipped: Int[np.ndarray, " k"]


def measure_distortion(before: MeshLike, after: MeshLike) -> Distortion:
    """Compare two poses of a mesh.

    Parameters
    ----------
    before, after : MeshLike
        With the same faces; those before may not be flat.

    Returns
    -------
    Distortion

    Raises
    ------
    InvalidParameterError
        If the faces differ.
    InvalidShapeError
        If a face has no area before.
    """
    before = as_mesh(before, "before")
    after = as_mesh(after, "after")
    require_poses(before, after)
    rest, scale = size_one(before.vertices)
    old, new = (TriangleMesh(points, before.faces) for points in (rest, after.vertices / scale))
    lengths = edge_lengths(old)
    change = edge_lengths(new) - lengths
    low, high = bounding_box(old)
    normals, turned = (area_vectors(mesh.vertices[mesh.faces]) for mesh in (old, new))
    edges = edge_weights(cotangent_laplacian(old).stiffness)
    turns = fitted_turns(edges, old.vertices, new.vertices)[old.faces]
    away = np.einsum("fcij,fj,fi->f", turns, normals, turned) < 0
    return Distortion(
        float(np.sqrt(np.mean((change / lengths) ** 2))),
        float(np.sqrt(np.mean(change**2)) / np.linalg.norm(high - low)),
        np.linalg.norm(turned, axis=1) / np.linalg.norm(normals, axis=1),
        np.flatnonzero(away),
    )


def require_poses(before: TriangleMesh, after: TriangleMesh) -> None:
    """Refuse two meshes that are not poses of one.

    Raises
    ------
    InvalidParameterError
        If the faces differ.
    """
    if before.n_vertices != after.n_vertices or not np.array_equal(before.faces, after.faces):
        raise InvalidParameterError(
            f"Poses of one mesh must have the same faces; these are {before} and {after}."
        )
