"""Graded rotation: vertices follow handles by shares, and the rest moves rigidly."""

import warnings
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from eigenshape.deformation.binding import Binding, pull_binding
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rigidity import relax
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


def bend_graded(
    binding: Binding, handles: Sequence[Handle], *, n_rounds: int = N_ROUNDS
) -> Float[np.ndarray, "n 3"]:
    """Return the vertices after a graded rotation.

    Each vertex moves by its share s of a handle's motion: exp(s log r) for a rotation r, so a twist
    does not pinch (a linear fit of the rotated coordinates would pass through the axis). Vertices
    of share 0 or 1 stay there. The free vertices then move so that edges are as rigid as possible.
    """
    pairs = zip(handles, binding.shares, strict=True)
    turns = quaternions(sum((np.outer(share, handle.turn) for handle, share in pairs), np.zeros(3)))
    start = move_by_shares(binding, handles)
    return relax(binding.rig.edges, binding.part, binding.rig.mesh.vertices, start, turns, n_rounds)


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
