"""Bend a shape: a region of it follows a handle, and the rest follows smoothly."""

from collections.abc import Sequence
from typing import Literal, SupportsIndex, cast, get_args

from eigenshape._arguments import require_each, require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.deformation.binding import Binding, bind
from eigenshape.deformation.graded import graded, uncrossed
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.region import Region
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.thesis import detailed_skeleton, eigen_deformation
from eigenshape.geometry.mesh import TriangleMesh

Mode = Literal["graded", "uncrossed", "thesis"]


def deform(
    rig: EigenRig,
    region: Region,
    handle: Handle,
    *,
    fixed: Region | None = None,
    mode: Mode = "graded",
    n_modes: SupportsIndex | None = None,
) -> TriangleMesh:
    """Turn or move a region of a shape; the rest follows smoothly, and details survive (thesis chapter 6).

    For several edits of one region `bind` it once and `bend` it often; for several regions at once, the same.

    Parameters
    ----------
    rig : EigenRig
    region, fixed, n_modes
        As for `bind`.
    handle : Rotation or Translation
    mode : "graded", "uncrossed" or "thesis"
        See `bend`.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        As for `bind` and `bend`.
    """
    require_type(rig, EigenRig, "rig")
    require_type(handle, Handle, "handle")
    return bend(bind(rig, [region], fixed=fixed, n_modes=n_modes), [handle], mode=mode)


def bend(binding: Binding, handles: Sequence[Handle], *, mode: Mode = "graded") -> TriangleMesh:
    """Move bound regions by their handles.

    Parameters
    ----------
    binding : Binding
    handles : sequence of r Rotation or Translation
        One for each region.
    mode : "graded", "uncrossed" or "thesis"
        By graded rotations and as rigidly as possible; the same, stiffer where faces would cross, which folds and
        pinches less at the price of longer edges; or by the thesis' least-squares fit and its details.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        If there are more or fewer handles than regions, or the mode is another.

    Warns
    -----
    UserWarning
        If "uncrossed" leaves faces that cross, with their number.
    """
    require_type(binding, Binding, "binding")
    require_each(handles, Handle, "handles")
    if len(handles) != len(binding.regions):
        raise InvalidParameterError(
            f"Each region must have one handle; there are {len(binding.regions)} regions and {len(handles)} handles."
        )
    if require_mode(mode) == "thesis":
        vertices = eigen_deformation(detailed_skeleton(binding), handles)
    else:
        vertices = (uncrossed if mode == "uncrossed" else graded)(binding, handles)
    return TriangleMesh(vertices, binding.rig.mesh.faces)


def require_mode(mode: str) -> Mode:
    """Return the mode, or refuse another.

    Raises
    ------
    InvalidParameterError
    """
    if mode not in get_args(Mode):
        raise InvalidParameterError(
            f"mode must be 'graded', 'uncrossed' or 'thesis'; it is {mode!r}."
        )
    return cast(Mode, mode)
