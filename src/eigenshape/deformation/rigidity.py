"""As rigid as possible: edges turn with their vertices, by local fits and one global solve in turn."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.rigidity_loops import fit_rotations, turned_edges
from eigenshape.sparse.elimination import SymmetricFactor, analyse, factorise

Points = Float[np.ndarray, "n 3"]
Step = tuple[Points, Points]  # how far a round moved, and where to
WINDOW = 4  # rounds that the next one looks back on
SETTLED = 1e-4  # share of the energy; a round that gains less is the last
LEAST_WEIGHT = 1e-3  # of the mean: edges whose cotangents add up to nothing, or less, hold a little all the same


@dataclass(frozen=True, eq=False)
class EdgeWeights:
    """What each edge counts in the energy Σ_ij w_ij |R_i (x_i - x_j) - (x'_i - x'_j)|² / 2 (Sorkine and Alexa 2007).

    Attributes
    ----------
    matrix : (n, n) sparse
        Degrees minus weights.
    starts, others, weights
        The weights by rows: those of vertex i are weights[starts[i]:starts[i + 1]], to its neighbours.
    """

    matrix: sp.csr_array
    starts: Int[np.ndarray, " n1"]
    others: Int[np.ndarray, " e"]
    weights: Float[np.ndarray, " e"]


@dataclass(frozen=True, eq=False)
class FreePart:
    """The vertices that are not held, and their equations.

    Attributes
    ----------
    free : (u,) int
    fitted : (a,) int
        Those that are free or have a free neighbour: only their rotations matter.
    rows : (u, n) sparse
        The matrix' rows of what is free.
    pull : (u,) float
        h: the energy of a free vertex grows by h |x' - g|², g being where it starts.
    factor : SymmetricFactor or None
        Of its square part and h; None where nothing is free.
    """

    free: Int[np.ndarray, " u"]
    fitted: Int[np.ndarray, " a"]
    rows: sp.csr_array
    pull: Float[np.ndarray, " u"]
    factor: SymmetricFactor | None


def edge_weights(stiffness: sp.csr_array) -> EdgeWeights:
    """Return the weights of a cotangent stiffness matrix, none less than a thousandth of their mean.

    Negative ones would let the energy fall below 0 while a vertex turns over.
    """
    links = (-stiffness).tocsr()
    links.setdiag(0)
    links.eliminate_zeros()
    links.sort_indices()
    links.data = np.maximum(links.data, LEAST_WEIGHT * np.abs(links.data).mean())
    matrix = (sp.diags_array(links.sum(axis=1)) - links).tocsr()
    return EdgeWeights(
        matrix, links.indptr.astype(np.int64), links.indices.astype(np.int64), links.data
    )


def free_part(
    edges: EdgeWeights, held: Bool[np.ndarray, " n"], pull: Float[np.ndarray, " n"] | None = None
) -> FreePart:
    """Factor the equations of the vertices that are not held, and may be pulled to where they start.

    Raises
    ------
    InvalidParameterError
        If no vertex of some component is held.
    InvalidShapeError
        If angles are too near to 0 for the equations.
    """
    require_held(edges, held)
    free = np.flatnonzero(~held)
    rows = edges.matrix[free]
    fitted = np.unique(np.concatenate([free, rows.indices])).astype(np.int64)
    hold = np.zeros(len(free)) if pull is None else pull[free]
    square = (rows[:, free] + sp.diags_array(hold)).tocsr()
    return FreePart(free, fitted, rows, hold, factored(square) if len(free) else None)


def require_held(edges: EdgeWeights, held: Bool[np.ndarray, " n"]) -> None:
    """Refuse what holds no vertex of some component.

    Raises
    ------
    InvalidParameterError
    """
    n_components, component = connected_components(edges.matrix, directed=False)
    adrift = np.flatnonzero(np.bincount(component[held], minlength=n_components) == 0)
    if adrift.size:
        vertex = int(np.flatnonzero(component == adrift[0])[0])
        raise InvalidParameterError(
            f"Each component must be held somewhere; that of vertex {vertex} is not ({adrift.size} such)."
        )


def factored(square: sp.csr_array) -> SymmetricFactor:
    """Factor the equations of what is free.

    Raises
    ------
    InvalidShapeError
        If they are not positive definite.
    """
    matrix = square.tocsc()
    matrix.sort_indices()
    with one_blas_thread():
        factor = factorise(analyse(matrix), matrix.data)
    if factor is None or not (factor.pivots > 0).all():
        raise InvalidShapeError(
            "A shape must have angles to be bent; some are too near to 0 for the equations."
        )
    return factor


def relax(
    edges: EdgeWeights,
    part: FreePart,
    rest: Points,
    start: Points,
    turns: Float[np.ndarray, "n 4"],
    n_rounds: int,
) -> Points:
    """Make edges as rigid as possible by moving what is free, in rounds of local fits and a global solve.

    Rounds alone converge slowly where a long part bends, so each is followed by Anderson's step over the last ones
    (Peng and others 2018), which is taken back where the energy rose.

    Parameters
    ----------
    edges, part : EdgeWeights, FreePart
    rest : (n, 3) float
        Edges as they were.
    start : (n, 3) float
        Where vertices are held, and where the free ones begin.
    turns : (n, 4) float
        Unit quaternions near the rotations that are looked for.
    n_rounds : int
        At most.

    Returns
    -------
    (n, 3) float
    """
    if part.factor is None:
        return start
    links, turns = (edges.starts, edges.others, edges.weights), turns.copy()
    moved = start - rest
    pulled = part.pull[:, None] * moved[part.free]
    moved[part.free] = 0
    force, sums = pulled - part.rows @ moved, np.empty((len(part.free), 3))
    found, free = start.copy(), part.free
    least, tried, solved = np.inf, start[free], start[free]
    steps = deque[Step](maxlen=WINDOW + 1)
    scratch = part.factor.scratch()

    def settled(points: Float[np.ndarray, "u 3"]) -> float:
        found[free] = points
        away = part.pull @ np.square(points - start[free]).sum(axis=1)
        return float(fit_rotations(part.fitted, *links, rest, found, turns) + away)

    with one_blas_thread():
        for _ in range(n_rounds):
            energy = settled(tried)
            if energy > least:
                steps.clear()
                tried = solved
                energy = settled(tried)
            if least - energy <= SETTLED * energy and len(steps) > 1:
                break
            least = energy
            turned_edges(free, *links, rest, turns, sums)
            # Solved for displacements, so that nothing at all moves where nothing is turned or pulled.
            solved = rest[free] + part.factor.solve(sums + force, scratch)
            steps.append((solved - tried, solved))
            tried = _mixed(steps)
    found[free] = solved
    return found


def fitted_turns(edges: EdgeWeights, rest: Points, posed: Points) -> Float[np.ndarray, "n 3 3"]:
    """Return the rotation of each vertex that fits its edges best, by singular values, from no start."""
    one, two = np.repeat(np.arange(len(rest)), np.diff(edges.starts)), edges.others
    products = np.einsum(
        "e,ei,ej->eij", edges.weights, posed[two] - posed[one], rest[two] - rest[one]
    )
    return nearest_rotations(np.add.reduceat(products, edges.starts[:-1]))


def nearest_rotations(matrices: Float[np.ndarray, "k 3 3"]) -> Float[np.ndarray, "k 3 3"]:
    """Return the rotation next to each matrix."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return np.asarray(left @ right)


def _mixed(steps: Sequence[Step]) -> Points:
    """Return the combination of solutions whose combined change is least (Anderson 1965)."""
    changes = np.array([change.ravel() for change, _ in steps])
    differences = changes[-1] - changes[:-1]
    shares, *_ = np.linalg.lstsq(
        differences @ differences.T, differences @ changes[-1], rcond=1e-12
    )
    last = steps[-1][1]
    return last - sum(
        (share * (last - old) for share, (_, old) in zip(shares, steps, strict=False)), np.zeros(3)
    )
