"""Deformation transfer: how one shape was bent, done to another in correspondence (thesis chapter 7)."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from eigenshape._arguments import require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.distortion import require_poses
from eigenshape.deformation.rigidity import edge_weights, fitted_turns, free_part, nearest_rotations
from eigenshape.deformation.rigidity_loops import turned_edges
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes, size_one
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.maps.functional_map import FunctionalMap, point_areas, transfer_function

Turns = Float[np.ndarray, "n 3 3"]


@one_blas_thread()
def transfer_deformation(
    before: MeshLike,
    after: MeshLike,
    target: MeshLike,
    mapping: FunctionalMap,
    *,
    n_modes: SupportsIndex | None = None,
) -> TriangleMesh:
    """Bend a shape as another one was bent.

    What travels is how each vertex turned: the rotations that fit its edges, as nine functions in the low modes of
    the source, by the functional map to the modes of the target. The target's edges are turned by them, and vertices
    follow in the least-squares sense (Sumner and Popović 2004 do so with the gradients of faces). Few modes carry the
    pose, more carry how limbs curve. Where the shapes stand differently in space, rotations are turned along.

    Parameters
    ----------
    before, after : MeshLike
        Two poses of the source, with the same faces.
    target : MeshLike
        In the pose that answers to `before`.
    mapping : FunctionalMap
        From the modes of `before` to those of the target.
    n_modes : int, optional
        Modes of the source that carry; by default all of the map.

    Returns
    -------
    TriangleMesh
        The target, bent, its middle moved as that of the source in proportion to size.

    Raises
    ------
    InvalidParameterError
        If the poses have other faces, the map is of other shapes, or has fewer modes.
    InvalidShapeError
        If a face of `before` or the target has no area.
    """
    before = as_mesh(before, "before")
    after = as_mesh(after, "after")
    target = as_mesh(target, "target")
    require_type(mapping, FunctionalMap, "mapping")
    require_poses(before, after)
    for mesh, spectrum, name in (
        (before, mapping.source, "source"),
        (target, mapping.target, "target"),
    ):
        if mesh.n_vertices != len(spectrum.eigenvectors):
            raise InvalidParameterError(
                f"The map's {name} has {len(spectrum.eigenvectors)} vertices, and the mesh has {mesh.n_vertices}."
            )
    wanted = mapping.matrix.shape[1] if n_modes is None else n_modes
    k = whole_number(wanted, "n_modes", 1, mapping.matrix.shape[1])
    few = FunctionalMap(mapping.matrix[:, :k], mapping.source, mapping.target)
    turns = fitted_turns(
        edge_weights(cotangent_laplacian(before).stiffness), before.vertices, after.vertices
    )
    carried = nearest_rotations(transfer_function(few, turns.reshape(-1, 9)).reshape(-1, 3, 3))
    stand = _turn_between(
        transfer_function(mapping, before.vertices), target.vertices, point_areas(mapping.target)
    )
    return TriangleMesh(
        _turned_by(target, stand @ carried @ stand.T) + _step(before, after, target, stand),
        target.faces,
    )


def _turn_between(
    source: Float[np.ndarray, "n 3"],
    target: Float[np.ndarray, "n 3"],
    areas: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "3 3"]:
    """Return the rotation that takes points to their partners best (Kabsch 1976)."""
    one, two = (size_one(points - _middle(points, areas))[0] for points in (source, target))
    return nearest_rotations((two.T @ (areas[:, None] / areas.sum() * one))[None])[0]


def _middle(
    points: Float[np.ndarray, "n 3"], areas: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " 3"]:
    return np.asarray((areas / areas.sum()) @ points)


def _turned_by(target: TriangleMesh, turns: Turns) -> Float[np.ndarray, "n 3"]:
    """Return the target with its edges turned, its middle where it was."""
    edges, areas = edge_weights(cotangent_laplacian(target).stiffness), dual_volumes(target)
    held = np.arange(target.n_vertices) == 0
    part = free_part(edges, held)
    sums = np.empty((len(part.free), 3))
    spins = np.roll(Rotation.from_matrix(turns).as_quat(), 1, axis=1)
    turned_edges(part.free, edges.starts, edges.others, edges.weights, target.vertices, spins, sums)
    found = target.vertices.copy()
    if part.factor is not None:
        found[part.free] += part.factor.solve(sums)
    return found + _middle(target.vertices, areas) - _middle(found, areas)


def _step(
    before: TriangleMesh, after: TriangleMesh, target: TriangleMesh, stand: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, " 3"]:
    ours, theirs = dual_volumes(before), dual_volumes(target)
    size = np.sqrt(theirs.sum() / ours.sum())
    return size * stand @ (_middle(after.vertices, ours) - _middle(before.vertices, ours))
