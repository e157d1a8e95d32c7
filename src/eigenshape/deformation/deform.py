"""Bend a shape: regions follow handles, and the rest follows smoothly."""

from collections.abc import Sequence

from eigenshape._arguments import require_type
from eigenshape._typing import Integer
from eigenshape.deformation.binding import Binding, bind
from eigenshape.deformation.graded_bend import bend_graded, bend_uncrossed
from eigenshape.deformation.handles import Handle, require_handle, require_handles
from eigenshape.deformation.modes import Mode, require_mode
from eigenshape.deformation.region import Region
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.thesis import detailed_skeleton, eigen_deformation
from eigenshape.geometry.mesh import TriangleMesh


def deform(
    rig: EigenRig,
    region: Region,
    handle: Handle,
    *,
    fixed: Region | None = None,
    mode: Mode = "graded",
    n_modes: Integer | None = None,
) -> TriangleMesh:
    """Rotate or translate a region of a shape; the rest follows smoothly (thesis chapter 6).

    To move one region many times, or several regions at once, call `bind` once and `bend` for each
    motion.

    Parameters
    ----------
    rig : EigenRig
    region : (n,) bool, (k,) int, BoxRegion or BrushRegion
        The vertices that the handle moves.
    handle : Rotation or Translation
    fixed : region, optional
        The vertices that must stay; see `bind`.
    mode : "graded", "uncrossed" or "thesis"
        The method; see `bend`.
    n_modes : int, optional
        Number of modes that spread the motion: fewer spread it further; see `bind`.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        As for `bind` and `bend`.

    See Also
    --------
    rig_shape : Prepare a shape.
    DeformationSession : Edit a shape step by step, with undo and redo.

    Examples
    --------
    Turn the upper half of a sphere by 30 degrees about the vertical axis:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> top = mesh.vertices[:, 2] > 0.2
    >>> twist = es.Rotation(pivot=[0, 0, 0], axis=[0, 0, 1], angle=np.pi / 6)
    >>> bent = es.deform(es.rig_shape(mesh), top, twist)
    >>> bool(np.allclose(bent.vertices[:, 2], mesh.vertices[:, 2], atol=0.1))
    True
    """
    require_type(rig, EigenRig, "rig")
    require_handle(handle)
    return bend(bind(rig, [region], fixed=fixed, n_modes=n_modes), [handle], mode=mode)


def bend(binding: Binding, handles: Sequence[Handle], *, mode: Mode = "graded") -> TriangleMesh:
    """Move bound regions by their handles.

    Parameters
    ----------
    binding : Binding
    handles : sequence of r Rotation or Translation
        One for each region.
    mode : "graded", "uncrossed" or "thesis"
        "graded" rotates each vertex by its share of the motion and then makes edges as rigid as
        possible. "uncrossed" does the same and stiffens the shape where faces would cross, which
        avoids folds and changes edge lengths more. "thesis" is the least-squares fit of the thesis
        with its details (chapter 6).

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        If the number of handles differs from the number of regions, or the mode is unknown.

    Warns
    -----
    UserWarning
        If faces cross after "uncrossed", with the number of pairs.

    See Also
    --------
    bind : Compute a binding.
    deform : Bind and bend one region in one call.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> lifted = es.deformation.bend(binding, [es.Translation([0, 0, 0.5])])
    >>> float(lifted.vertices[:, 2].max().round(3))
    1.5
    """
    require_type(binding, Binding, "binding")
    require_handles(handles, len(binding.regions))
    if require_mode(mode) == "thesis":
        vertices = eigen_deformation(detailed_skeleton(binding), handles)
    elif mode == "uncrossed":
        vertices = bend_uncrossed(binding, handles)
    else:
        vertices = bend_graded(binding, handles)
    return TriangleMesh(vertices, binding.rig.mesh.faces)
