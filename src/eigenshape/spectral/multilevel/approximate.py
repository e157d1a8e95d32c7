"""Approximate lowest eigenpairs of a pencil, without a factor of the operator or a proof."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import reverse_cuthill_mckee

import certeig
from certeig.kit.arrays import record
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.progress import Progress, silent
from certeig.solver.certify import require_orthonormal
from certeig.solver.eigenpairs import Pairs
from certeig.solver.pencil import Pencil
from certeig.solver.shift import factorize_near
from certeig.solver.strategy import solve_lowest
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.multilevel.aggregation import build_levels
from eigenshape.spectral.multilevel.davidson import WIDTH, Goal, finish_vectors, refine
from eigenshape.spectral.multilevel.vcycle import Coarsest, Tower
from eigenshape.spectral.pencils import ADVICE

# Points up to which this method took 1.06 to 1.5 times the time of the certified one, for operators
# of fewer entries a row: with as many that one factors nothing either.
CERTIFIED_POINTS, MANY_ENTRIES = 100_000, 100
# Points up to which a heat signature is that of certified pairs.
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
MOST_ROUNDS = 100
# Accuracy from which vectors are refined in single precision.
SINGLE = 1e-4
# Largest `accuracy` that can be requested.
LEAST_ACCURATE = 0.1
# Residual at which refinement on levels in between stops,
INNER_ACCURACY = 0.03
# or the rounds after which it does.
INNER_ROUNDS = 3


@record
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
    fallbacks : tuple of str
        As in `Certificate`.
    """

    order: Int[np.ndarray, " n"]
    tower: Tower
    below: tuple[np.ndarray, np.ndarray]
    fallbacks: tuple[str, ...]


def approximate_pairs(
    pencil: Pencil, k: int, accuracy: float, max_residual: float, report: Progress
) -> tuple[Pairs, certeig.Certificate]:
    """Compute approximations of the k lowest pairs of a pencil with diagonal mass.

    Smoothed aggregation (Vaněk, Mandel and Brezina 1996) coarsens the operator to some thousand
    points, where it is solved exactly. The eigenvectors are then interpolated and smoothed level by
    level. If that is not accurate enough, they are refined by block Davidson: Rayleigh-Ritz on the
    eigenvectors and their multilevel corrections, similar to Nasikun and Hildebrandt (2022). Some
    more pairs than requested are refined too, so that all copies of a multiple eigenvalue are
    found. No count proves that none is missing. Sparse pencils of up to 100,000 points, and those with
    few points for k, are solved and certified instead.

    Raises an InvalidParameterError if the memory is too small, and a ConvergenceError if the
    residuals do not reach the accuracy.
    """
    is_sparse = pencil.stiffness.nnz < MANY_ENTRIES * pencil.n
    start = None
    if pencil.n > CERTIFIED_POINTS or not is_sparse:
        dtype = np.float32 if accuracy >= SINGLE and np.isinf(max_residual) else np.float64
        start = climb(pencil, k, report, dtype=dtype, kept=16 * pencil.n * k)
    if start is None:
        return solve_lowest(pencil, k, report)
    least = pencil.level / pencil.n
    goal = Goal(k, accuracy, max_residual, least, MOST_ROUNDS, strict=True)
    on_finest = on_level(report, 0, len(start.tower.levels))
    columns, values, estimate = refine(start.tower, start.below, goal, on_finest)
    columns, values = finish_vectors(start.tower, columns[:, :k], values[:k])
    vectors = np.empty((pencil.n, k))
    vectors[start.order] = columns

    pairs = Pairs(values, vectors, pencil.residual_norms(values, vectors))
    worst, last = float(pairs.residuals.max()), float(values[-1])
    return pairs, Certificate(
        n_pairs=k,
        shift=np.inf,
        count=None,
        n_found=k,
        gap=(last, np.inf),
        resolution=worst,
        orthonormality=require_orthonormal(pencil, pairs),
        max_residual=float(worst / max(float(np.abs(values).max()), least)),
        n_split=0,
        estimate=estimate,
        fallbacks=start.fallbacks,
    )


def climb(
    pencil: Pencil, k: int, report: Progress, *, dtype: type = np.float32, kept: int = 0
) -> Start | None:
    """Coarsen a pencil with diagonal mass, solve the coarsest level, and refine up to the second.

    Some more pairs than k are computed, with vectors of type `dtype`. `kept` is the number of bytes
    that the caller needs besides these bases. Returns None if the pencil has too few points to gain
    from coarsening, or if no points can be aggregated.

    Raises an InvalidParameterError if the memory is too small.
    """
    m = -(-max(k + GUARDS, int(GUARD_SHARE * k)) // GUARDS) * GUARDS
    if pencil.n <= max(EXACT_POINTS, COARSENED * m):
        return None
    bases = pencil.n * (2 * np.dtype(dtype).itemsize * m + 20 * WIDTH)
    parts = {"bases": bases + kept, "levels of their operator": 100 * pencil.stiffness.nnz}
    require_memory("A spectrum", f"{k} pairs of {pencil.n} points", parts, "Request fewer pairs.")
    report(0.01, "making coarser levels")
    order = reverse_cuthill_mckee(sp.csr_matrix(pencil.stiffness), symmetric_mode=True)
    n_coarsest = min(max(COARSEST_PER_PAIR * k, COARSEST), pencil.n // COARSENED)
    fallbacks: tuple[str, ...] = ()
    for smooth in (True, False):
        stiffness, mass = _reorder(pencil.stiffness, order), _reorder(pencil.mass, order)
        levels, stiffness, mass = build_levels(stiffness, mass, n_coarsest, dtype, smooth=smooth)
        if not levels:
            return None
        try:
            coarsest, values = _solve_coarsest(stiffness, mass, k, m)
        except (ConvergenceError, InvalidParameterError) as error:
            if not smooth:
                raise
            # Only indicators stay independent if weights differ by many orders of magnitude.
            fallbacks = (f"smoothed aggregates: {error}",)
        else:
            break

    goal = Goal(k, np.inf, INNER_ACCURACY, pencil.level / pencil.n, INNER_ROUNDS, strict=False)
    vectors = coarsest.vectors
    for place in range(len(levels) - 1, 0, -1):
        tower = Tower(tuple(levels[place:]), coarsest)
        progress = on_level(report, place, len(levels))
        vectors, values, _ = refine(tower, (vectors, values), goal, progress)
    return Start(order, Tower(tuple(levels), coarsest), (vectors, values), fallbacks)


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


def on_level(report: Progress, place: int, n_levels: int) -> Callable[[float], None]:
    """Return a function that reports how much of the refinement on a level is done; 0 is the finest."""
    share = 0.15 / n_levels if place else 0.6
    message = f"refining on level {n_levels - place} of {n_levels}"
    return lambda done: report(0.35 + share * (done - place), message)


def _reorder(matrix: sp.sparray, order: Int[np.ndarray, " n"]) -> sp.csr_array:
    return sp.csr_array(sp.csr_array(matrix)[order][:, order])


def _solve_coarsest(
    stiffness: sp.csr_array, mass: sp.csr_array, k: int, m: int
) -> tuple[Coarsest, Float[np.ndarray, " m"]]:
    pencil = Pencil.unscaled(stiffness, mass, ADVICE)
    pairs, _ = solve_lowest(pencil, m, silent)
    # The mean eigenvalue if all wanted ones are 0.
    last = max(float(pairs.values[k - 1]), pencil.level / pencil.n)
    factors = tuple(factorize_near(pencil, share * last) for share in SHIFTS)
    return Coarsest(pencil, pairs.vectors, factors), pairs.values
