"""Eigen deformation of the thesis: a skeleton moved by least squares, and its details (6.3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.details import (
    FramedDetails,
    blend_details,
    frame_details,
    turn_by_frames,
    turn_by_handles,
)
from eigenshape.deformation.handles import Handle, require_handles
from eigenshape.deformation.rig import eigen_skeleton, project_on_modes
from eigenshape.deformation.skeleton import SkeletonResponse, move_skeleton, skeleton_response

# Modes of the finer skeleton, through which the details come back (thesis 6.3.3).
SECOND_PASS = 300

Points = Float[np.ndarray, "n 3"]
Details = Literal["blended", "frames", "handle"]


@dataclass(frozen=True, eq=False)
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

    __repr__ = short_repr
    _repr_html_ = html_repr


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
    as many modes, all details are added at once.

    Parameters
    ----------
    skeleton : DetailedSkeleton
    handles : sequence of r Rotation or Translation
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
    rig, faces = skeleton.binding.rig, skeleton.binding.rig.mesh.faces
    moved = move_skeleton(skeleton.response, handles)
    by_frames = turn_by_frames(faces, skeleton.first, moved)
    by_handles = turn_by_handles(skeleton.binding, handles, skeleton.first.details)
    ways = {
        "frames": by_frames,
        "handle": by_handles,
        "blended": blend_details(skeleton.binding, by_frames, by_handles),
    }
    found = moved + ways[details]
    if skeleton.fine is rig.mesh.vertices:
        return found
    most = min(SECOND_PASS, rig.n_modes)
    fitted = rig.eigenvectors[:, :most] @ project_on_modes(rig, found, most)
    return fitted + turn_by_frames(faces, skeleton.second, fitted)
