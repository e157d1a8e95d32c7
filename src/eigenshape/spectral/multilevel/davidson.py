"""Block Davidson: Rayleigh-Ritz among approximate eigenvectors and their corrections, until what is left is small."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.multilevel.residuals import (
    images,
    keep_outside,
    norms_of_residuals,
    pick_columns,
    residual_block,
    row_chunks,
)
from eigenshape.spectral.multilevel.vcycle import Tower, correct, multiply, smooth

WIDTH = 32  # columns that are corrected at once
SMOOTHING_STEPS = (8, 30)  # of smoothing, fewest and most
FIRST_STEPS = 2.0  # of smoothing alone, times the root of what is to be smoothed
DEPENDENT_COLUMNS = {
    4: 1e-6,
    8: 1e-13,
}  # of the largest eigenvalue of a Gram matrix of unit columns, by their bytes
# A k-th eigenvalue below this share of `Goal.least` counts as 0.
ZERO_SHARE = 1e-6
FIRST_SHARE = 0.3  # of the work, told while the columns are smoothed the first time
PROBES = 8  # random columns of a last look
# Steps of inverse iteration on these random columns.
PROBE_STEPS = 4
MOST_LEFT = 10.0  # times what a round has lowered
EARLY = 0.5  # of the bound, or:
EXACT = 0.01  # of the accuracy, under which a residual is left as it is
TOO_FAR = (
    "The weights of the operator spread too far for its diagonal: solve with method='certified'."
)
UNSEEN = 3.0  # times what is estimated, where only smoothing has been at work


@dataclass(frozen=True, eq=False)
class Space:
    """Columns S of approximate eigenvectors, and room for as many that are added to them."""

    columns: np.ndarray
    added: np.ndarray


@dataclass(frozen=True)
class Goal:
    """What the first k pairs are to reach, in shares of the k-th eigenvalue, after so many rounds at most.

    What is left of the values' errors is estimated at no more than `accuracy`, and no residual is above `bound`.
    `least` stands for the eigenvalue where that is next to nothing beside it: all may be 0.
    """

    k: int
    accuracy: float
    bound: float
    least: float
    rounds: int
    strict: bool


@dataclass(frozen=True)
class Standing:
    """How near the vectors are: the k-th value, the largest residual, and an estimate of the error, in its shares."""

    scale: float
    worst: float
    left: float


def refine(
    tower: Tower, below: tuple[np.ndarray, np.ndarray], goal: Goal, report: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return M-orthonormal Ritz vectors, their values and an estimate of these' error, refined until the goal.

    The vectors come from the next coarser level, which has no more to say about them, so they are smoothed first, and
    the Ritz vectors of what that leaves taken. Each round then adds to the columns their corrections through all
    levels (`correct`), and keeps the best of both together (Davidson 1975; block form with one block of memory).

    Raises
    ------
    ConvergenceError
        If a strict goal is not reached in its rounds, or columns overflow or become dependent.
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
    """Judge a round by what it did to the values and to the largest residual.

    Errors go with the squares of residuals. If they fell only as much as those did, by a factor q, then of what the
    round lowered q / (1 - q) is left; no more than ten times is taken to be left, lest rounding in residuals decides.
    """
    last = float(values[goal.k - 1])
    scale = last if last > ZERO_SHARE * goal.least else goal.least
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
    """Smooth the columns, and return the norms of the residuals that they had."""
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
        for rows in row_chunks(tower):
            space.columns[rows, start : start + len(some)] -= corrections[rows]
    return norms


def _add_corrections(
    tower: Tower,
    space: Space,
    state: tuple[np.ndarray, np.ndarray],
    late: np.ndarray,
    excess: float,
) -> None:
    """Add the corrections of late columns, which have these values and residuals.

    Raises
    ------
    ConvergenceError
        If they overflow.
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
        for rows in row_chunks(tower):
            space.added[rows, start : start + len(some)] = corrections[rows]


def _require_finite(corrections: np.ndarray, some: np.ndarray) -> None:
    # Far below zero, where single rows are next to nothing beside θM, smoothing makes columns grow.
    if not np.isfinite(corrections.sum()):
        raise ConvergenceError(
            f"Corrections must be finite; those of eigenvector {some[0]} overflow. {TOO_FAR}"
        )


def _look_again(
    tower: Tower, space: Space, values: np.ndarray, k: int, bound: float, seed: int
) -> Float[np.ndarray, " m"]:
    """Look for eigenvectors that the coarser levels cannot see, with columns that know nothing of them.

    Some steps of inverse iteration on random columns, outside the span of those that are known. Where they lower one
    of the first k values by half the bound or more, they are taken in, and the new values returned; else everything
    stays as it is.
    """
    level, m = tower.levels[0], len(values)
    shifts = np.zeros(PROBES, dtype=np.float32)
    block = np.random.default_rng(seed).standard_normal((level.n, PROBES), dtype=np.float32)
    for _ in range(PROBE_STEPS):
        block *= level.rough_scales[0] / np.abs(block).max(axis=0)
        block = correct(tower, block, shifts, SMOOTHING_STEPS[0])
        keep_outside(tower, space.columns, block)
    space = Space(space.columns, block)
    lower, weights = _combination(tower, space, values, slice(m, m + PROBES))
    if (values[:k] - lower[:k] < 0.5 * bound).all():
        return values
    _combine(tower, space, weights)
    return lower


def _ritz(tower: Tower, space: Space, values: np.ndarray, fresh: slice) -> np.ndarray:
    """Put the lowest Ritz vectors of all columns, those added up to the last fresh one, in place; return their values.

    Columns before the fresh ones are Ritz vectors already, with the values given.
    """
    values, weights = _combination(tower, space, values, fresh)
    _combine(tower, space, weights)
    return values


def _combine(tower: Tower, space: Space, weights: np.ndarray) -> None:
    m, weights = space.columns.shape[1], weights.astype(space.columns.dtype)
    late = len(weights) - m
    for rows in row_chunks(tower):
        part = space.columns[rows] @ weights[:m]
        if late:
            part += space.added[rows, :late].astype(part.dtype) @ weights[m:]
        space.columns[rows] = part


def _combination(
    tower: Tower, space: Space, values: np.ndarray, fresh: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest Ritz values of the columns up to the last fresh ones, and their vectors' coefficients."""
    known = fresh.start
    gram, projected = _grams(tower, space, fresh)
    gram[:known, :known] = np.eye(known)
    projected[:known, :known] = np.diag(values[:known])
    scales = 1 / np.sqrt(np.diagonal(gram))
    sizes, axes = np.linalg.eigh(gram * scales * scales[:, None])
    kept = sizes > DEPENDENT_COLUMNS[space.columns.dtype.itemsize] * sizes[-1]
    if np.count_nonzero(kept) < len(values):
        raise ConvergenceError(
            f"Smoothed eigenvectors must be independent; fewer than {len(values)} are. {TOO_FAR}"
        )
    axes = (scales[:, None] * axes[:, kept]) / np.sqrt(sizes[kept])
    found, weights = np.linalg.eigh(axes.T @ projected @ axes)
    m = len(values)
    return np.array(found[:m]), axes @ weights[:, :m]


def _grams(tower: Tower, space: Space, fresh: slice) -> tuple[np.ndarray, np.ndarray]:
    """Return SᵀMS and SᵀAS, without the block of the columns before the fresh ones."""
    size, m = fresh.stop, space.columns.shape[1]
    gram, projected = np.zeros((size, size)), np.zeros((size, size))
    of = space.columns if fresh.start == 0 else space.added[:, : size - m]
    for rows, image, weighed in images(tower, of):
        for block, start in ((space.columns, 0), (space.added, m)):
            if start < size:
                part = block[rows, : size - start].astype(np.float64)
                places = slice(start, start + part.shape[1])
                gram[places, fresh] += part.T @ weighed
                projected[places, fresh] += part.T @ image
    for square in (gram, projected):
        square[fresh, : fresh.start] = square[: fresh.start, fresh].T
        square[fresh, fresh] = (square[fresh, fresh] + square[fresh, fresh].T) / 2
    return gram, projected
