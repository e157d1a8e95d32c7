"""As-rigid-as-possible deformation: local fits of rotations and global solves, alternating."""

from collections import deque
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.sparse.symmetric_factor import SymmetricFactor
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import nearest_rotations
from eigenshape.deformation.rigidity_loops import fit_rotations, turn_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

Points = Float[np.ndarray, "n 3"]
Step = tuple[Points, Points]  # change of the free vertices in a round, and their new places
# Earlier rounds that Anderson's step combines. Chosen on coarser versions of the scenes of
# experiments/ch6_deformation.
WINDOW = 4
# A round that lowers the energy by less than this share is the last. A smaller value takes more
# rounds.
ENERGY_TOLERANCE = 1e-4
# Least weight of an edge, as a share of the mean absolute weight. Edges whose cotangents sum to
# zero or less keep a small stiffness.
LEAST_WEIGHT = 1e-3
# Relative cut-off of singular values in Anderson's step: changes of two rounds that are parallel up
# to rounding count once.
PARALLEL_CHANGES = 1e-12


@record
class EdgeWeights(ReadOnly):
    """Weights w of the edges in the rigidity energy (Sorkine and Alexa 2007).

    The energy of a pose x' of the shape x is Σ_ij w_ij |R_i (x_i - x_j) - (x'_i - x'_j)|² / 2.

    Attributes
    ----------
    matrix : (n, n) sparse
        Diagonal matrix of the row sums of w, minus w.
    starts : (n + 1,) int
        The edges of vertex i have the numbers starts[i] to starts[i + 1] - 1.
    others : (e,) int
        Other end of each edge.
    weights : (e,) float
        Weight of each edge.
    """

    matrix: sp.csr_array
    starts: Int[np.ndarray, " n1"]
    others: Int[np.ndarray, " e"]
    weights: Float[np.ndarray, " e"]


@record
class FreePart(ReadOnly):
    """The free vertices and their equations.

    Attributes
    ----------
    free : (u,) int
        The free vertices.
    fitted : (a,) int
        The vertices that are free or have a free neighbor. Only their rotations matter.
    rows : (u, n) sparse
        The rows of the matrix of `EdgeWeights` for the free vertices.
    pull : (u,) float
        h in the additional energy h |x' - g|² of a free vertex, g being its start.
    factor : SymmetricFactor or None
        Factor of the columns of `rows` for the free vertices plus h; None if no vertex is free.
    """

    free: Int[np.ndarray, " u"]
    fitted: Int[np.ndarray, " a"]
    rows: sp.csr_array
    pull: Float[np.ndarray, " u"]
    factor: SymmetricFactor | None


def edge_weights(mesh: TriangleMesh, stiffness: sp.csr_array) -> EdgeWeights:
    """Return the weights of all edges of a mesh, none below a thousandth of their mean size.

    The weights are those of the cotangent stiffness matrix. With negative weights, the energy could
    become negative while a vertex turns over.
    """
    # Where the cotangents of an edge sum to zero, rounding decides whether the matrix has an entry.
    # So the edges of the faces are added with weight 0: sums of duplicates keep explicit zeros.
    one, two = edge_table(mesh).edges.T
    entries = stiffness.tocoo()
    aside = entries.row != entries.col
    rows = np.concatenate([entries.row[aside], one, two])
    columns = np.concatenate([entries.col[aside], two, one])
    values = np.concatenate([-entries.data[aside], np.zeros(2 * len(one))])
    links = sp.csr_array((values, (rows, columns)), shape=stiffness.shape)
    links.sort_indices()
    links.data = np.maximum(links.data, LEAST_WEIGHT * np.abs(links.data).mean())
    matrix = (sp.diags_array(links.sum(axis=1)) - links).tocsr()
    return EdgeWeights(
        matrix, links.indptr.astype(np.int64), links.indices.astype(np.int64), links.data
    )


def free_part(edges: EdgeWeights, fixed: Bool[np.ndarray, " n"]) -> FreePart:
    """Factor the equations of the free vertices, without a pull to their start.

    Raise InvalidParameterError if a component has no fixed vertex, and InvalidShapeError if the
    equations are not positive definite.
    """
    require_fixed_vertices(edges, fixed)
    free = np.flatnonzero(~fixed)
    rows = edges.matrix[free]
    fitted = np.unique(np.concatenate([free, rows.indices])).astype(np.int64)
    factor = factor_equations(rows[:, free]) if len(free) else None
    return FreePart(free, fitted, rows, np.zeros(len(free)), factor)


def pull_part(part: FreePart, pull: Float[np.ndarray, " n"]) -> FreePart:
    """Return the same free vertices, pulled to their start; the order of elimination stays."""
    if part.factor is None:
        return part
    strength = pull[part.free]
    square = (part.rows[:, part.free] + sp.diags_array(strength)).tocsr()
    return replace(part, pull=strength, factor=factor_equations(square, part.factor))


def spread_harmonically(
    part: FreePart, values: Float[np.ndarray, "n k"]
) -> Float[np.ndarray, "n k"]:
    """Return the values with those of free vertices replaced by harmonic ones; no pull counts."""
    spread = values.copy()
    if part.factor is not None:
        spread[part.free] = 0
        spread[part.free] = -part.factor.solve(part.rows @ spread)
    return spread


def require_fixed_vertices(edges: EdgeWeights, fixed: Bool[np.ndarray, " n"]) -> None:
    """Raise an error if a component has no fixed vertex."""
    n_components, component = connected_components(edges.matrix, directed=False)
    loose = np.flatnonzero(np.bincount(component[fixed], minlength=n_components) == 0)
    if loose.size:
        vertex = int(np.flatnonzero(component == loose[0])[0])
        raise InvalidParameterError(
            "Each component must have a vertex that is fixed or in a region; "
            f"the component of vertex {vertex} has none ({loose.size} such). Add one to fixed."
        )


def factor_equations(
    square: sp.csr_array, similar: SymmetricFactor | None = None
) -> SymmetricFactor:
    """Factor the equations of the free vertices, in the order of a factor of the same pattern.

    Raise InvalidShapeError if they are not positive definite.
    """
    factor = SymmetricFactor.of(square, similar)
    if factor is None or not (factor.pivots > 0).all():
        raise InvalidShapeError(
            "Every triangle must have angles well above zero to be bent; the equations of the "
            f"{square.shape[0]} free vertices are not positive definite. "
            'Try repair(mesh, ["collapse_needles"]).'
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
    """Move the free vertices so that edges are as rigid as possible.

    Each round fits the rotations of vertices and solves for their places. Rounds alone converge
    slowly on long parts, so each is followed by Anderson's step over the last rounds (Peng and
    others 2018). A step that raises the energy is taken back.

    Parameters
    ----------
    edges : EdgeWeights
    part : FreePart
    rest : (n, 3) float
        Vertices of the undeformed shape.
    start : (n, 3) float
        Places of the fixed vertices, and starts of the free ones.
    turns : (n, 4) float
        Unit quaternions from which the fits of rotations start.
    n_rounds : int
        Largest number of rounds.

    Returns
    -------
    (n, 3) float
        The vertices of the deformed shape.
    """
    if part.factor is None:
        return start
    free, links = part.free, (edges.starts, edges.others, edges.weights)
    turns, found, sums = turns.copy(), start.copy(), np.empty((len(free), 3))
    # The constant part of the right-hand side: the pull, and the displacements of fixed vertices.
    displacement = start - rest
    pull = part.pull[:, None] * displacement[free]
    displacement[free] = 0
    force = pull - part.rows @ displacement
    least, tried, solved = np.inf, start[free], start[free]
    steps = deque[Step](maxlen=WINDOW + 1)
    scratch = part.factor.scratch()

    def fit_at(points: Float[np.ndarray, "u 3"]) -> float:
        """Fit the rotations to some places of the free vertices, and return the energy."""
        found[free] = points
        pull_energy = part.pull @ np.square(points - start[free]).sum(axis=1)
        return float(fit_rotations(part.fitted, *links, rest, found, turns) + pull_energy)

    with one_blas_thread():
        for _ in range(n_rounds):
            energy = fit_at(tried)
            if energy > least:
                # Anderson's step raised the energy: go back to the plain solution.
                steps.clear()
                tried = solved
                energy = fit_at(tried)
            if least - energy <= ENERGY_TOLERANCE * energy and len(steps) > 1:
                break
            least = energy
            turn_edges(free, *links, rest, turns, sums)
            # Solved for displacements, so that vertices without rotation or pull do not move.
            solved = rest[free] + part.factor.solve(sums + force, scratch)
            steps.append((solved - tried, solved))
            # The combination of solutions whose combined change is smallest (Anderson 1965)
            changes = np.array([change.ravel() for change, _ in steps])
            differences = changes[-1] - changes[:-1]
            gram, right = differences @ differences.T, differences @ changes[-1]
            shares, *_ = np.linalg.lstsq(gram, right, rcond=PARALLEL_CHANGES)
            last = steps[-1][1]
            pairs = zip(shares, steps, strict=False)
            tried = last - sum(share * (last - old) for share, (_, old) in pairs)
    found[free] = solved
    return found


def fit_turns(edges: EdgeWeights, rest: Points, posed: Points) -> Float[np.ndarray, "n 3 3"]:
    """Return the rotation of each vertex that fits its edges best, by singular values."""
    one, two = np.repeat(np.arange(len(rest)), np.diff(edges.starts)), edges.others
    products = np.einsum(
        "e,ei,ej->eij", edges.weights, posed[two] - posed[one], rest[two] - rest[one]
    )
    return nearest_rotations(np.add.reduceat(products, edges.starts[:-1]))
