"""Block Davidson: repeated Rayleigh-Ritz on approximate eigenvectors and their corrections."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.multilevel.residuals import (
    Interpolated,
    Stored,
    change_rows,
    images,
    map_groups,
    norms_of_residuals,
    pick_columns,
    residual_block,
)
from eigenshape.spectral.multilevel.vcycle import Tower, correct, multiply, smooth

WIDTH = 32  # columns that are corrected together
GRAM_COLUMNS = 96  # columns of a symmetric product that are computed together
SMOOTHING_STEPS = (8, 30)  # fewest and most smoothing steps
FIRST_STEPS = 2.0  # first smoothing steps, as a multiple of the root of the spread
DEPENDENT_COLUMNS = {
    4: 1e-6,
    8: 1e-13,
}  # share of the largest eigenvalue of a Gram matrix of unit columns, by bytes per number
# A k-th eigenvalue below this share of `Goal.least` counts as 0.
ZERO_SHARE = 1e-6
FIRST_SHARE = 0.3  # share of the work that is reported for the first smoothing
PROBES = 8  # random columns in the search for eigenvectors that were missed
# Steps of inverse iteration on these random columns.
PROBE_STEPS = 4
MOST_LEFT = 10.0  # largest estimate of the remaining error, as a multiple of the last decrease
# A column is not corrected if its residual is below this share of the bound.
EARLY = 0.5
# The same share of the accuracy, if there is no bound.
EXACT = 0.01
TOO_FAR = (
    "The weights of the operator spread too far for its diagonal: solve with method='certified'."
)
UNSEEN = 3.0  # factor of the estimated error as long as columns were only smoothed


@dataclass(frozen=True, eq=False)
class Space:
    """Approximate eigenvectors as columns S, and memory for as many columns to add."""

    columns: np.ndarray
    added: np.ndarray


@dataclass(frozen=True)
class Goal:
    """The required accuracy of the first k pairs, and the largest number of rounds.

    The estimated error of the values must be at most `accuracy`, and all residuals at most `bound`,
    both as shares of the k-th eigenvalue. If this eigenvalue is negligible beside `least`, it is
    replaced by `least`, since all k may be 0.
    """

    k: int
    accuracy: float
    bound: float
    least: float
    rounds: int
    strict: bool

    def scale(self, values: np.ndarray) -> float:
        """Return the k-th of some values, or `least` if it is negligible beside that."""
        last = float(values[self.k - 1])
        return last if last > ZERO_SHARE * self.least else self.least


@dataclass(frozen=True)
class Standing:
    """The state of the refinement.

    `scale` is the k-th value. `worst` is the largest residual and `left` the estimated error of the
    values, both as shares of it.
    """

    scale: float
    worst: float
    left: float


def refine(
    tower: Tower, below: tuple[np.ndarray, np.ndarray], goal: Goal, report: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Refine vectors until the goal is reached; return M-orthonormal Ritz vectors and values.

    Also returns the estimated error of the values. The vectors come from the next coarser level,
    which cannot improve them further. So they are smoothed first, and replaced by the Ritz vectors
    of their span. Each round then computes multilevel corrections (`correct`) and takes the lowest
    Ritz vectors in the span of columns and corrections (Davidson 1975; in blocks, without older
    columns).

    Raises
    ------
    ConvergenceError
        If a strict goal is not reached in the given rounds, or columns overflow or become
        dependent.
    """
    values, m = below[1], len(below[1])
    space = _prolong(tower, below[0])
    standing = _standing(goal, values, _smooth_all(tower, space, values, report), np.inf, np.inf)
    before, values = values, _ritz(tower, space, values, slice(0, m))
    first, looked = standing.worst, not goal.strict
    for done in range(goal.rounds + 1):
        residuals = norms_of_residuals(tower, space.columns, values)
        lowered = float(np.abs(before - values)[: goal.k].max())
        standing = _standing(
            goal, values, residuals, standing.worst, lowered if done else UNSEEN * lowered
        )
        bound, worst = min(goal.bound, np.sqrt(goal.accuracy)), standing.worst
        reached = standing.left <= goal.accuracy and worst <= goal.bound
        if reached and not looked:
            least = min(goal.accuracy, goal.bound) * standing.scale
            before, values = values, _look_again(tower, space, values, goal.k, least, done)
            looked = values is before
            if not looked:
                continue
        if reached or (done == goal.rounds and not goal.strict):
            return space.columns, values, standing.left
        way = float(np.log(first / worst) / np.log(first / bound)) if first > worst > bound else 0.0
        report(min(FIRST_SHARE + (1 - FIRST_SHARE) * way, 0.95))
        enough = EARLY * goal.bound if np.isfinite(goal.bound) else EXACT * goal.accuracy
        late = np.flatnonzero(residuals > enough * standing.scale)
        _add_corrections(tower, space, (values, residuals), late, max(worst / bound, 1.0))
        before, values = values, _ritz(tower, space, values, slice(m, m + len(late)))
    raise ConvergenceError(
        f"The error must be estimated at no more than {goal.accuracy:.1e} of the last eigenvalue, and no residual be "
        f"above {goal.bound:.1e}; after {goal.rounds} rounds these are {standing.left:.1e} and {standing.worst:.1e}. "
        f"Request less accuracy, or solve with method='certified'."
    )


def finish_vectors(
    tower: Tower, columns: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Ritz vectors and values of the columns in double precision."""
    columns = columns.astype(np.float64)
    return columns, _ritz(tower, Space(columns, columns[:, :0]), values, slice(0, len(values)))


def _standing(
    goal: Goal, values: np.ndarray, residuals: np.ndarray, before: float, lowered: float
) -> Standing:
    """Estimate the error after a round, from the decrease of the values and of the residuals.

    Errors of values behave like squares of residuals. If they decrease only as fast as the
    residuals, by a factor q per round, the remaining error is q / (1 - q) times the last decrease.
    The factor is limited to 10, so that rounding in the residuals does not dominate.
    """
    scale = goal.scale(values)
    worst = float(residuals[: goal.k].max()) / scale
    factor = worst / before if np.isfinite(before) and before > 0 else 1.0
    return Standing(scale, worst, lowered / scale * min(factor / max(1 - factor, 0.01), MOST_LEFT))


def _prolong(tower: Tower, vectors: np.ndarray) -> Space:
    # M and A of the level below are PᵀMP and PᵀAP: P keeps orthonormality and Ritz values.
    level, shape = tower.levels[0], (tower.levels[0].n, vectors.shape[1])
    columns, added = (np.empty(shape, dtype=level.prolong.dtype) for _ in range(2))
    return Space(multiply(level.prolong, vectors.astype(columns.dtype), columns), added)


def _smooth_all(
    tower: Tower, space: Space, values: np.ndarray, report: Callable[[float], None]
) -> Float[np.ndarray, " m"]:
    """Smooth the columns; return the norms of their residuals before."""
    steps, norms = (
        int(np.ceil(FIRST_STEPS * np.sqrt(tower.levels[0].spread))),
        np.empty(len(values)),
    )
    for start in range(0, len(values), WIDTH):
        report(FIRST_SHARE * start / len(values))
        some = np.arange(start, min(start + WIDTH, len(values)))
        block, norms[some] = residual_block(
            tower, pick_columns(tower, space.columns, some), values[some], np.ones(len(some))
        )
        corrections = smooth(tower, block, values[some].astype(np.float32), steps)
        _require_finite(corrections, some)
        space.columns[:, some[0] : some[-1] + 1] -= corrections
    return norms


def _add_corrections(
    tower: Tower,
    space: Space,
    state: tuple[np.ndarray, np.ndarray],
    late: np.ndarray,
    excess: float,
) -> None:
    """Add the corrections of the columns that have not converged, `late`.

    Raises
    ------
    ConvergenceError
        If corrections overflow.
    """
    steps = int(
        np.clip(
            np.ceil(0.5 * np.sqrt(tower.levels[0].spread) * np.log(8 * excess)), *SMOOTHING_STEPS
        )
    )
    values, residuals = state
    for start in range(0, len(late), WIDTH):
        some = late[start : start + WIDTH]
        block, _ = residual_block(
            tower, pick_columns(tower, space.columns, some), values[some], 1 / residuals[some]
        )
        corrections = correct(tower, block, values[some].astype(np.float32), steps)
        _require_finite(corrections, some)
        space.added[:, start : start + len(some)] = corrections


def _require_finite(corrections: np.ndarray, some: np.ndarray) -> None:
    # If rows are negligible beside θM, with θ far below zero, smoothing makes columns grow.
    if not np.isfinite(corrections.sum()):
        raise ConvergenceError(
            f"Corrections must be finite; those of eigenvector {some[0]} overflow. {TOO_FAR}"
        )


def _look_again(
    tower: Tower, space: Space, values: np.ndarray, k: int, bound: float, seed: int
) -> Float[np.ndarray, " m"]:
    """Search for eigenvectors that the coarser levels cannot represent.

    Inverse iteration is run on random columns, orthogonal to the known ones. If Rayleigh-Ritz with
    these columns lowers one of the first k values by half the bound or more, they are included and
    the new values are returned. Otherwise nothing changes.
    """
    m = len(values)
    block = _inverse_iteration(Stored(tower, space.columns), seed)
    space = Space(space.columns, block)
    lower, weights = _combination(tower, space, values, slice(m, m + PROBES))
    if (values[:k] - lower[:k] < 0.5 * bound).all():
        return values
    _combine(tower, space, weights)
    return lower


def misses_pairs(columns: Interpolated, values: np.ndarray, k: int, bound: float) -> bool:
    """Search for eigenvectors that the coarser levels cannot represent, as refinement does.

    Return whether random columns, after inverse iteration, lower one of the first k values by half
    the bound or more.
    """
    tower, m = columns.tower, len(values)
    block = _inverse_iteration(columns, 0)
    image, _ = residual_block(tower, block, np.zeros(PROBES), np.ones(PROBES))
    beside = columns.below.T @ columns.restrict(image)
    block = block.astype(np.float64)
    gram, projected = np.eye(m + PROBES), np.diag(np.append(values, np.zeros(PROBES)))
    gram[m:, m:] = block.T @ (tower.levels[0].weights * block)
    projected[:m, m:], projected[m:, :m] = beside, beside.T
    energies = block.T @ image
    projected[m:, m:] = (energies + energies.T) / 2
    lower, _ = _lowest_pairs(gram, projected, m, DEPENDENT_COLUMNS[image.itemsize])
    return bool((values[:k] - lower[:k] >= 0.5 * bound).any())


def _inverse_iteration(columns: Stored | Interpolated, seed: int) -> np.ndarray:
    """Return random columns after some steps of inverse iteration outside the span of others."""
    level = columns.tower.levels[0]
    shifts = np.zeros(PROBES, dtype=np.float32)
    block = np.random.default_rng(seed).standard_normal((level.n, PROBES), dtype=np.float32)
    for _ in range(PROBE_STEPS):
        block *= level.rough_scales[0] / np.abs(block).max(axis=0)
        block = correct(columns.tower, block, shifts, SMOOTHING_STEPS[0])
        columns.keep_outside(block)
    return block


def _ritz(tower: Tower, space: Space, values: np.ndarray, fresh: slice) -> np.ndarray:
    """Replace the columns by the lowest Ritz vectors of their span; return the Ritz values.

    The span includes the added columns up to the last fresh one. The columns before the fresh ones
    are already Ritz vectors, with the given values.
    """
    values, weights = _combination(tower, space, values, fresh)
    _combine(tower, space, weights)
    return values


def _combine(tower: Tower, space: Space, weights: np.ndarray) -> None:
    m, weights = space.columns.shape[1], weights.astype(space.columns.dtype)
    late = len(weights) - m

    def combine(rows: slice) -> None:
        part = space.columns[rows] @ weights[:m]
        if late:
            part += space.added[rows, :late].astype(part.dtype) @ weights[m:]
        space.columns[rows] = part

    change_rows(tower, combine)


def _combination(
    tower: Tower, space: Space, values: np.ndarray, fresh: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest Ritz values of the columns, and the coefficients of the Ritz vectors."""
    known = fresh.start
    gram, projected = _grams(tower, space, fresh)
    gram[:known, :known] = np.eye(known)
    projected[:known, :known] = np.diag(values[:known])
    dependent = DEPENDENT_COLUMNS[space.columns.dtype.itemsize]
    return _lowest_pairs(gram, projected, len(values), dependent)


def _lowest_pairs(
    gram: np.ndarray, projected: np.ndarray, m: int, dependent: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the m lowest Ritz values of columns S by SᵀMS and SᵀAS, and the coefficients.

    Axes of SᵀMS below the share `dependent` of the largest one are left out.
    """
    scales = 1 / np.sqrt(np.diagonal(gram))
    sizes, axes = np.linalg.eigh(gram * scales * scales[:, None])
    kept = sizes > dependent * sizes[-1]
    if np.count_nonzero(kept) < m:
        raise ConvergenceError(
            f"Smoothed eigenvectors must be independent; fewer than {m} are. {TOO_FAR}"
        )
    axes = (scales[:, None] * axes[:, kept]) / np.sqrt(sizes[kept])
    found, weights = np.linalg.eigh(axes.T @ projected @ axes)
    return np.array(found[:m]), axes @ weights[:, :m]


def _grams(tower: Tower, space: Space, fresh: slice) -> tuple[np.ndarray, np.ndarray]:
    """Return SᵀMS and SᵀAS, except the block of the columns before the fresh ones.

    MS and AS are computed in double precision. The products with S are in the precision of the
    columns and are summed in double precision: single precision takes half the time.
    """
    size, m = fresh.stop, space.columns.shape[1]
    whole, precision = fresh.start == 0, space.columns.dtype
    of = space.columns if whole else space.added[:, : size - m]

    def sum_rows(chunks: list[slice]) -> np.ndarray:
        grams = np.zeros((2, size, of.shape[1]))
        for rows, image, weighed in images(tower, of, chunks):
            found = [part.astype(precision, copy=False) for part in (weighed, image)]
            for gram, part in zip(grams, found, strict=True):
                if whole:  # the rest follows from symmetry
                    for start in range(0, size, GRAM_COLUMNS):
                        end = min(start + GRAM_COLUMNS, size)
                        gram[:end, start:end] += of[rows, :end].T @ part[:, start:end]
                else:
                    gram[:m] += space.columns[rows].T @ part
                    gram[m:] += of[rows].T @ part
        return grams

    squares = np.zeros((2, size, size))
    squares[:, :, fresh] = sum(map_groups(tower, sum_rows))
    for square in squares:
        if whole:
            square[:] = np.triu(square) + np.triu(square, 1).T
        square[fresh, : fresh.start] = square[: fresh.start, fresh].T
        square[fresh, fresh] = (square[fresh, fresh] + square[fresh, fresh].T) / 2
    return squares[0], squares[1]
