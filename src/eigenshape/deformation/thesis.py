"""Eigen deformation as in the thesis: a skeleton moved by least squares, and details put back in two passes (6.3.3)."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float

from eigenshape.deformation.binding import Binding
from eigenshape.deformation.details import details_blended, details_by_frames, details_by_handles
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import eigen_skeleton, projected
from eigenshape.deformation.skeleton import SkeletonGrip, moved_skeleton

SECOND_PASS = 300  # modes

Points = Float[np.ndarray, "n 3"]
Details = Literal["blended", "frames", "handle"]


def eigen_deformed(
    binding: Binding,
    grip: SkeletonGrip,
    handles: Sequence[Handle],
    *,
    details: Details = "blended",
    second_pass: bool = True,
) -> Points:
    """Return the vertices where the thesis' algorithm takes them.

    With fewer than 300 modes details are added up to the skeleton of 300, which is fitted once more, and the rest by
    local frames alone. With more, all at once.

    Parameters
    ----------
    binding : Binding
    grip : SkeletonGrip
        Of `grip_skeleton`.
    handles : sequence of r Rotation or Translation
    details : "blended", "frames" or "handle"
        How the first pass turns details: as in 6.3.1, or by either of its two ways alone (figure 6.7).
    second_pass : bool
        Whether there is one (6.3.3, figure 6.9).

    Returns
    -------
    (n, 3) float
    """
    rig, moved = binding.rig, moved_skeleton(grip, handles)
    vertices, faces, most = rig.mesh.vertices, rig.mesh.faces, min(SECOND_PASS, rig.n_modes)

    def recovered(goal: Points) -> Points:
        lacking = goal - grip.skeleton
        by_frames = details_by_frames(faces, grip.skeleton, moved, lacking)
        by_handles = details_by_handles(binding, handles, lacking)
        ways = {"frames": by_frames, "handle": by_handles, "blended": details_blended(binding, by_frames, by_handles)}
        return moved + ways[details]

    if not second_pass or binding.n_modes.max() >= most:
        return recovered(vertices)
    fine = eigen_skeleton(rig, most)
    fitted = rig.eigenvectors[:, :most] @ projected(rig, recovered(fine), most)
    return fitted + details_by_frames(faces, fine, fitted, vertices - fine)
