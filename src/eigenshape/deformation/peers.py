"""Other methods of deformation, for comparison; each takes a binding and its handles.

All move the vertices of share 0 or 1 to the same places, so they compare at equal handles.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.linalg import lu_factor, lu_solve
from scipy.spatial.transform import Rotation

from eigenshape._arguments import require_type
from eigenshape._arrays import step_number
from eigenshape._threads import one_blas_thread
from eigenshape._typing import Integer
from eigenshape.deformation.binding import Binding
from eigenshape.deformation.graded_bend import move_by_shares, quaternions
from eigenshape.deformation.handles import Handle, require_handles
from eigenshape.deformation.rig import eigen_skeleton
from eigenshape.deformation.rigidity import factor_equations, relax
from eigenshape.deformation.rigidity_loops import fit_rotations, turn_edges
from eigenshape.operators.cotangent import cotangent_laplacian

Points = Float[np.ndarray, "n 3"]
# Weight of the fixed vertices in the reduced equations, as a multiple of their mean diagonal. A
# larger weight keeps them nearer to their places and bends the rest more.
FIXED_WEIGHT = 100.0


def as_rigid_as_possible(
    binding: Binding, handles: Sequence[Handle], *, n_rounds: Integer = 100
) -> Points:
    """Bend as rigidly as possible, from the undeformed shape (Sorkine and Alexa 2007).

    Cotangent weights are clamped to positive values.

    Parameters
    ----------
    binding : Binding
    handles : sequence of r Rotation or Translation
        One for each region.
    n_rounds : int
        Largest number of rounds; each fits rotations and solves for the vertices.

    Returns
    -------
    (n, 3) float
        The vertices.

    Raises
    ------
    InvalidParameterError
        If there is not one handle for each region, or n_rounds is not in 1..1,000,000.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> lift = es.Translation([0, 0, 0.5])
    >>> vertices = es.deformation.as_rigid_as_possible(binding, [lift])
    >>> float(vertices[:, 2].max().round(3))
    1.5
    """
    require_type(binding, Binding, "binding")
    require_handles(handles, len(binding.regions))
    rest = binding.rig.mesh.vertices
    start = move_by_shares(binding, handles)
    start[binding.part.free] = rest[binding.part.free]
    most, turns = step_number(n_rounds, "n_rounds"), quaternions(np.zeros_like(rest))
    return relax(binding.rig.edges, binding.part, rest, start, turns, most)


@one_blas_thread()
def biharmonic_blend(binding: Binding, handles: Sequence[Handle]) -> Points:
    """Blend the motions of the handles by biharmonic weights (Jacobson and others 2011, unbounded).

    The weights w of a handle minimize |M^-½ W w|², with w = 0 or 1 at the vertices of share 0 or 1.
    Each vertex moves by the sum of all motions, each times its weight.

    Parameters
    ----------
    binding : Binding
    handles : sequence of r Rotation or Translation
        One for each region.

    Returns
    -------
    (n, 3) float
        The vertices.

    Raises
    ------
    InvalidParameterError
        If there is not one handle for each region, or n_rounds is not in 1..1,000,000.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> lift = es.Translation([0, 0, 0.5])
    >>> vertices = es.deformation.biharmonic_blend(binding, [lift])
    >>> float(vertices[:, 2].max().round(1))
    1.5
    """
    require_type(binding, Binding, "binding")
    require_handles(handles, len(binding.regions))
    rig, free = binding.rig, binding.part.free
    laplacian = cotangent_laplacian(rig.mesh)
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


@one_blas_thread()
def spectral_rigid(
    binding: Binding, handles: Sequence[Handle], *, n_modes: int = 100, n_rounds: Integer = 20
) -> Points:
    """Bend the skeleton of the lowest modes as rigidly as possible (after Rong and others 2008).

    The unknowns are the coefficients of the skeleton. Vertices of share 0 or 1 are pulled to their
    places by a penalty, and details turn with the rotations that fit the edges of the skeleton.

    Parameters
    ----------
    binding : Binding
    handles : sequence of r Rotation or Translation
        One for each region.
    n_modes : int
        Number of modes of the skeleton.
    n_rounds : int
        Number of rounds; each fits rotations and solves for the coefficients.

    Returns
    -------
    (n, 3) float
        The vertices.

    Raises
    ------
    InvalidParameterError
        If there is not one handle for each region, or n_rounds is not in 1..1,000,000.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> lift = es.Translation([0, 0, 0.5])
    >>> vertices = es.deformation.spectral_rigid(binding, [lift])
    >>> float(vertices[:, 2].max().round(1))
    1.5
    """
    require_type(binding, Binding, "binding")
    require_handles(handles, len(binding.regions))
    rig, count = binding.rig, step_number(n_rounds, "n_rounds")
    modes, rest = rig.eigenvectors[:, : min(n_modes, rig.n_modes)], rig.mesh.vertices
    skeleton = eigen_skeleton(rig, modes.shape[1])
    details, fixed = rest - skeleton, np.setdiff1d(np.arange(len(rest)), binding.part.free)
    links = rig.edges.starts, rig.edges.others, rig.edges.weights
    stiff, pull = modes.T @ (rig.edges.matrix @ modes), modes[fixed].T @ modes[fixed]
    weight = FIXED_WEIGHT * np.trace(stiff) / max(np.trace(pull), np.finfo(float).tiny)
    factor = lu_factor(stiff + weight * pull)
    goal = (move_by_shares(binding, handles) - rest)[fixed]
    everyone, turns = np.arange(len(rest)), quaternions(np.zeros_like(rest))
    sums = np.empty_like(rest)
    moved = skeleton
    for _ in range(count):
        turn_edges(everyone, *links, skeleton, turns, sums)
        change = _turn(turns[fixed], details[fixed]) - details[fixed]
        right = modes.T @ sums + weight * modes[fixed].T @ (goal - change)
        moved = skeleton + modes @ lu_solve(factor, right)
        fit_rotations(everyone, *links, skeleton, moved, turns)
    return moved + _turn(turns, details)


def _turn(
    turns: Float[np.ndarray, "k 4"], vectors: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "k 3"]:
    return np.asarray(Rotation.from_quat(np.roll(turns, -1, axis=1)).apply(vectors))
