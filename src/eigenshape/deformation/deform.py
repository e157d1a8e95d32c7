"""Bend a shape: regions follow handles, and the rest follows smoothly."""

import warnings
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.typing import Integer
from eigenshape.deformation.binding import Binding, bind, pull_binding
from eigenshape.deformation.handles import Handle, Scaling, require_handle, require_handles
from eigenshape.deformation.modes import Mode, require_mode
from eigenshape.deformation.region import Region
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.rigidity import relax
from eigenshape.deformation.thesis import detailed_skeleton, eigen_deformation
from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh

# Rounds of relaxation, at most: most bends settle in fewer than 30. A bar of 12,700 vertices that is
# bent by 90° within one and a half widths has an edge error of 0.038 after 30 rounds and of 0.020
# after 100.
N_ROUNDS = 100
# Strengths that `bend_uncrossed` tries, without unit (see `pull_binding`), about three to a decade:
# each that is tried costs one bend. A fold of a few edges yields at about the number of vertices.
PULLS = (30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 3e4, 1e5)
# Number of the pull that is tried first: folds of bent and twisted bars yield at it.
FIRST_PULL = 1


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
    handle : Rotation, Translation or Scaling
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
    handles : sequence of r Rotation, Translation or Scaling
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


def bend_graded(
    binding: Binding, handles: Sequence[Handle], *, n_rounds: int = N_ROUNDS
) -> Float[np.ndarray, "n 3"]:
    """Return the vertices after a graded rotation.

    Each vertex moves by its share s of a handle's motion: exp(s log r) for a rotation r, so a twist
    does not pinch (a linear fit of the rotated coordinates would pass through the axis). Vertices
    of share 0 or 1 stay there. The free vertices then move so that edges are as rigid as possible.
    """
    pairs = list(zip(handles, binding.shares, strict=True))
    turns = quaternions(sum((np.outer(share, handle.turn) for handle, share in pairs), np.zeros(3)))
    start = move_by_shares(binding, handles)
    # A scaling changes lengths. Edges then stay as rigid as they can beside those of the scaled shape.
    rest = binding.rig.mesh.vertices
    for handle, share in pairs:
        if isinstance(handle, Scaling):
            rest = rest + handle.carry(binding.rig.mesh.vertices, share)
    return relax(binding.rig.edges, binding.part, rest, start, turns, n_rounds)


def bend_uncrossed(binding: Binding, handles: Sequence[Handle]) -> Float[np.ndarray, "n 3"]:
    """Return the vertices of `bend_graded` with the weakest pull at which no faces cross.

    Free vertices are pulled to where their shares take them. Pairs of faces that cross before the
    motion do not count. An infinite pull is tried first: pairs that cross with it as well as
    without a pull count as stuck, for example because a handle moves a region into fixed vertices.
    If others cross, the strength is bisected, as if pairs that are parted at one strength were so
    at any stronger one. If faces cross in all attempts, the result with the fewest crossing pairs
    is returned.

    Warns
    -----
    UserWarning
        If faces cross that did not cross before, with the number of pairs and the first pair.
    """
    mesh = binding.rig.mesh
    best = bend_graded(binding, handles)
    crossing = _new_crossings(mesh, best)
    if not crossing:
        return best
    found = move_by_shares(binding, handles)
    pairs = _new_crossings(mesh, found)
    stuck = crossing & pairs
    # The weakest pull that parts all pairs but the stuck ones has a number from low to high.
    low, high, number = 0, len(PULLS), FIRST_PULL
    if crossing == stuck:
        high = 0
    elif len(pairs) < len(crossing):
        best, crossing = found, pairs
    while low < high:
        found = bend_graded(pull_binding(binding, PULLS[number]), handles)
        pairs = _new_crossings(mesh, found)
        parted = pairs <= stuck
        low, high = (low, number) if parted else (number + 1, high)
        if parted or len(pairs) < len(crossing):
            best, crossing = found, pairs
        number = (low + high) // 2
    if crossing:
        one, two = min(crossing)
        warnings.warn(
            f"Faces cross at every strength of the pull; {len(crossing)} pairs cross that did not "
            f"before, the first are faces {one} and {two}. "
            "Turn or move the region less, or choose another pivot.",
            stacklevel=3,
        )
    return best


def _new_crossings(mesh: TriangleMesh, vertices: Float[np.ndarray, "n 3"]) -> set[tuple[int, int]]:
    """Return the pairs of faces that cross at these vertices, but not at those of the mesh."""
    pairs = self_intersections(TriangleMesh(vertices, mesh.faces))
    # Of the mesh itself, only the faces of these pairs matter.
    faces = np.unique(pairs)
    if not len(faces):
        return set()
    before = faces[self_intersections(TriangleMesh(mesh.vertices, mesh.faces[faces]))]
    return {(one, two) for one, two in pairs.tolist()} - {
        (one, two) for one, two in before.tolist()
    }


def move_by_shares(binding: Binding, handles: Sequence[Handle]) -> Float[np.ndarray, "n 3"]:
    """Return the vertices moved by their shares of all motions."""
    rest, pairs = binding.rig.mesh.vertices, zip(handles, binding.shares, strict=True)
    return rest + sum((handle.carry(rest, share) for handle, share in pairs), np.zeros(3))


def quaternions(turns: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    """Return the unit quaternions, real part first, of rotation vectors (axis times angle)."""
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    return np.column_stack([np.cos(angles / 2), np.sinc(angles / (2 * np.pi)) / 2 * turns])
