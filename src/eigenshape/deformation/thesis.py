"""Eigen deformation as in the thesis: a skeleton moved by least squares, and details put back in two passes (6.3.3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_each, require_type
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.details import (
    FramedDetails,
    blended,
    framed,
    turned_by_frames,
    turned_by_handles,
)
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import eigen_skeleton, projected
from eigenshape.deformation.skeleton import SkeletonResponse, move_skeleton, skeleton_response

SECOND_PASS = 300  # modes

Points = Float[np.ndarray, "n 3"]
Details = Literal["blended", "frames", "handle"]


@dataclass(frozen=True, eq=False)
class DetailedSkeleton:
    """A skeleton that handles can move, and what it takes to put details back.

    Attributes
    ----------
    binding : Binding
    response : SkeletonResponse
    fine : (n, 3) float
        The skeleton of 300 modes; the shape itself where the response has as many.
    first, second : FramedDetails
        From the response's skeleton to the fine one, and from that to the shape.
    """

    binding: Binding
    response: SkeletonResponse
    fine: Points
    first: FramedDetails
    second: FramedDetails


@one_blas_thread()
def detailed_skeleton(binding: Binding, *, second_pass: bool = True) -> DetailedSkeleton:
    """Prepare a binding for the thesis' algorithm: for many positions of its handles.

    Parameters
    ----------
    binding : Binding
    second_pass : bool
        Whether details come back by way of the skeleton of 300 modes (6.3.3); all at once otherwise.
    """
    require_type(binding, Binding, "binding")
    rig, response = binding.rig, skeleton_response(binding)
    shape, faces, most = rig.mesh.vertices, rig.mesh.faces, min(SECOND_PASS, rig.n_modes)
    fine = eigen_skeleton(rig, most) if second_pass and binding.n_modes.max() < most else shape
    return DetailedSkeleton(
        binding, response, fine, framed(faces, response.skeleton, fine), framed(faces, fine, shape)
    )


@one_blas_thread()
def eigen_deformation(
    skeleton: DetailedSkeleton, handles: Sequence[Handle], *, details: Details = "blended"
) -> Points:
    """Return the vertices where the thesis' algorithm takes them.

    Details are added up to the skeleton of 300 modes, which is fitted once more, and the rest by local frames alone;
    with as many modes from the beginning, all at once.

    Parameters
    ----------
    skeleton : DetailedSkeleton
    handles : sequence of r Rotation or Translation
    details : "blended", "frames" or "handle"
        How the first pass turns details: as in 6.3.1, or by either of its two ways alone (figure 6.7).

    Returns
    -------
    (n, 3) float
    """
    require_type(skeleton, DetailedSkeleton, "skeleton")
    require_each(handles, Handle, "handles")
    rig, faces = skeleton.binding.rig, skeleton.binding.rig.mesh.faces
    moved = move_skeleton(skeleton.response, handles)
    by_frames = turned_by_frames(faces, skeleton.first, moved)
    by_handles = turned_by_handles(skeleton.binding, handles, skeleton.first.details)
    ways = {
        "frames": by_frames,
        "handle": by_handles,
        "blended": blended(skeleton.binding, by_frames, by_handles),
    }
    found = moved + ways[details]
    if skeleton.fine is rig.mesh.vertices:
        return found
    most = min(SECOND_PASS, rig.n_modes)
    fitted = rig.eigenvectors[:, :most] @ projected(rig, found, most)
    return fitted + turned_by_frames(faces, skeleton.second, fitted)
