"""Eigen deformation as in the thesis: a skeleton moved by least squares, and details put back in two passes (6.3.3)."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from eigenshape.deformation.binding import Binding
from eigenshape.deformation.details import details_blended, details_by_frames
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import eigen_skeleton, projected
from eigenshape.deformation.skeleton import SkeletonGrip, moved_skeleton

SECOND_PASS = 300  # modes


def eigen_deformed(binding: Binding, grip: SkeletonGrip, handles: Sequence[Handle]) -> Float[np.ndarray, "n 3"]:
    """Return the vertices where the thesis' algorithm takes them.

    With fewer than 300 modes details are added up to the skeleton of 300, which is fitted once more, and the rest by
    local frames alone. With more, all at once.
    """
    rig, moved = binding.rig, moved_skeleton(grip, handles)
    vertices, faces, most = rig.mesh.vertices, rig.mesh.faces, min(SECOND_PASS, rig.n_modes)

    def recovered(goal: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        details = goal - grip.skeleton
        by_frames = details_by_frames(faces, grip.skeleton, moved, details)
        return moved + details_blended(binding, handles, by_frames, details)

    if binding.n_modes.max() >= most:
        return recovered(vertices)
    fine = eigen_skeleton(rig, most)
    fitted = rig.eigenvectors[:, :most] @ projected(rig, recovered(fine), most)
    return fitted + details_by_frames(faces, fine, fitted, vertices - fine)
