"""Deformation transfer: bend one shape as another one was bent (thesis chapter 7)."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from certeig.kit.arrays import real_numbers, whole_number, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._vectors import nearest_rotations, size_one
from eigenshape.deformation.distortion import require_poses
from eigenshape.deformation.rigidity import edge_weights, fit_turns, free_part
from eigenshape.deformation.rigidity_loops import turn_edges
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import warn_of_seams
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.spectral.maps.functional_map import FunctionalMap, transfer_function
from eigenshape.spectral.maps.point_maps import map_from_points
from eigenshape.spectral.solve import solve_spectrum

# Modes of a map that is given by vertices: a pose needs some 20 to 50, and higher ones carry errors
# of single vertices (experiments/ch6_deformation).
POSE_MODES = 50
Turns = Float[np.ndarray, "n 3 3"]


@one_blas_thread()
def transfer_deformation(
    before: MeshLike,
    after: MeshLike,
    target: MeshLike,
    mapping: FunctionalMap | ArrayLike,
    *,
    n_modes: Integer | None = None,
) -> TriangleMesh:
    """Bend a shape in the way another shape was bent.

    The rotation of each vertex of the source is fitted to its edges. The nine entries of the
    rotations are functions in the lowest modes of the source, and the functional map carries them
    to the target. The edges of the target are rotated, and the vertices follow by least squares
    (Sumner and Popović 2004 do this with the gradients of faces). Few modes carry the pose; more
    modes also carry how limbs curve. If the two shapes are oriented differently in space, the
    rotations are turned accordingly.

    Parameters
    ----------
    before, after : MeshLike
        Two poses of the source, with the same faces.
    target : MeshLike
        The target, in a pose that corresponds to `before`.
    mapping : FunctionalMap or (n,) int
        From the modes of `before` to those of the target; or a vertex of `before` for each vertex
        of the target, such as ``match_shapes(target, before)``, from which a map of 50 modes is
        computed.
    n_modes : int, optional
        Number of modes of the source to use; by default all modes of the map.

    Returns
    -------
    TriangleMesh
        The bent target. Its center moves as that of the source, in proportion to size.

    Raises
    ------
    InvalidParameterError
        If the poses have different faces, the map belongs to other shapes, or `n_modes` is not in
        1..k.
    InvalidShapeError
        If a face of `before` or of the target has no area.

    Warns
    -----
    UserWarning
        If vertices of the target are double along seams, where it would come apart.

    See Also
    --------
    functional_map : Compute the map from pairs of corresponding points.
    eigenshape.matching.match_shapes : Find corresponding points.

    Examples
    --------
    Stretch a sphere as another one was stretched:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> longer = es.TriangleMesh(mesh.vertices * [1, 1, 1.2], mesh.faces)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 16)
    >>> pairs = [[i, i] for i in range(162)]
    >>> mapping = es.functional_map(spectrum, spectrum, pairs, n_modes=16)
    >>> bent = es.deformation.transfer_deformation(mesh, longer, mesh, mapping)
    >>> height = bent.vertices[:, 2].max() - bent.vertices[:, 2].min()
    >>> float(height.round(1))
    2.1
    """
    before = as_mesh(before, "before")
    after = as_mesh(after, "after")
    target = as_mesh(target, "target")
    require_poses(before, after)
    warn_of_seams(target)
    if not isinstance(mapping, FunctionalMap):
        # The functional map of 50 modes, or fewer on small meshes, of corresponding vertices
        partners = whole_numbers(
            real_numbers(mapping, "mapping"), "mapping", 0, before.n_vertices - 1
        )
        if len(partners) != target.n_vertices:
            raise InvalidParameterError(
                "mapping must be a FunctionalMap or hold a vertex of `before` for each vertex of the "
                f"target; it has {len(partners)} for {target.n_vertices}."
            )
        n_shared = min(POSE_MODES, before.n_vertices // 2, target.n_vertices // 2)
        source, other = (
            solve_spectrum(surface_laplacian(mesh), n_shared) for mesh in (before, target)
        )
        mapping = map_from_points(source, other, partners, n_modes=n_shared)
    for mesh, spectrum, name in (
        (before, mapping.source, "source"),
        (target, mapping.target, "target"),
    ):
        if mesh.n_vertices != len(spectrum.eigenvectors):
            raise InvalidParameterError(
                f"The {name} of the map must be the given mesh; it has "
                f"{len(spectrum.eigenvectors)} vertices, and the mesh has {mesh.n_vertices}."
            )
    wanted = mapping.matrix.shape[1] if n_modes is None else n_modes
    k = whole_number(wanted, "n_modes", 1, mapping.matrix.shape[1])
    few = FunctionalMap(mapping.matrix[:, :k], mapping.source, mapping.target)
    weights = edge_weights(before, surface_laplacian(before).stiffness)
    turns = fit_turns(weights, before.vertices, after.vertices)
    # A mean of rotations is no rotation: take the nearest one.
    carried = nearest_rotations(transfer_function(few, turns.reshape(-1, 9)).reshape(-1, 3, 3))
    # How the target stands in space: the rotation that takes the source, carried over to it, nearest
    # to its vertices (Kabsch 1976)
    areas = mapping.target.point_areas
    places = transfer_function(mapping, before.vertices), target.vertices
    one, two = (size_one(points - _center(points, areas))[0] for points in places)
    stand = nearest_rotations((two.T @ (areas[:, None] / areas.sum() * one))[None])[0]
    turned = _turn_edges(target, stand @ carried @ stand.T)
    # The center moves as that of the source, in proportion to size.
    ours, theirs = dual_volumes(before), dual_volumes(target)
    size = np.sqrt(theirs.sum() / ours.sum())
    shift = size * stand @ (_center(after.vertices, ours) - _center(before.vertices, ours))
    return TriangleMesh(turned + shift, target.faces)


def _center(
    points: Float[np.ndarray, "n 3"], areas: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " 3"]:
    return (areas / areas.sum()) @ points


def _turn_edges(target: TriangleMesh, turns: Turns) -> Float[np.ndarray, "n 3"]:
    """Return the vertices of the target with its edges turned, and its center unchanged."""
    edges = edge_weights(target, surface_laplacian(target).stiffness)
    areas = dual_volumes(target)
    # The equations know edges alone: vertex 0 is fixed, and the center is restored below.
    fixed = np.arange(target.n_vertices) == 0
    part = free_part(edges, fixed)
    sums = np.empty((len(part.free), 3))
    spins = np.roll(Rotation.from_matrix(turns).as_quat(), 1, axis=1)
    turn_edges(part.free, edges.starts, edges.others, edges.weights, target.vertices, spins, sums)
    found = target.vertices.copy()
    if part.factor is not None:
        found[part.free] += part.factor.solve(sums)
    return found + _center(target.vertices, areas) - _center(found, areas)
