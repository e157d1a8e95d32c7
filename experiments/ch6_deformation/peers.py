"""Other methods of deformation, which chapter 6 compares with; each takes a binding and its handles.

All move the vertices of share 0 or 1 to the same places, so they compare at equal handles. They use the library's own
loops and factors, so that times and errors tell methods apart and not how they are written.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lu_factor, lu_solve
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.deformation.deform import move_by_shares, quaternions
from eigenshape.deformation.rigidity import factor_equations, relax
from eigenshape.deformation.rigidity_loops import fit_rotations, turn_edges

Handles = Sequence[es.Rotation | es.Translation]
# Weight of the fixed vertices in the reduced equations, as a multiple of their mean diagonal. A larger weight keeps
# them nearer to their places and bends the rest more.
FIXED_WEIGHT = 100.0


def as_rigid_as_possible(
    binding: es.deformation.Binding, handles: Handles, n_rounds: int = 100
) -> np.ndarray:
    """Bend as rigidly as possible, from the undeformed shape (Sorkine and Alexa 2007).

    Cotangent weights are clamped to positive values. Each round fits rotations and solves for the vertices.
    """
    rest = binding.rig.mesh.vertices
    start = move_by_shares(binding, handles)
    start[binding.part.free] = rest[binding.part.free]
    turns = quaternions(np.zeros_like(rest))
    return relax(binding.rig.edges, binding.part, rest, start, turns, n_rounds)


def biharmonic_blend(binding: es.deformation.Binding, handles: Handles) -> np.ndarray:
    """Blend the motions of the handles by biharmonic weights (Jacobson and others 2011, unbounded).

    The weights w of a handle minimize |M^-½ W w|², with w = 0 or 1 at the vertices of share 0 or 1. Each vertex moves
    by the sum of all motions, each times its weight.
    """
    rig, free = binding.rig, binding.part.free
    laplacian = es.cotangent_laplacian(rig.mesh)
    twice = (
        laplacian.stiffness @ sp.diags_array(1 / laplacian.mass.diagonal()) @ laplacian.stiffness
    )
    weights = binding.shares.T.copy()
    if len(free):
        rows = twice.tocsr()[free]
        weights[free] = 0
        weights[free] = factor_equations(rows[:, free]).solve(-(rows @ weights))
    rest, moves = rig.mesh.vertices, zip(handles, weights.T, strict=True)
    whole = np.ones(len(rest))
    return rest + sum(
        (share[:, None] * handle.carry(rest, whole) for handle, share in moves), np.zeros(3)
    )


def spectral_rigid(
    binding: es.deformation.Binding, handles: Handles, n_modes: int = 100, n_rounds: int = 20
) -> np.ndarray:
    """Bend the skeleton of the lowest modes as rigidly as possible (after Rong and others 2008).

    The unknowns are the coefficients of the skeleton. Vertices of share 0 or 1 are pulled to their places by a penalty,
    and details turn with the rotations that fit the edges of the skeleton.
    """
    rig = binding.rig
    modes, rest = rig.eigenvectors[:, : min(n_modes, rig.n_modes)], rig.mesh.vertices
    skeleton = es.deformation.eigen_skeleton(rig, modes.shape[1])
    details, fixed = rest - skeleton, np.setdiff1d(np.arange(len(rest)), binding.part.free)
    links = rig.edges.starts, rig.edges.others, rig.edges.weights
    stiff, pull = modes.T @ (rig.edges.matrix @ modes), modes[fixed].T @ modes[fixed]
    weight = FIXED_WEIGHT * np.trace(stiff) / max(np.trace(pull), np.finfo(float).tiny)
    factor = lu_factor(stiff + weight * pull)
    goal = (move_by_shares(binding, handles) - rest)[fixed]
    everyone, turns = np.arange(len(rest)), quaternions(np.zeros_like(rest))
    sums = np.empty_like(rest)
    moved = skeleton
    for _ in range(n_rounds):
        turn_edges(everyone, *links, skeleton, turns, sums)
        change = _turn(turns[fixed], details[fixed]) - details[fixed]
        right = modes.T @ sums + weight * modes[fixed].T @ (goal - change)
        moved = skeleton + modes @ lu_solve(factor, right)
        fit_rotations(everyone, *links, skeleton, moved, turns)
    return moved + _turn(turns, details)


def _turn(turns: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_quat(np.roll(turns, -1, axis=1)).apply(vectors))
