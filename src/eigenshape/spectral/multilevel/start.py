"""Coarsen an operator, solve the coarsest level, and refine the vectors up to the second level."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import reverse_cuthill_mckee

from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape._memory import require_memory
from eigenshape._progress import Progress, silent
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.multilevel.aggregation import Level, build_levels, load
from eigenshape.spectral.multilevel.davidson import WIDTH, Goal, refine
from eigenshape.spectral.multilevel.vcycle import Coarsest, Tower
from eigenshape.spectral.solver.pencil import Pencil, as_pencil
from eigenshape.spectral.solver.shift import factorize_near
from eigenshape.spectral.solver.strategy import solve_lowest

# Points up to which the exact solve is faster.
EXACT_POINTS = 600
# Pairs refined beyond the k requested: at least these, a multiple of them in all,
GUARDS = 8
# and at least this multiple of k, so that copies of a multiple eigenvalue are found.
GUARD_SHARE = 1.125
# Points of the coarsest level: at least these,
COARSEST = 3000
# and this many times k. More make the exact solve slow, fewer the refinement.
COARSEST_PER_PAIR = 30
# Factor at least between the points of the operator and those of the coarsest level.
COARSENED = 8
# Shifts of the factors of the coarsest level, as shares of the k-th eigenvalue.
SHIFTS = (0.2, 0.5, 0.75, 0.93)
# Rounds of refinement after which an error is raised.
ROUNDS = 100
# Accuracy from which vectors are refined in single precision.
SINGLE = 1e-4
# Largest `accuracy` that can be requested.
LEAST_ACCURATE = 0.1
# Residual at which refinement on levels in between stops,
INNER_ACCURACY = 0.03
# or the rounds after which it does.
INNER_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Start:
    """Where the refinement of an operator's eigenvectors starts.

    Attributes
    ----------
    order : (n,) int
        The order of the points on the finest level.
    tower : Tower
        All levels.
    below : (m, g) float, (g,) float
        Eigenvectors and eigenvalues on the second level.
    """

    order: Int[np.ndarray, " n"]
    tower: Tower
    below: tuple[np.ndarray, np.ndarray]


def climb(
    pencil: Pencil, k: int, report: Progress, *, dtype: type = np.float32, kept: int = 0
) -> Start | None:
    """Coarsen a pencil with diagonal mass, solve the coarsest level, and refine up to the second.

    Some more pairs than k are computed, with vectors of type `dtype`. `kept` is the number of bytes
    that the caller needs besides these bases. Returns None if the pencil has too few points to gain
    from coarsening, or if no points can be aggregated.

    Raises
    ------
    InvalidParameterError
        If the memory is too small.
    """
    m = -(-max(k + GUARDS, int(GUARD_SHARE * k)) // GUARDS) * GUARDS
    if pencil.n <= max(EXACT_POINTS, COARSENED * m):
        return None
    bases = pencil.n * (2 * np.dtype(dtype).itemsize * m + 20 * WIDTH)
    parts = {"bases": bases + kept, "levels of their operator": 100 * pencil.stiffness.nnz}
    require_memory("A spectrum", f"{k} pairs of {pencil.n} points", parts, "Request fewer pairs.")
    report(0.01, "making coarser levels")
    order = reverse_cuthill_mckee(sp.csr_matrix(pencil.stiffness), symmetric_mode=True)
    coarsened = _coarsen(_reorder(pencil.stiffness, order), _reorder(pencil.mass, order), k, m)
    if coarsened is None:
        return None
    levels, coarsest, values = coarsened
    loaded = [load(level, dtype, lumped=place == 0) for place, level in enumerate(levels[:-1])]
    goal = Goal(k, np.inf, INNER_ACCURACY, pencil.level / pencil.n, INNER_ROUNDS, strict=False)
    vectors = coarsest.vectors
    for place in range(len(loaded) - 1, 0, -1):
        tower = Tower(tuple(loaded[place:]), coarsest)
        vectors, values, _ = refine(
            tower, (vectors, values), goal, _in_level(report, place, len(loaded))
        )
    return Start(order, Tower(tuple(loaded), coarsest), (vectors, values))


def require_lumped(laplacian: Laplacian) -> None:
    """Raise an error that names the first entry of a mass off the diagonal, if there is one."""
    rows = laplacian.mass.tocoo()
    beside = np.flatnonzero((rows.row != rows.col) & (rows.data != 0))
    if beside.size:
        first = beside[0]
        raise InvalidParameterError(
            f"mass must be diagonal for approximate eigenpairs; entry ({rows.row[first]}, "
            f"{rows.col[first]}) is {rows.data[first]:.6g}. "
            f"Build the operator with a lumped mass, or solve with method='certified'."
        )


def require_accuracy(name: str, value: float, least: float) -> None:
    """Raise an error if an accuracy is out of range."""
    if not least <= value <= LEAST_ACCURATE:
        raise InvalidParameterError(f"{name} must lie in {least}..{LEAST_ACCURATE}; it is {value}.")


def on_finest(report: Progress, start: Start) -> Callable[[float], None]:
    """Return a function that reports how much of the refinement on the finest level is done."""
    n_levels = len(start.tower.levels)
    return lambda done: report(0.35 + 0.6 * done, f"refining on level {n_levels} of {n_levels}")


def _reorder(matrix: sp.sparray, order: Int[np.ndarray, " n"]) -> sp.csr_array:
    return sp.csr_array(sp.csr_array(matrix)[order][:, order])


def _coarsen(
    stiffness: sp.csr_array, mass: sp.csr_array, k: int, m: int
) -> tuple[list[Level], Coarsest, Float[np.ndarray, " m"]] | None:
    """Return the levels, the coarsest one solved, and its values; None without aggregates."""
    n_coarsest = min(max(COARSEST_PER_PAIR * k, COARSEST), stiffness.shape[0] // COARSENED)
    levels = build_levels(stiffness, mass, n_coarsest)
    if len(levels) == 1:
        return None
    with suppress(ConvergenceError, InvalidParameterError):
        return levels, *_solve_coarsest(levels[-1], k, m)
    levels = build_levels(
        stiffness, mass, n_coarsest, smooth=False
    )  # only indicators stay independent if weights differ by many orders of magnitude
    return levels, *_solve_coarsest(levels[-1], k, m)


def _solve_coarsest(level: Level, k: int, m: int) -> tuple[Coarsest, Float[np.ndarray, " m"]]:
    pencil = as_pencil(level.stiffness, level.mass)
    pairs, _ = solve_lowest(pencil, m, silent)
    last = max(
        float(pairs.values[k - 1]), pencil.level / pencil.n
    )  # the mean eigenvalue if all wanted ones are 0
    factors = tuple(factorize_near(pencil, share * last) for share in SHIFTS)
    return Coarsest(pencil, pairs.vectors, factors), pairs.values


def _in_level(report: Progress, place: int, n_levels: int) -> Callable[[float], None]:
    share = 0.15 / n_levels
    return lambda done: report(
        0.35 + share * (done - place), f"refining on level {n_levels - place} of {n_levels}"
    )
