"""Block Davidson: Rayleigh-Ritz among approximate eigenvectors and their corrections, until residuals are small."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.correction import Tower, correct
from eigenshape.spectral.device import Array, fetch, multiply, put

WIDTH = 32  # columns that are corrected at once
ROWS = 4096  # of a product of tall columns at once
STEPS = (8, 30)  # of smoothing, fewest and most
DEPENDENT = 1e-13  # of the largest eigenvalue of a Gram matrix of unit columns
PROBES = 8  # random columns of a last look
PROBE_STEPS = 4
EARLY = 0.5  # of the bound, under which a pair is left as it is


@dataclass(frozen=True, eq=False)
class Space:
    """Columns S and their images A S; the first m are the approximate eigenvectors."""

    columns: Array
    images: Array


@dataclass(frozen=True, eq=False)
class Ritz:
    """Ritz values of the first columns, the norms of their residuals, and M times the columns where M is full."""

    values: Float[np.ndarray, " m"]
    residuals: Float[np.ndarray, " m"]
    weighed: Array | None


@dataclass(frozen=True)
class Goal:
    """What the first k pairs are to reach, in shares of the k-th eigenvalue, after so many rounds at most.

    The last round lowers no value by more than `accuracy`, and no residual is above `bound`. `least` stands for the
    eigenvalue where it is smaller: all may be 0.
    """

    k: int
    accuracy: float
    bound: float
    least: float
    rounds: int
    strict: bool


def refine(
    tower: Tower, below: tuple[Array, np.ndarray], goal: Goal, report: Callable[[float], None]
) -> tuple[Array, np.ndarray, float]:
    """Return M-orthonormal Ritz vectors, their values and what the last round lowered these by, refined until the goal.

    Each round adds to the columns their corrections (`correct`), and keeps the best of both together
    (Davidson 1975; block form with one block of memory).

    Raises
    ------
    ConvergenceError
        If a strict goal is not reached in its rounds.
    """
    vectors, values = below
    space, m, first, change = _prolonged(tower, vectors), len(values), 0.0, np.inf
    looked = not goal.strict
    for done in range(goal.rounds + 1):
        weighed = _weighed(tower, space.columns[:, :m])
        state = Ritz(values, _residuals(tower, space, values, weighed), weighed)
        scale = max(float(values[goal.k - 1]), goal.least)
        bound, worst = min(goal.bound, np.sqrt(goal.accuracy)) * scale, float(state.residuals[: goal.k].max())
        reached = change <= goal.accuracy and worst <= goal.bound * scale
        first = first or worst
        if reached and not looked:
            values = _look_again(tower, space, state, goal.k, min(goal.accuracy, goal.bound) * scale, done)
            looked = values is state.values
            if not looked:
                continue
        if reached or (done == goal.rounds and not goal.strict):
            return space.columns[:, :m], values, change
        report(min(float(np.log(first / worst) / np.log(first / bound)), 0.95) if first > worst > bound else 0.0)
        # Where no residual tells when a pair is good enough, the change tells, and of every pair.
        late = np.flatnonzero(state.residuals > (EARLY * bound if np.isfinite(goal.bound) else 0.0))
        _add_corrections(tower, space, state, late, max(worst / bound, 1.0))
        before, values = values, _ritz(tower, space, values, m + len(late))
        change = float((before - values)[: goal.k].max()) / scale
    raise ConvergenceError(
        f"A round must lower no eigenvalue by more than {goal.accuracy:.1e} of the last, and no residual be above "
        f"{goal.bound:.1e}; after {goal.rounds} rounds these are {change:.1e} and {worst / scale:.1e}. Ask for less "
        f"accuracy, or take solve_spectrum."
    )


def _prolonged(tower: Tower, vectors: Array) -> Space:
    # M and A of the level below are PᵀMP and PᵀAP: P keeps orthonormality and Ritz values.
    level, device, m = tower.levels[0], tower.device, vectors.shape[1]
    space = Space(*(device.arrays.empty((level.n, 2 * m)) for _ in range(2)))
    multiply(device, level.prolong, vectors, space.columns[:, :m])
    multiply(device, level.stiffness, space.columns[:, :m], space.images[:, :m])
    return space


def _residual_rows(tower: Tower, space: Space, values: Array, weighed: Array | None) -> Iterator[tuple[slice, Array]]:
    """Give A S - M S θ some rows at a time; `weighed` is M S where M is not diagonal."""
    m, weights = len(values), tower.levels[0].weights
    for rows in _row_chunks(tower.levels[0].n):
        part = space.columns[rows, :m] * weights[rows] if weighed is None else weighed[rows]
        yield rows, space.images[rows, :m] - part * values


def _residuals(tower: Tower, space: Space, values: np.ndarray, weighed: Array | None) -> np.ndarray:
    device, squares = tower.device, tower.device.arrays.zeros(len(values))
    for rows, rest in _residual_rows(tower, space, put(device, values), weighed):
        squares += (rest * rest / tower.levels[0].weights[rows]).sum(axis=0)
    return np.sqrt(fetch(device, squares))


def _weighed(tower: Tower, columns: Array) -> Array | None:
    mass, device = tower.levels[0].mass, tower.device
    return None if mass is None else multiply(device, mass, columns, device.arrays.empty(columns.shape))


def _add_corrections(tower: Tower, space: Space, state: Ritz, late: np.ndarray, excess: float) -> None:
    """Append the corrections of late columns, and their images."""
    level, device, m = tower.levels[0], tower.device, len(state.values)
    steps = int(np.clip(np.ceil(0.5 * np.sqrt(level.spread) * np.log(8 * excess)), *STEPS))
    values, scales = put(device, state.values), put(device, 1 / state.residuals[late])
    added = space.columns[:, m : m + len(late)]
    for rows, rest in _residual_rows(tower, space, values, state.weighed):
        added[rows] = rest[:, late] * scales
    for start in range(0, len(late), WIDTH):
        some = slice(start, min(start + WIDTH, len(late)))
        shifts = state.values[late[some]].astype(np.float32)
        added[:, some] = correct(tower, added[:, some].astype(np.float32), shifts, steps)
    multiply(device, level.stiffness, added, space.images[:, m : m + len(late)])


def _look_again(tower: Tower, space: Space, state: Ritz, k: int, bound: float, seed: int) -> Float[np.ndarray, " m"]:
    """Look for eigenvectors that the coarser levels cannot see, with columns that know nothing of them.

    Some steps of inverse iteration on random columns. Where they lower one of the first k values by half the bound
    or more, they are taken in, and the new values returned; else everything stays as it is.
    """
    values = state.values
    level, device, m = tower.levels[0], tower.device, len(values)
    some, shifts = slice(m, m + PROBES), np.zeros(PROBES, dtype=np.float32)
    block = put(device, np.random.default_rng(seed).standard_normal((level.n, PROBES)).astype(np.float32))
    for _ in range(PROBE_STEPS):
        block *= level.rough_scales[0]
        block = correct(tower, block / device.arrays.abs(block).max(axis=0), shifts, STEPS[0])
    space.columns[:, some] = block
    multiply(device, level.stiffness, space.columns[:, some], space.images[:, some])
    lower, weights = _combination(tower, space, values, m + PROBES)
    if (values[:k] - lower[:k] < 0.5 * bound).all():
        return values
    _combine(space, weights)
    return lower


def _ritz(tower: Tower, space: Space, values: np.ndarray, size: int) -> np.ndarray:
    """Put the lowest Ritz vectors of so many columns in place of the first, and return their values.

    The first columns are Ritz vectors already, with the values given.
    """
    values, weights = _combination(tower, space, values, size)
    _combine(space, weights)
    return values


def _combine(space: Space, weights: Array) -> None:
    size, known = weights.shape
    for block in (space.columns, space.images):
        for rows in _row_chunks(len(block)):
            block[rows, :known] = block[rows, :size] @ weights


def _combination(tower: Tower, space: Space, values: np.ndarray, size: int) -> tuple[np.ndarray, Array]:
    """Return the lowest Ritz values of so many columns, as many as are known, and their vectors' coefficients."""
    arrays, known = tower.device.arrays, len(values)
    gram, projected = _grams(tower, space, slice(known, size))
    gram[:known, :known] = arrays.eye(known)
    projected[:known, :known] = arrays.diag(put(tower.device, values))
    scales = 1 / arrays.sqrt(arrays.diagonal(gram))
    sizes, axes = arrays.linalg.eigh(gram * scales * scales[:, None])
    kept = sizes > DEPENDENT * sizes[-1]
    axes = (scales[:, None] * axes[:, kept]) / arrays.sqrt(sizes[kept])
    found, weights = arrays.linalg.eigh(axes.T @ projected @ axes)
    return np.array(fetch(tower.device, found[:known])), axes @ weights[:, :known]


def _grams(tower: Tower, space: Space, fresh: slice) -> tuple[Array, Array]:
    """Return SᵀMS and SᵀAS, without the block of the columns before the fresh ones."""
    level, arrays, size = tower.levels[0], tower.device.arrays, fresh.stop
    weighed = _weighed(tower, space.columns[:, fresh])
    gram, projected = arrays.zeros((size, size)), arrays.zeros((size, size))
    for rows in _row_chunks(level.n):
        part = space.columns[rows, :size]
        gram[:, fresh] += part.T @ (part[:, fresh] * level.weights[rows] if weighed is None else weighed[rows])
        projected[:, fresh] += part.T @ space.images[rows, fresh]
    for square in (gram, projected):
        square[fresh, : fresh.start] = square[: fresh.start, fresh].T
        square[fresh, fresh] = (square[fresh, fresh] + square[fresh, fresh].T) / 2
    return gram, projected


def _row_chunks(n: int) -> list[slice]:
    return [slice(start, min(start + ROWS, n)) for start in range(0, n, ROWS)]
