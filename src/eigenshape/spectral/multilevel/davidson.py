"""Block Davidson: repeated Rayleigh-Ritz on approximate eigenvectors and their corrections."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import ConvergenceError
from eigenshape.spectral.multilevel.residuals import (
    Interpolated,
    Stored,
    change_rows,
    images,
    map_groups,
    norms_of_residuals,
    pick_columns,
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


def refine(
    tower: Tower, below: tuple[np.ndarray, np.ndarray], goal: Goal, report: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Refine vectors of the next coarser level until the goal is reached.

    Returns M-orthonormal Ritz vectors, Ritz values, and their estimated error. Each round computes
    multilevel corrections (`correct`) and takes the lowest Ritz vectors in the span of columns and
    corrections (Davidson 1975; in blocks, without older columns).

    Raises a ConvergenceError if a strict goal is not reached in the given rounds, or columns
    overflow or become dependent.
    """
    values, k, m = below[1], goal.k, len(below[1])
    level = tower.levels[0]
    # M and A of the level below are PᵀMP and PᵀAP: P keeps orthonormality and Ritz values.
    coarse = np.ascontiguousarray(below[0], dtype=level.prolong.dtype)
    columns = multiply(level.prolong, coarse)

    # The coarser level cannot improve its vectors further. So they are smoothed first, and replaced
    # by the Ritz vectors of their span.
    residuals, steps = np.empty(m), int(np.ceil(FIRST_STEPS * np.sqrt(level.spread)))
    for some in _blocks(np.arange(m)):
        report(FIRST_SHARE * int(some[0]) / m)
        solve, scales = partial(smooth, tower, steps=steps), np.ones(len(some))
        step, residuals[some] = _corrections(tower, columns, values, some, scales, solve)
        columns[:, some[0] : some[-1] + 1] -= step
    worst = first = float(residuals[:k].max()) / goal.scale(values)
    before, values = values, _ritz(tower, columns, values)

    looked = not goal.strict
    for done in range(goal.rounds + 1):
        residuals = norms_of_residuals(tower, columns, values)
        scale = goal.scale(values)
        last, worst = worst, float(residuals[:k].max()) / scale
        # Errors of values behave like squares of residuals. If they decrease only as fast as the
        # residuals, by a factor q a round, q / (1 - q) times the last decrease of the values
        # remains; at most 10 times, so that rounding in the residuals does not dominate.
        factor = worst / last if 0 < last < np.inf else 1.0
        decrease = float(np.abs(before - values)[:k].max()) * (1.0 if done else UNSEEN)
        left = decrease / scale * min(factor / max(1 - factor, 0.01), MOST_LEFT)

        bound = min(goal.bound, np.sqrt(goal.accuracy))
        reached = left <= goal.accuracy and worst <= goal.bound
        if reached and not looked:
            least = min(goal.accuracy, goal.bound) * scale
            before, values = values, _look_again(tower, columns, values, k, least, done)
            looked = values is before
            if not looked:
                continue
        if reached or (done == goal.rounds and not goal.strict):
            return columns, values, left
        way = float(np.log(first / worst) / np.log(first / bound)) if first > worst > bound else 0.0
        report(min(FIRST_SHARE + (1 - FIRST_SHARE) * way, 0.95))

        # Add the corrections of the columns that have not converged.
        enough = EARLY * goal.bound if np.isfinite(goal.bound) else EXACT * goal.accuracy
        late = np.flatnonzero(residuals > enough * scale)
        needed = 0.5 * np.sqrt(level.spread) * np.log(8 * max(worst / bound, 1.0))
        steps = int(np.clip(np.ceil(needed), *SMOOTHING_STEPS))
        added = np.empty((level.n, len(late)), dtype=columns.dtype)
        for some, start in zip(_blocks(late), range(0, len(late), WIDTH), strict=True):
            solve, scales = partial(correct, tower, steps=steps), 1 / residuals[some]
            step, _ = _corrections(tower, columns, values, some, scales, solve)
            added[:, start : start + len(some)] = step
        before, values = values, _ritz(tower, columns, values, added)
    raise ConvergenceError(
        f"The error must be estimated at no more than {goal.accuracy:.1e} of the last eigenvalue, and no residual be "
        f"above {goal.bound:.1e}; after {goal.rounds} rounds these are {left:.1e} and {worst:.1e}. "
        f"Request less accuracy, or solve with method='certified'."
    )


def finish_vectors(
    tower: Tower, columns: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Ritz vectors and values of the columns in double precision."""
    columns = columns.astype(np.float64)
    return columns, _ritz(tower, columns, values)


def _blocks(numbers: np.ndarray) -> list[np.ndarray]:
    """Divide the numbers of columns into those that are corrected together."""
    return [numbers[start : start + WIDTH] for start in range(0, len(numbers), WIDTH)]


def _corrections(
    tower: Tower,
    columns: np.ndarray,
    values: np.ndarray,
    some: np.ndarray,
    scales: np.ndarray,
    solve: Callable[..., np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corrections of some columns for their scaled residuals, and the norms of these unscaled."""
    picked = pick_columns(tower, columns, some)
    block = np.empty(picked.shape, dtype=np.float32)
    norms = norms_of_residuals(tower, picked, values[some], block, scales)
    found = solve(block, values[some].astype(np.float32))
    # If rows are negligible beside θM, with θ far below zero, smoothing makes columns grow.
    if not np.isfinite(found.sum()):
        raise ConvergenceError(
            f"Corrections must be finite; those of eigenvector {some[0]} overflow. {TOO_FAR}"
        )
    return found, norms


def _look_again(
    tower: Tower, columns: np.ndarray, values: np.ndarray, k: int, bound: float, seed: int
) -> Float[np.ndarray, " m"]:
    """Search for eigenvectors that the coarser levels cannot represent.

    Inverse iteration is run on random columns, orthogonal to the known ones. If Rayleigh-Ritz with
    these columns lowers one of the first k values by half the bound or more, they are included and
    the new values are returned. Otherwise nothing changes.
    """
    block = _inverse_iteration(Stored(tower, columns), seed)
    lower, weights = _ritz_pairs(tower, columns, values, block)
    if (values[:k] - lower[:k] < 0.5 * bound).all():
        return values
    _combine(tower, columns, block, weights)
    return lower


def misses_pairs(columns: Interpolated, values: np.ndarray, k: int, bound: float) -> bool:
    """Search for eigenvectors that the coarser levels cannot represent, as refinement does.

    Return whether random columns, after inverse iteration, lower one of the first k values by half
    the bound or more.
    """
    tower, m = columns.tower, len(values)
    block = _inverse_iteration(columns, 0)
    image = np.empty(block.shape, dtype=np.float32)
    norms_of_residuals(tower, block, np.zeros(PROBES), image)
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


def _ritz(
    tower: Tower, columns: np.ndarray, values: np.ndarray, added: np.ndarray | None = None
) -> np.ndarray:
    """Replace the columns by the lowest Ritz vectors of the span of them and of those added; return the values."""
    values, weights = _ritz_pairs(tower, columns, values, added)
    _combine(tower, columns, added, weights)
    return values


def _combine(
    tower: Tower, columns: np.ndarray, added: np.ndarray | None, weights: np.ndarray
) -> None:
    m, weights = columns.shape[1], weights.astype(columns.dtype)

    def combine(rows: slice) -> None:
        part = columns[rows] @ weights[:m]
        if added is not None and added.shape[1]:
            part += added[rows].astype(part.dtype) @ weights[m:]
        columns[rows] = part

    change_rows(tower, combine)


def _ritz_pairs(
    tower: Tower, columns: np.ndarray, values: np.ndarray, added: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest Ritz values of columns S, and the coefficients of the Ritz vectors.

    S are the columns and those added; where some are added, the columns are Ritz vectors already,
    with the given values. MS and AS are computed in double precision. The products with S are in
    the precision of the columns and are summed in double precision: single precision takes half the
    time.
    """
    m, precision = columns.shape[1], columns.dtype
    of = columns if added is None else added
    known = 0 if added is None else m
    size = known + of.shape[1]

    def sum_rows(chunks: list[slice]) -> np.ndarray:
        grams = np.zeros((2, size, of.shape[1]))
        for rows, image, weighed in images(tower, of, chunks):
            found = [part.astype(precision, copy=False) for part in (weighed, image)]
            for gram, part in zip(grams, found, strict=True):
                if known:
                    gram[:m] += columns[rows].T @ part
                    gram[m:] += of[rows].T @ part
                    continue
                for start in range(0, size, GRAM_COLUMNS):  # the rest follows from symmetry
                    end = min(start + GRAM_COLUMNS, size)
                    gram[:end, start:end] += of[rows, :end].T @ part[:, start:end]
        return grams

    squares = np.zeros((2, size, size))
    squares[:, :, known:] = sum(map_groups(tower, sum_rows))
    for square in squares:
        if not known:
            square[:] = np.triu(square) + np.triu(square, 1).T
        square[known:, :known] = square[:known, known:].T
        square[known:, known:] = (square[known:, known:] + square[known:, known:].T) / 2
    gram, projected = squares
    gram[:known, :known] = np.eye(known)
    projected[:known, :known] = np.diag(values[:known])
    return _lowest_pairs(gram, projected, len(values), DEPENDENT_COLUMNS[precision.itemsize])


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
