"""Corrections of approximate eigenvectors through all levels of a hierarchy."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape.spectral.multilevel.aggregation import Loaded
from eigenshape.spectral.multilevel.multilevel_loops import multiply_rows, smoothing_step
from eigenshape.spectral.solver.factor import Factor
from eigenshape.spectral.solver.pencil import Pencil

INNER_STEPS = 8  # of smoothing, on the levels between


@dataclass(frozen=True, eq=False)
class Coarsest:
    """The lowest eigenvectors of the coarsest pencil, which need no correction, and factors for all others.

    Corrections of a column with value θ take the factor with the highest shift under θ.
    """

    pencil: Pencil
    vectors: Float[np.ndarray, "n m"]
    factors: tuple[Factor, ...]


@dataclass(frozen=True, eq=False)
class Tower:
    """The levels from a finest one down to the coarsest."""

    levels: tuple[Loaded, ...]
    coarsest: Coarsest


def correct(
    tower: Tower, residual: np.ndarray, shifts: Float[np.ndarray, " b"], steps: int
) -> np.ndarray:
    """Return columns e with (A - θ M) e ≈ residual where eigenvalues lie above those looked for; single precision.

    The coarser levels first, the coarsest by its factor; then Chebyshev iteration in diag(A)⁻¹ (A - θM), which takes
    away what only this level sees.
    """
    if not tower.levels:
        return _coarsest(tower, residual, shifts)
    level = tower.levels[0]
    restricted = np.empty((level.rough_restrict.shape[0], residual.shape[1]), dtype=residual.dtype)
    multiply(level.rough_restrict, residual, restricted)
    below = correct(Tower(tower.levels[1:], tower.coarsest), restricted, shifts, INNER_STEPS)
    start = multiply(level.rough_prolong, below, np.empty(residual.shape, dtype=residual.dtype))
    return _smooth(level, (residual, shifts), start, steps)


def smooth(
    tower: Tower, residual: np.ndarray, shifts: Float[np.ndarray, " b"], steps: int
) -> np.ndarray:
    """Return what `correct` does where coarser levels have nothing to add."""
    return _smooth(tower.levels[0], (residual, shifts), np.zeros_like(residual), steps)


def multiply(
    matrix: sp.csr_array, block: np.ndarray, product: np.ndarray, rows: slice | None = None
) -> np.ndarray:
    """Write matrix times block, or these rows of it, to `product`, and return it."""
    starts = matrix.indptr if rows is None else matrix.indptr[rows.start : rows.stop + 1]
    multiply_rows(starts, matrix.indices, matrix.data, block, product)
    return product


def _smooth(
    level: Loaded, terms: tuple[np.ndarray, np.ndarray], block: np.ndarray, steps: int
) -> np.ndarray:
    """Chebyshev iteration for the eigenvalues from top / spread to top (Saad 2003, algorithm 12.1)."""
    middle = (level.top + level.top / level.spread) / 2
    half = (level.top - level.top / level.spread) / 2
    sharpness = middle / half
    rho, old, new = 1 / sharpness, 0.0, 1 / middle
    matrix = level.rough.indptr, level.rough.indices, level.rough.data
    step, moved = np.zeros_like(block), np.empty_like(block)
    precision = block.dtype.type
    for _ in range(steps):
        smoothing_step(
            matrix, level.rough_scales, terms, block, step, moved, precision(old), precision(new)
        )
        block, moved = moved, block
        following = 1 / (2 * sharpness - rho)
        old, new, rho = following * rho, 2 * following / half, following
    return block


def _coarsest(tower: Tower, residual: np.ndarray, shifts: Float[np.ndarray, " b"]) -> np.ndarray:
    coarsest, right = tower.coarsest, residual.astype(np.float64)
    right -= coarsest.pencil.weigh(coarsest.vectors @ (coarsest.vectors.T @ right))
    chosen = np.searchsorted([factor.shift for factor in coarsest.factors[1:]], shifts)
    for place, factor in enumerate(coarsest.factors):
        some = np.flatnonzero(chosen == place)
        if some.size:
            right[:, some] = factor.solve(np.ascontiguousarray(right[:, some]))
    right -= coarsest.vectors @ (coarsest.vectors.T @ coarsest.pencil.weigh(right))
    return right.astype(np.float32)
