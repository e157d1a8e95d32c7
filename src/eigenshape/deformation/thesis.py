"""Eigen deformation of the thesis (6.2, 6.3): a skeleton that handles move, and its details in frames."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.threads import one_blas_thread
from eigenshape._corners import mean_normals
from eigenshape._vectors import row_dots
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.handles import Handle, affine_offset, require_handles
from eigenshape.deformation.rig import eigen_skeleton, project_on_modes
from eigenshape.deformation.rigidity import spread_harmonically
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# Least tangential part of an edge, as a share of its length. An edge with less is parallel to the
# normal up to rounding, and gives no direction to a frame.
LEAST_TANGENT = 1e-6
# Modes of the finer skeleton, through which the details come back (thesis 6.3.3).
SECOND_PASS = 300

Points = Float[np.ndarray, "n 3"]
Details = Literal["blended", "frames", "handle"]


@record
class SkeletonResponse(ReadOnly):
    """The eigen-skeleton, and how it responds to the motions of handles.

    The response is linear: each drag costs four numbers per vertex and region, so a viewer can
    follow a handle without calling the library (for example in a vertex shader).

    Attributes
    ----------
    skeleton : (n, 3) float
        K, the eigen-skeleton of as many modes as the binding uses.
    weights : (r, n, 4) float
        U with K* = K + Σ_r U_r D_rᵀ, where D_r = [R - 1 | t] for the motion x → R x + t of region
        r.

    See Also
    --------
    skeleton_response : Compute the response.
    move_skeleton : Apply motions.

    Examples
    --------
    A viewer can apply the formula itself. For a translation, R - 1 is zero:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> response = es.deformation.skeleton_response(binding)
    >>> motion = np.column_stack([np.zeros((3, 3)), [0, 0, 0.5]])  # [R - 1 | t]
    >>> moved = response.skeleton + response.weights[0] @ motion.T
    >>> handle = es.Translation([0, 0, 0.5])
    >>> bool(np.allclose(moved, es.deformation.move_skeleton(response, [handle])))
    True
    """

    skeleton: Float[np.ndarray, "n 3"]
    weights: Float[np.ndarray, "r n 4"]


@one_blas_thread()
def skeleton_response(binding: Binding) -> SkeletonResponse:
    """Compute how the eigen-skeleton responds to all motions of the bound regions (thesis eq. 6.1).

    A motion cuts a region out of the skeleton and moves it; the new skeleton is the least-squares
    fit by the lowest modes. The fit is Φ (ΦᵀΦ)⁻¹ Φ_Rᵀ [K_R, 1] times D, so four columns per region
    serve all motions.

    Parameters
    ----------
    binding : Binding

    Returns
    -------
    SkeletonResponse

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> response = es.deformation.skeleton_response(binding)
    >>> response.weights.shape
    (1, 162, 4)
    >>> es.deformation.move_skeleton(response, [es.Translation([0, 0, 1])]).shape
    (162, 3)
    """
    require_type(binding, Binding, "binding")
    rig, n_modes = binding.rig, int(binding.n_modes.max())
    skeleton = eigen_skeleton(rig, n_modes)
    homogeneous = np.column_stack([skeleton, np.ones(len(skeleton))])
    weights = [
        rig.eigenvectors[:, :n_modes] @ project_on_modes(rig, homogeneous * mask[:, None], n_modes)
        for mask in binding.regions
    ]
    return SkeletonResponse(skeleton, np.array(weights))


def move_skeleton(
    response: SkeletonResponse, handles: Sequence[Handle]
) -> Float[np.ndarray, "n 3"]:
    """Return the eigen-skeleton under the motions of handles.

    Parameters
    ----------
    response : SkeletonResponse
    handles : sequence of r Rotation, Translation or Scaling
        One for each region.

    Returns
    -------
    (n, 3) float
        K*, the vertices of the moved skeleton.

    Raises
    ------
    InvalidParameterError
        If there is not one handle for each region.

    See Also
    --------
    skeleton_response : Compute the response.
    bend : Move the shape itself.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> response = es.deformation.skeleton_response(binding)
    >>> still = es.deformation.move_skeleton(response, [es.Translation([0, 0, 0])])
    >>> moved = es.deformation.move_skeleton(response, [es.Translation([0, 0, 0.5])])
    >>> bool((moved[:, 2] - still[:, 2]).max() > 0.4)
    True
    """
    require_type(response, SkeletonResponse, "response")
    require_handles(handles, len(response.weights))
    pairs = zip(response.weights, handles, strict=True)
    return response.skeleton + sum(
        (weights @ affine_offset(handle).T for weights, handle in pairs), np.zeros(3)
    )


@record
class FramedDetails(ReadOnly):
    """Details of a shape on a skeleton, in the local frames of the skeleton.

    Attributes
    ----------
    details : (n, 3) float
        Shape minus skeleton.
    local : (n, 3) float
        Coordinates of the details along the normal, along the tangential part of an edge, and along
        their cross product.
    partner : (n,) int
        The other end of that edge: the most tangential edge at the vertex.
    has_frame : (n,) bool
        Whether the frame exists: the normal is not zero, and some edge is not parallel to it.
    """

    details: Points
    local: Points
    partner: Int[np.ndarray, " n"]
    has_frame: Bool[np.ndarray, " n"]


def frame_details(faces: Int[np.ndarray, "f 3"], skeleton: Points, shape: Points) -> FramedDetails:
    """Express the details of a shape on a skeleton in the local frames of the skeleton."""
    mesh, details = TriangleMesh(skeleton, faces), shape - skeleton
    edges = edge_table(mesh).edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    arms = skeleton[ends[:, 1]] - skeleton[ends[:, 0]]
    lengths, normals = np.linalg.norm(arms, axis=1), mean_normals(mesh)[ends[:, 0]]
    flat = np.linalg.norm(arms - row_dots(arms, normals)[:, None] * normals, axis=1)
    share = np.divide(flat, lengths, out=np.zeros_like(flat), where=lengths > 0)
    order = np.lexsort((share, ends[:, 0]))
    partner = np.empty(mesh.n_vertices, dtype=np.int64)
    # Of several edges at a vertex the last one is kept, which is the most tangential.
    partner[ends[order, 0]] = ends[order, 1]
    frames, has_frame = _local_frames(mesh, partner)
    return FramedDetails(details, np.einsum("nij,nj->ni", frames, details), partner, has_frame)


def turn_by_frames(faces: Int[np.ndarray, "f 3"], kept: FramedDetails, moved: Points) -> Points:
    """Turn details with the local frames of the moved skeleton, where these exist."""
    frames, has_frame = _local_frames(TriangleMesh(moved, faces), kept.partner)
    turned = np.einsum("nji,nj->ni", frames, kept.local)
    return np.where((kept.has_frame & has_frame)[:, None], turned, kept.details)


def turn_by_handles(binding: Binding, handles: Sequence[Handle], details: Points) -> Points:
    """Turn the details inside each region with its handle."""
    turned = details.copy()
    for mask, handle in zip(binding.regions, handles, strict=True):
        turned[mask] += details[mask] @ affine_offset(handle)[:, :3].T
    return turned


def blend_details(binding: Binding, by_frames: Points, by_handles: Points) -> Points:
    """Blend details turned by frames with details turned by handles (thesis 6.3.1).

    Frames count near the boundary of a region, handles deep inside. As in the thesis, directions
    are blended, and the result has the length of the details or less.
    """
    weight = np.zeros(len(by_frames))
    for mask, distance in zip(binding.regions, binding.distances, strict=True):
        extent = distance[mask & np.isfinite(distance)].max()
        # 1 up to an eighth of the extent from the boundary, falling to 0 at a quarter; where every
        # vertex of the region lies on its boundary, 1 there
        near = distance == 0 if extent == 0 else (extent / 4 - distance) / (extent / 8)
        weight = np.maximum(weight, np.clip(near, 0, 1))
    lengths = np.linalg.norm(by_frames, axis=1, keepdims=True)
    one, other = (
        np.divide(turned, lengths, out=np.zeros_like(turned), where=lengths > 0)
        for turned in (by_frames, by_handles)
    )
    return (weight[:, None] * one + (1 - weight[:, None]) * other) * lengths


def _local_frames(
    skeleton: TriangleMesh, partner: Int[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "n 3 3"], Bool[np.ndarray, " n"]]:
    """Return the frame of each vertex, its axes as rows, and whether it exists."""
    normals, arms = mean_normals(skeleton), skeleton.vertices[partner] - skeleton.vertices
    flat = arms - row_dots(arms, normals)[:, None] * normals
    flat_lengths = np.linalg.norm(flat, axis=1, keepdims=True)
    arm_lengths = np.linalg.norm(arms, axis=1)
    has_frame = normals.any(axis=1) & (flat_lengths[:, 0] > LEAST_TANGENT * arm_lengths)
    along = np.divide(flat, flat_lengths, out=np.zeros_like(flat), where=has_frame[:, None])
    return np.stack([normals, along, np.cross(normals, along)], axis=1), has_frame


@record
class DetailedSkeleton(ReadOnly):
    """An eigen-skeleton that handles can move, and the details of the shape on it.

    Attributes
    ----------
    binding : Binding
    response : SkeletonResponse
    fine : (n, 3) float
        The skeleton of 300 modes; the shape itself if the coarse skeleton has as many.
    first, second : FramedDetails
        Details of the fine skeleton on the coarse one, and of the shape on the fine one.

    See Also
    --------
    detailed_skeleton : Prepare a binding.
    eigen_deformation : Move the handles.

    Examples
    --------
    Prepare once, then move the handle as often as needed:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> top = mesh.vertices[:, 2] > 0.2
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [top])
    >>> skeleton = es.deformation.detailed_skeleton(binding)
    >>> skeleton.fine.shape
    (162, 3)
    >>> pulled = es.deformation.eigen_deformation(skeleton, [es.Translation([0, 0, 0.5])])
    >>> bool(pulled[top, 2].mean() > mesh.vertices[top, 2].mean())
    True
    """

    binding: Binding
    response: SkeletonResponse
    fine: Points
    first: FramedDetails
    second: FramedDetails


@one_blas_thread()
def detailed_skeleton(binding: Binding, *, second_pass: bool = True) -> DetailedSkeleton:
    """Prepare a binding for the algorithm of the thesis, for many positions of its handles.

    Parameters
    ----------
    binding : Binding
    second_pass : bool
        Whether details are put back in two passes, through the skeleton of 300 modes (6.3.3), or
        all at once.

    Returns
    -------
    DetailedSkeleton

    Examples
    --------
    One preparation serves many positions of a handle:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> skeleton = es.deformation.detailed_skeleton(binding)
    >>> for height in (0.1, 0.2):
    ...     moved = es.deformation.eigen_deformation(skeleton, [es.Translation([0, 0, height])])
    ...     print(f"the mean height is {moved[:, 2].mean():.2f}")
    the mean height is 0.04
    the mean height is 0.08
    """
    require_type(binding, Binding, "binding")
    rig, response = binding.rig, skeleton_response(binding)
    shape, faces, most = rig.mesh.vertices, rig.mesh.faces, min(SECOND_PASS, rig.n_modes)
    fine = eigen_skeleton(rig, most) if second_pass and binding.n_modes.max() < most else shape
    first = frame_details(faces, response.skeleton, fine)
    second = frame_details(faces, fine, shape)
    return DetailedSkeleton(binding, response, fine, first, second)


@one_blas_thread()
def eigen_deformation(
    skeleton: DetailedSkeleton, handles: Sequence[Handle], *, details: Details = "blended"
) -> Points:
    """Deform a shape by the algorithm of the thesis (6.2, 6.3).

    The skeleton moves by least squares. Details up to the skeleton of 300 modes are added and
    fitted once more by these modes; the rest is added in local frames. If the coarse skeleton has
    as many modes, all details are added at once. Fixed vertices are then set back to where they
    were, and the free ones around them by a harmonic part of that, which the thesis does not do.

    Parameters
    ----------
    skeleton : DetailedSkeleton
    handles : sequence of r Rotation, Translation or Scaling
        One for each region.
    details : "blended", "frames" or "handle"
        How the first pass turns details: blended as in 6.3.1, by local frames alone, or by handles
        alone (figure 6.7).

    Returns
    -------
    (n, 3) float
        The vertices.

    Raises
    ------
    InvalidParameterError
        If there is not one handle for each region.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> skeleton = es.deformation.detailed_skeleton(binding)
    >>> es.deformation.eigen_deformation(skeleton, [es.Translation([0, 0, 0.5])]).shape
    (162, 3)
    """
    require_type(skeleton, DetailedSkeleton, "skeleton")
    require_handles(handles, len(skeleton.response.weights))
    binding = skeleton.binding
    rig, faces = binding.rig, binding.rig.mesh.faces
    moved = move_skeleton(skeleton.response, handles)
    by_frames = turn_by_frames(faces, skeleton.first, moved)
    by_handles = turn_by_handles(binding, handles, skeleton.first.details)
    ways = {
        "frames": by_frames,
        "handle": by_handles,
        "blended": blend_details(binding, by_frames, by_handles),
    }
    found = moved + ways[details]
    if skeleton.fine is not rig.mesh.vertices:
        most = min(SECOND_PASS, rig.n_modes)
        fitted = rig.eigenvectors[:, :most] @ project_on_modes(rig, found, most)
        found = fitted + turn_by_frames(faces, skeleton.second, fitted)
    if not binding.fixed.any():
        return found
    # The modes move fixed vertices, too. Set back alone they would tear: at gaps of one edge, edges
    # became 4 to 6 times as long, and 1.5 to 2.8 times with a harmonic transition.
    moved = np.where(binding.fixed[:, None], found - rig.mesh.vertices, 0)
    return found - spread_harmonically(binding.part, moved)
