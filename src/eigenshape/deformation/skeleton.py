"""Response of the eigen-skeleton to handles: steps 1 and 2 of the thesis (6.2.1, 6.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.handles import Handle, affine_offset, require_handles
from eigenshape.deformation.rig import eigen_skeleton, project_on_modes


@dataclass(frozen=True, eq=False)
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

    __repr__ = short_repr
    _repr_html_ = html_repr


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
    handles : sequence of r Rotation or Translation
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
