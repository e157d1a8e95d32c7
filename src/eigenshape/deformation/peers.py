"""Other ways to bend, behind one interface, to compare with: each takes a binding and its handles.

All take what the binding holds (vertices of share 0 or 1) to the same places, so that they compare at equal handles.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.linalg import lu_factor, lu_solve
from scipy.spatial.transform import Rotation

from eigenshape._arguments import require_each, require_type
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.graded import quaternions, shared_motion
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import eigen_skeleton
from eigenshape.deformation.rigidity import factored, relax
from eigenshape.deformation.rigidity_loops import fit_rotations, turned_edges
from eigenshape.operators.cotangent import cotangent_laplacian

Points = Float[np.ndarray, "n 3"]
HOLD = (
    100.0  # of the mean diagonal of the reduced equations, for what the modes are to keep in place
)


def as_rigid_as_possible(
    binding: Binding, handles: Sequence[Handle], *, n_rounds: int = 100
) -> Points:
    """Bend as rigidly as possible from the shape as it stands (Sorkine and Alexa 2007), cotangents clamped."""
    require_type(binding, Binding, "binding")
    require_each(handles, Handle, "handles")
    rest = binding.rig.mesh.vertices
    start = shared_motion(binding, handles)
    start[binding.part.free] = rest[binding.part.free]
    return relax(
        binding.rig.edges, binding.part, rest, start, quaternions(np.zeros_like(rest)), n_rounds
    )


@one_blas_thread()
def biharmonic_blend(binding: Binding, handles: Sequence[Handle]) -> Points:
    """Blend the handles' motions by weights whose Laplacian varies least (Jacobson and others 2011, without bounds).

    min |M^-½ W w|² with w = 0 or 1 where a vertex is held; then each goes by the sum of its weights of the motions.
    """
    require_type(binding, Binding, "binding")
    require_each(handles, Handle, "handles")
    rig, free = binding.rig, binding.part.free
    laplacian = cotangent_laplacian(rig.mesh)
    twice = (
        laplacian.stiffness @ sp.diags_array(1 / laplacian.mass.diagonal()) @ laplacian.stiffness
    )
    weights = binding.shares.T.copy()
    if len(free):
        rows = twice.tocsr()[free]
        weights[free] = 0
        weights[free] = factored(rows[:, free]).solve(-(rows @ weights))
    rest, moves = rig.mesh.vertices, zip(handles, weights.T, strict=True)
    whole = np.ones(len(rest))
    return rest + sum(
        (share[:, None] * handle.carry(rest, whole) for handle, share in moves), np.zeros(3)
    )


@one_blas_thread()
def spectral_rigid(
    binding: Binding, handles: Sequence[Handle], *, n_modes: int = 100, n_rounds: int = 20
) -> Points:
    """Bend the skeleton of some modes as rigidly as they can, and turn details with it (after Rong and others 2008).

    The unknowns are the skeleton's coefficients alone. What is held is pulled to its places, and details turn with the
    rotations that fit the skeleton's edges.
    """
    require_type(binding, Binding, "binding")
    require_each(handles, Handle, "handles")
    rig = binding.rig
    modes, rest = rig.eigenvectors[:, : min(n_modes, rig.n_modes)], rig.mesh.vertices
    skeleton = eigen_skeleton(rig, modes.shape[1])
    details, held = rest - skeleton, np.setdiff1d(np.arange(len(rest)), binding.part.free)
    links = rig.edges.starts, rig.edges.others, rig.edges.weights
    stiff, pull = modes.T @ (rig.edges.matrix @ modes), modes[held].T @ modes[held]
    weight = HOLD * np.trace(stiff) / max(np.trace(pull), np.finfo(float).tiny)
    factor = lu_factor(stiff + weight * pull)
    goal = (shared_motion(binding, handles) - rest)[held]
    everyone, turns, sums = (
        np.arange(len(rest)),
        quaternions(np.zeros_like(rest)),
        np.empty_like(rest),
    )
    moved = skeleton
    for _ in range(n_rounds):
        turned_edges(everyone, *links, skeleton, turns, sums)
        turned = _turned(turns[held], details[held]) - details[held]
        moved = skeleton + modes @ lu_solve(
            factor, modes.T @ sums + weight * modes[held].T @ (goal - turned)
        )
        fit_rotations(everyone, *links, skeleton, moved, turns)
    return moved + _turned(turns, details)


def _turned(
    turns: Float[np.ndarray, "k 4"], vectors: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "k 3"]:
    return np.asarray(Rotation.from_quat(np.roll(turns, -1, axis=1)).apply(vectors))
