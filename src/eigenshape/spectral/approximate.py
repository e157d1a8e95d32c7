"""The lowest eigenpairs of a Laplacian, roughly but at once: no factor of the whole operator, and no proof."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import SupportsIndex

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.csgraph import reverse_cuthill_mckee
from threadpoolctl import threadpool_limits

from eigenshape._arrays import whole_number
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.certify import require_orthonormal
from eigenshape.spectral.correction import Coarsest, Tower
from eigenshape.spectral.device import Device, fetch, open_device, put
from eigenshape.spectral.hierarchy import Level, build_levels, load
from eigenshape.spectral.outcome import Progress, require_room, silent, spectrum_of
from eigenshape.spectral.pairs import Pairs
from eigenshape.spectral.pencil import Pencil, as_pencil, normalise, residual_norms
from eigenshape.spectral.refinement import WIDTH, Goal, refine, settled
from eigenshape.spectral.roads import proved
from eigenshape.spectral.shift import factorise_near
from eigenshape.spectral.spectrum import Spectrum

ACCURACIES = (1e-10, 0.1)
SMALL = 600  # points up to which the exact solve is the quicker one
GUARDS = 8  # more pairs than asked for, at least, and in all a multiple of it
GUARD_SHARE = 1.125
COARSEST = 3000  # points of the coarsest level, at least; and times k:
COARSEST_PER_PAIR = 30
COARSENED = 8  # times, at least
SHIFTS = (0.2, 0.5, 0.75, 0.93)  # of the k-th eigenvalue
ROUNDS = 100
SINGLE = 1e-4  # accuracy from which vectors are kept in single precision while they are refined
INNER_ACCURACY = 0.03  # on levels between, within so many rounds
INNER_ROUNDS = 3


def approximate_spectrum(
    laplacian: Laplacian,
    k: SupportsIndex,
    *,
    accuracy: float = 1e-3,
    bound: float | None = None,
    device: str = "cpu",
    progress: Progress | None = None,
) -> Spectrum:
    """Compute approximations of the k lowest eigenpairs of W φ = λ B φ, without a factor of W - σB and without proof.

    Points are joined into aggregates, whose indicators are smoothed (Vaněk, Mandel and Brezina 1996), until an
    operator of some thousand points is left. That one is solved exactly. On the way back its eigenvectors are smoothed
    level by level, and where that is not enough refined by Rayleigh-Ritz among them and their corrections through all
    coarser levels (block Davidson), in the spirit of Nasikun and Hildebrandt (2022). Some more pairs than asked for
    are refined along, so that copies of a multiple eigenvalue find their place; but no count tells whether one is
    missing.

    Parameters
    ----------
    laplacian : Laplacian
        W positive semidefinite and B diagonal.
    k : int
        Number of eigenpairs, 1 to n.
    accuracy : float
        Error of the eigenvalues relative to the k-th, judged by how far the last round lowered them and their
        residuals; 1e-10 to 0.1. The estimate is told in `certificate.estimate`.
    bound : float, optional
        Go on until every residual, relative to the k-th eigenvalue, is at most this too. It bounds the error for
        certain, and is far larger than the error: that goes with its square.
    device : "cpu" or "gpu"
        Where the largest products are computed. "gpu" takes CuPy (`pip install eigenshape[gpu]`).
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.

    Returns
    -------
    Spectrum
        Ascending eigenvalues in 1/length². Each is within its residual of an eigenvalue of the operator (where the
        kernel is corrected: each corrected). `certificate.count` is None and `certificate.complete` False: nothing was
        counted. Operators of few points, or of few for k, are solved and certified as by `solve_spectrum`.

    Raises
    ------
    InvalidParameterError
        If k is not in 1..n, the accuracy out of range, the device unknown, B not diagonal, W seen to have a negative
        eigenvalue, a corrected eigenvalue 1/t or more, or the memory too small.
    ConvergenceError
        If the residuals do not come down to the accuracy.

    Warns
    -----
    UserWarning
        If there is no GPU to be used, or eigenvalues of a kernel lie too near to 1/t to tell those of the shape.
    """
    wanted = whole_number(k, "k", 1, laplacian.n_points)
    for name, value in (("accuracy", accuracy), ("bound", ACCURACIES[1] if bound is None else bound)):
        if not ACCURACIES[0] <= value <= ACCURACIES[1]:
            raise InvalidParameterError(f"{name} must lie in {ACCURACIES[0]}..{ACCURACIES[1]}; it is {value}.")
    place, report = open_device(device), progress or silent
    _require_lumped(laplacian)
    with threadpool_limits(1, user_api="blas"):
        report(0.0, "scaling the operator")
        pencil = normalise(laplacian)
        limits = float(accuracy), np.inf if bound is None else float(bound)
        goal = Goal(wanted, *limits, pencil.level / pencil.n, ROUNDS, strict=True)
        pairs, certificate = _approximated(pencil, goal, place, report)
    report(1.0, "proved complete" if certificate.complete else "accurate enough")
    return spectrum_of(laplacian, pencil, pairs, certificate)


def _require_lumped(laplacian: Laplacian) -> None:
    rows = laplacian.mass.tocoo()
    beside = np.flatnonzero((rows.row != rows.col) & (rows.data != 0))
    if beside.size:
        raise InvalidParameterError(
            f"mass must be diagonal here; entry ({rows.row[beside[0]]}, {rows.col[beside[0]]}) is "
            f"{rows.data[beside[0]]:.6g}. Lump the mass, or take solve_spectrum."
        )


def _approximated(pencil: Pencil, goal: Goal, device: Device, report: Progress) -> tuple[Pairs, Certificate]:
    n, m = pencil.n, -(-max(goal.k + GUARDS, int(GUARD_SHARE * goal.k)) // GUARDS) * GUARDS
    if n <= max(SMALL, COARSENED * m):
        return proved(pencil, goal.k, report)
    _require_room(pencil, goal.k, m)
    report(0.01, "making coarser levels")
    order = reverse_cuthill_mckee(sp.csr_matrix(pencil.stiffness), symmetric_mode=True)
    stiffness, mass = (sp.csr_array(sp.csr_array(part)[order][:, order]) for part in (pencil.stiffness, pencil.mass))
    start = _coarsened(stiffness, mass, goal.k, m)
    if start is None:  # no two points are coupled
        return proved(pencil, goal.k, report)
    vectors = np.empty((n, goal.k))
    vectors[order], values, estimate = _climbed(*start, goal, device, report)
    pairs = Pairs(values, vectors, residual_norms(pencil, values, vectors))
    return pairs, replace(_uncounted(pencil, pairs), estimate=estimate)


def _require_room(pencil: Pencil, k: int, m: int) -> None:
    entries = pencil.stiffness.nnz
    parts = {"bases": 8 * pencil.n * (4 * m + 3 * k) + 20 * pencil.n * WIDTH, "levels of their operator": 100 * entries}
    require_room(f"{k} pairs of {pencil.n} points", parts, "Ask for fewer pairs")


def _coarsened(
    stiffness: sp.csr_array, mass: sp.csr_array, k: int, m: int
) -> tuple[list[Level], Coarsest, Float[np.ndarray, " m"]] | None:
    """Return the levels with the solved coarsest one, and its values; None where nothing can be joined."""
    n_coarsest = min(max(COARSEST_PER_PAIR * k, COARSEST), stiffness.shape[0] // COARSENED)
    levels = build_levels(stiffness, mass, n_coarsest)
    if len(levels) == 1:
        return None
    with suppress(ConvergenceError, InvalidParameterError):
        return levels, *_solved_coarsest(levels[-1], k, m)
    levels = build_levels(stiffness, mass, n_coarsest, smooth=False)  # weights over many decades
    return levels, *_solved_coarsest(levels[-1], k, m)


def _climbed(
    levels: list[Level],
    coarsest: Coarsest,
    values: Float[np.ndarray, " m"],
    goal: Goal,
    device: Device,
    report: Progress,
) -> tuple[Float[np.ndarray, "n k"], Float[np.ndarray, " k"], float]:
    """Return the lowest eigenvectors of the first level, their values, and an estimate of these' error."""
    dtype = np.float32 if goal.accuracy >= SINGLE and np.isinf(goal.bound) else np.float64
    loaded = [load(device, level, dtype, lumped=place == 0) for place, level in enumerate(levels[:-1])]
    vectors, estimate = put(device, coarsest.vectors), np.inf
    for place in reversed(range(len(loaded))):
        tower = Tower(device, tuple(loaded[place:]), coarsest)
        inner = replace(goal, accuracy=np.inf, bound=INNER_ACCURACY, rounds=INNER_ROUNDS, strict=False)
        here, report_here = inner if place else goal, _in_level(report, place, len(loaded))
        vectors, values, estimate = refine(tower, (vectors, values), here, report_here)
    vectors, values = settled(tower, vectors[:, : goal.k], values[: goal.k])
    return fetch(device, vectors), values, estimate


def _in_level(report: Progress, place: int, n_levels: int) -> Callable[[float], None]:
    start, share = (0.35, 0.6) if place == 0 else (0.35 - 0.15 * place / n_levels, 0.15 / n_levels)
    return lambda done: report(start + share * done, f"refining on level {n_levels - place} of {n_levels}")


def _solved_coarsest(level: Level, k: int, m: int) -> tuple[Coarsest, Float[np.ndarray, " m"]]:
    pencil = as_pencil(level.stiffness, level.mass)
    pairs, _ = proved(pencil, m, silent)
    last = max(float(pairs.values[k - 1]), pencil.level / pencil.n)  # where all that is wanted is 0
    factors = tuple(factorise_near(pencil, share * last) for share in SHIFTS)
    return Coarsest(pencil, pairs.vectors, factors), pairs.values


def _uncounted(pencil: Pencil, pairs: Pairs) -> Certificate:
    return Certificate(
        n_pairs=len(pairs.values),
        shift=np.inf,
        count=None,
        n_found=len(pairs.values),
        gap=(float(pairs.values[-1]), np.inf),
        resolution=float(pairs.residuals.max()),
        orthonormality=require_orthonormal(pencil, pairs.vectors),
        max_residual=float(pairs.residuals.max() / max(float(np.abs(pairs.values).max()), pencil.level / pencil.n)),
        n_split=0,
    )
