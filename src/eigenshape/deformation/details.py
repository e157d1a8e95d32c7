"""Details of a shape on a skeleton, kept in local frames of the skeleton (thesis 6.2.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape.deformation.binding import Binding
from eigenshape.deformation.handles import Handle, affine_offset
from eigenshape.geometry.measure import mean_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

Points = Float[np.ndarray, "n 3"]
# Least tangential part of an edge, as a share of its length. An edge with less is parallel to the
# normal up to rounding, and gives no direction to a frame.
LEAST_TANGENT = 1e-6


@dataclass(frozen=True, eq=False)
class FramedDetails:
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
    partner = _tangential_neighbors(mesh)
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
        weight = np.maximum(weight, _near_boundary(distance, extent))
    lengths = np.linalg.norm(by_frames, axis=1, keepdims=True)
    one, other = (
        np.divide(turned, lengths, out=np.zeros_like(turned), where=lengths > 0)
        for turned in (by_frames, by_handles)
    )
    return (weight[:, None] * one + (1 - weight[:, None]) * other) * lengths


def _near_boundary(distance: Float[np.ndarray, " n"], extent: float) -> Float[np.ndarray, " n"]:
    """Return 1 up to an eighth of the extent from the boundary, falling to 0 at a quarter."""
    if extent == 0:  # every vertex of the region lies on its boundary
        return (distance == 0).astype(float)
    return np.clip((extent / 4 - distance) / (extent / 8), 0, 1)


def _tangential_neighbors(skeleton: TriangleMesh) -> Int[np.ndarray, " n"]:
    """Return, for each vertex, the other end of its most tangential edge."""
    edges = edge_table(skeleton).edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    arms = skeleton.vertices[ends[:, 1]] - skeleton.vertices[ends[:, 0]]
    lengths, normals = np.linalg.norm(arms, axis=1), mean_normals(skeleton)[ends[:, 0]]
    flat = np.linalg.norm(arms - np.einsum("ei,ei->e", arms, normals)[:, None] * normals, axis=1)
    share = np.divide(flat, lengths, out=np.zeros_like(flat), where=lengths > 0)
    order = np.lexsort((share, ends[:, 0]))
    partner = np.empty(skeleton.n_vertices, dtype=np.int64)
    # Of several edges at a vertex the last one is kept, which is the most tangential.
    partner[ends[order, 0]] = ends[order, 1]
    return partner


def _local_frames(
    skeleton: TriangleMesh, partner: Int[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "n 3 3"], Bool[np.ndarray, " n"]]:
    """Return the frame of each vertex, its axes as rows, and whether it exists."""
    normals, arms = mean_normals(skeleton), skeleton.vertices[partner] - skeleton.vertices
    flat = arms - np.einsum("ni,ni->n", arms, normals)[:, None] * normals
    flat_lengths = np.linalg.norm(flat, axis=1, keepdims=True)
    arm_lengths = np.linalg.norm(arms, axis=1)
    has_frame = normals.any(axis=1) & (flat_lengths[:, 0] > LEAST_TANGENT * arm_lengths)
    along = np.divide(flat, flat_lengths, out=np.zeros_like(flat), where=has_frame[:, None])
    return np.stack([normals, along, np.cross(normals, along)], axis=1), has_frame
