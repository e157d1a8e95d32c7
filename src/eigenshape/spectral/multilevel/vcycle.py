"""Corrections of approximate eigenvectors by a V-cycle through all levels."""

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from certeig.kit.arrays import record
from certeig.kit.threads import free_threads, map_in_threads, share_units
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil
from eigenshape.spectral.multilevel.aggregation import ROWS_A_THREAD, Level
from eigenshape.spectral.multilevel.multilevel_loops import multiply_rows, smoothing_step

INNER_STEPS = 8  # smoothing steps on the levels between the finest and the coarsest


@record
class Coarsest:
    """The coarsest level: its lowest eigenvectors, and factors at several shifts.

    The eigenvectors are exact there and need no correction. The correction of a column with value θ
    uses the factor with the largest shift below θ.
    """

    pencil: Pencil
    vectors: Float[np.ndarray, "n m"]
    factors: tuple[Factor, ...]


@record
class Tower:
    """The levels from the finest to the coarsest."""

    levels: tuple[Level, ...]
    coarsest: Coarsest


def correct(
    tower: Tower, residual: np.ndarray, shifts: Float[np.ndarray, " b"], steps: int
) -> np.ndarray:
    """Return approximate solutions e of (A - θ M) e = residual, in single precision.

    Only components above the wanted eigenvalues are solved for. Coarser levels are corrected first,
    the coarsest by its factor. Then Chebyshev iteration with diag(A)⁻¹ (A - θM) reduces the error
    that coarser levels cannot represent.
    """
    if tower.levels:
        level = tower.levels[0]
        restricted = multiply(level.rough_restrict, residual)
        below = correct(Tower(tower.levels[1:], tower.coarsest), restricted, shifts, INNER_STEPS)
        start = multiply(level.rough_prolong, below)
        return smooth(tower, residual, shifts, steps, start)

    coarsest, right = tower.coarsest, residual.astype(np.float64)
    right -= coarsest.pencil.weigh(coarsest.vectors @ (coarsest.vectors.T @ right))
    chosen = np.searchsorted([factor.shift for factor in coarsest.factors[1:]], shifts)
    for place, factor in enumerate(coarsest.factors):
        some = np.flatnonzero(chosen == place)
        if some.size:
            right[:, some] = factor.solve(np.ascontiguousarray(right[:, some]))
    right -= coarsest.vectors @ (coarsest.vectors.T @ coarsest.pencil.weigh(right))
    return right.astype(np.float32)


def smooth(
    tower: Tower,
    residual: np.ndarray,
    shifts: Float[np.ndarray, " b"],
    steps: int,
    start: np.ndarray | None = None,
) -> np.ndarray:
    """Return such solutions by Chebyshev iteration on this level alone, from a start or from 0.

    On [top / spread, top] (Saad 2003, algorithm 12.1).
    """
    level = tower.levels[0]
    middle = (level.top + level.top / level.spread) / 2
    half = (level.top - level.top / level.spread) / 2
    sharpness = middle / half
    rho, old, new = 1 / sharpness, 0.0, 1 / middle
    matrix = level.rough.indptr, level.rough.indices, level.rough.data
    block = np.zeros_like(residual) if start is None else start
    step, moved = np.zeros_like(block), np.empty_like(block)
    shares = share_units(len(block), ROWS_A_THREAD, free_threads())
    for _ in range(steps):
        terms = residual, shifts
        arrays = matrix, level.rough_scales, terms, block, step, moved
        work = partial(smoothing_step, *arrays, old, new)

        def smooth_rows(share: tuple[int, int], work: Callable[..., None] = work) -> None:
            work(*share)

        map_in_threads(smooth_rows, shares)
        block, moved = moved, block
        following = 1 / (2 * sharpness - rho)
        old, new, rho = following * rho, 2 * following / half, following
    return block


def multiply(
    matrix: sp.csr_array,
    block: np.ndarray,
    rows: slice | None = None,
    product: np.ndarray | None = None,
) -> np.ndarray:
    """Return the matrix times a block, or some rows of it, in `product` if it is given."""
    begin, end = (rows.start, rows.stop) if rows else (0, matrix.shape[0])
    if product is None:
        product = np.empty((end - begin, block.shape[1]), matrix.dtype)

    def fill(share: tuple[int, int]) -> None:
        parts = matrix.indptr, matrix.indices, matrix.data
        multiply_rows(*parts, block, product, begin + share[0], begin + share[1], share[0])

    map_in_threads(fill, share_units(end - begin, ROWS_A_THREAD, free_threads()))
    return product
