"""The eigen-skeleton that follows handles: steps 1 and 2 of the thesis (6.2.1, 6.2.2), linear in each motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_each, require_type
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.handles import Handle, affine_offset
from eigenshape.deformation.rig import eigen_skeleton, projected


@dataclass(frozen=True, eq=False)
class SkeletonResponse:
    """What a drag needs at each vertex: its place, and four numbers a region.

    Attributes
    ----------
    skeleton : (n, 3) float
        K, the eigen-skeleton of as many modes as the binding asks for.
    weights : (r, n, 4) float
        U with K* = K + Σ U_r D_rᵀ, where D = [R - 1 | t] is a motion x → R x + t less the identity.
    """

    skeleton: Float[np.ndarray, "n 3"]
    weights: Float[np.ndarray, "r n 4"]


@one_blas_thread()
def skeleton_response(binding: Binding) -> SkeletonResponse:
    """Find the least-squares fit of moved regions by the low modes, for all motions at once (thesis eq. 6.1).

    A motion cuts a region of the skeleton out and moves it; the fit is Φ (ΦᵀΦ)⁻¹ Φ_Rᵀ [K_R, 1] times D, and so four
    columns serve all motions.
    """
    require_type(binding, Binding, "binding")
    rig, n_modes = binding.rig, int(binding.n_modes.max())
    skeleton = eigen_skeleton(rig, n_modes)
    ends = np.column_stack([skeleton, np.ones(len(skeleton))])
    cut = [projected(rig, ends * mask[:, None], n_modes) for mask in binding.regions]
    return SkeletonResponse(
        skeleton, np.array([rig.eigenvectors[:, :n_modes] @ columns for columns in cut])
    )


def move_skeleton(
    response: SkeletonResponse, handles: Sequence[Handle]
) -> Float[np.ndarray, "n 3"]:
    """Return K*, the skeleton where handles take it."""
    require_type(response, SkeletonResponse, "response")
    require_each(handles, Handle, "handles")
    pairs = zip(response.weights, handles, strict=True)
    return response.skeleton + sum(
        (weights @ affine_offset(handle).T for weights, handle in pairs), np.zeros(3)
    )
