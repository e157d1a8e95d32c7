"""Graded deformation: vertices follow their handles by shares, and what lies between turns as rigidly as it can."""

import warnings
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from eigenshape.deformation.binding import Binding, pulled
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rigidity import relax
from eigenshape.geometry.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh

N_ROUNDS = 12
PULLS = (
    30.0,
    100.0,
    300.0,
    1e3,
    3e3,
    1e4,
    3e4,
    1e5,
)  # a fold of a few edges gives way to about the number of vertices


def graded(
    binding: Binding, handles: Sequence[Handle], *, n_rounds: int = N_ROUNDS
) -> Float[np.ndarray, "n 3"]:
    """Return the vertices where handles take them.

    Each vertex turns and goes by its share s of a handle's motion, exp(s log r) for a rotation r, so that a twist
    does not pinch (a fit of the turned coordinates would go straight through the axis). What has share 0 or 1 stays
    there; in between, edges are made as rigid as possible.
    """
    pairs = zip(handles, binding.shares, strict=True)
    turns = quaternions(sum((np.outer(share, handle.turn) for handle, share in pairs), np.zeros(3)))
    start = shared_motion(binding, handles)
    return relax(binding.rig.edges, binding.part, binding.rig.mesh.vertices, start, turns, n_rounds)


def uncrossed(binding: Binding, handles: Sequence[Handle]) -> Float[np.ndarray, "n 3"]:
    """Return the vertices of `graded`, pulled to where their shares take them no more than it takes to cross no faces.

    Pairs of faces that cross before count for nothing. The last try is a pull without end, to exactly where shares take
    the vertices. If some cross there too, as where a handle takes a region into what is held, the vertices with the
    fewest are returned.

    Warns
    -----
    UserWarning
        If faces cross that did not before, with the number of pairs and the first.
    """
    mesh = binding.rig.mesh
    before = {tuple(pair) for pair in self_intersections(mesh).tolist()}
    best, crossing = mesh.vertices, list[list[int]]()
    for strength in (0.0, *PULLS, np.inf):
        if np.isinf(strength):
            found = shared_motion(binding, handles)
        else:
            found = graded(pulled(binding, strength) if strength else binding, handles)
        pairs = self_intersections(TriangleMesh(found, mesh.faces)).tolist()
        new = [pair for pair in pairs if tuple(pair) not in before]
        if not strength or len(new) < len(crossing):
            best, crossing = found, new
        if not new:
            return best
    one, two = crossing[0]
    warnings.warn(
        f"No pull keeps all faces apart; {len(crossing)} pairs cross that did not before, faces {one} and {two} first. "
        "Turn or move the region less, or choose another pivot.",
        stacklevel=3,
    )
    return best


def shared_motion(binding: Binding, handles: Sequence[Handle]) -> Float[np.ndarray, "n 3"]:
    """Return the vertices where their shares of all motions take them."""
    rest, pairs = binding.rig.mesh.vertices, zip(handles, binding.shares, strict=True)
    return rest + sum((handle.carry(rest, share) for handle, share in pairs), np.zeros(3))


def quaternions(turns: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    """Return the unit quaternions, real part first, of axes times angles."""
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    return np.column_stack([np.cos(angles / 2), np.sinc(angles / (2 * np.pi)) / 2 * turns])
