"""Details: what a skeleton lacks of its shape, kept in local frames and put back where it has moved (thesis 6.2.3)."""

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
LEAST_TANGENT = 1e-6  # of an edge: below, it is along the normal, and frames no direction


@dataclass(frozen=True, eq=False)
class FramedDetails:
    """Details of a shape on a skeleton, kept in the skeleton's local frames.

    Attributes
    ----------
    details : (n, 3) float
        What the skeleton lacks.
    local : (n, 3) float
        The same along the normal, along an edge that is as tangential as can be, and across both.
    partner : (n,) int
        The other end of that edge.
    told : (n,) bool
        Whether a frame is told: the normal does not vanish, and some edge is not along it.
    """

    details: Points
    local: Points
    partner: Int[np.ndarray, " n"]
    told: Bool[np.ndarray, " n"]


def framed(faces: Int[np.ndarray, "f 3"], skeleton: Points, shape: Points) -> FramedDetails:
    """Keep what a skeleton lacks of a shape in its local frames."""
    mesh, details = TriangleMesh(skeleton, faces), shape - skeleton
    partner = _tangential_neighbors(mesh)
    frames, told = _frames(mesh, partner)
    return FramedDetails(details, np.einsum("nij,nj->ni", frames, details), partner, told)


def turned_by_frames(faces: Int[np.ndarray, "f 3"], kept: FramedDetails, moved: Points) -> Points:
    """Return details as the local frames of the moved skeleton hold them; unturned where a frame is not told."""
    frames, told = _frames(TriangleMesh(moved, faces), kept.partner)
    return np.where(
        (kept.told & told)[:, None], np.einsum("nji,nj->ni", frames, kept.local), kept.details
    )


def turned_by_handles(binding: Binding, handles: Sequence[Handle], details: Points) -> Points:
    """Turn details inside regions with their handles."""
    turned = details.copy()
    for mask, handle in zip(binding.regions, handles, strict=True):
        turned[mask] += details[mask] @ affine_offset(handle)[:, :3].T
    return turned


def blended(binding: Binding, by_frames: Points, by_handles: Points) -> Points:
    """Blend details turned by frames, near the boundary of a region, with those turned by its handle (thesis 6.3.1).

    Directions are blended, and lengths kept up to that, as printed.
    """
    weight = np.zeros(len(by_frames))
    for mask, away in zip(binding.regions, binding.distances, strict=True):
        weight = np.maximum(weight, _near(away, away[mask & np.isfinite(away)].max()))
    lengths = np.linalg.norm(by_frames, axis=1, keepdims=True)
    one, other = (
        np.divide(turned, lengths, out=np.zeros_like(turned), where=lengths > 0)
        for turned in (by_frames, by_handles)
    )
    return (weight[:, None] * one + (1 - weight[:, None]) * other) * lengths


def _near(away: Float[np.ndarray, " n"], extent: float) -> Float[np.ndarray, " n"]:
    if extent == 0:  # the region is its own boundary
        return (away == 0).astype(float)
    return np.clip((extent / 4 - away) / (extent / 8), 0, 1)


def _tangential_neighbors(skeleton: TriangleMesh) -> Int[np.ndarray, " n"]:
    edges = edge_table(skeleton).edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    arms = skeleton.vertices[ends[:, 1]] - skeleton.vertices[ends[:, 0]]
    lengths, up = np.linalg.norm(arms, axis=1), mean_normals(skeleton)[ends[:, 0]]
    flat = np.linalg.norm(arms - np.einsum("ei,ei->e", arms, up)[:, None] * up, axis=1)
    share = np.divide(flat, lengths, out=np.zeros_like(flat), where=lengths > 0)
    order = np.lexsort((share, ends[:, 0]))
    partner = np.empty(skeleton.n_vertices, dtype=np.int64)
    partner[ends[order, 0]] = ends[order, 1]  # of several the last, which is the most tangential
    return partner


def _frames(
    skeleton: TriangleMesh, partner: Int[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "n 3 3"], Bool[np.ndarray, " n"]]:
    normals, arms = mean_normals(skeleton), skeleton.vertices[partner] - skeleton.vertices
    flat = arms - np.einsum("ni,ni->n", arms, normals)[:, None] * normals
    lengths, whole = np.linalg.norm(flat, axis=1, keepdims=True), np.linalg.norm(arms, axis=1)
    told = normals.any(axis=1) & (lengths[:, 0] > LEAST_TANGENT * whole)
    along = np.divide(flat, lengths, out=np.zeros_like(flat), where=told[:, None])
    return np.stack([normals, along, np.cross(normals, along)], axis=1), told
