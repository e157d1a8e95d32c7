"""Corrections of approximate eigenvectors through all levels of a hierarchy."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape.spectral.multilevel.aggregation import Loaded
from eigenshape.spectral.multilevel.device import (
    Array,
    Device,
    fetch,
    multiply,
    put,
    smoothing_step,
)
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
    """The levels from a finest one down to the coarsest, on a device."""

    device: Device
    levels: tuple[Loaded, ...]
    coarsest: Coarsest


def correct(tower: Tower, residual: Array, shifts: Float[np.ndarray, " b"], steps: int) -> Array:
    """Return columns e with (A - θ M) e ≈ residual where eigenvalues lie above those looked for; single precision.

    The coarser levels first, the coarsest by its factor; then Chebyshev iteration in diag(A)⁻¹ (A - θM), which takes
    away what only this level sees.
    """
    if not tower.levels:
        return _coarsest(tower, residual, shifts)
    level, device = tower.levels[0], tower.device
    empty = device.arrays.empty
    restricted = empty((level.rough_restrict.shape[0], residual.shape[1]), dtype=residual.dtype)
    multiply(device, level.rough_restrict, residual, restricted)
    below = correct(
        Tower(device, tower.levels[1:], tower.coarsest), restricted, shifts, INNER_STEPS
    )
    start = multiply(
        device, level.rough_prolong, below, empty(residual.shape, dtype=residual.dtype)
    )
    return _smoothed(device, level, (residual, put(device, shifts)), start, steps)


def smooth(tower: Tower, residual: Array, shifts: Float[np.ndarray, " b"], steps: int) -> Array:
    """Return what `correct` does where coarser levels have nothing to add."""
    level, device = tower.levels[0], tower.device
    terms = residual, put(device, shifts)
    return _smoothed(device, level, terms, device.arrays.zeros_like(residual), steps)


def _smoothed(
    device: Device, level: Loaded, terms: tuple[Array, Array], start: Array, steps: int
) -> Array:
    """Chebyshev iteration for the eigenvalues from top / spread to top (Saad 2003, algorithm 12.1)."""
    middle, half = (
        (level.top + level.top / level.spread) / 2,
        (level.top - level.top / level.spread) / 2,
    )
    sharpness = middle / half
    rho, old, new = 1 / sharpness, 0.0, 1 / middle
    state = [start, device.arrays.zeros_like(start), device.arrays.empty_like(start)]
    for _ in range(steps):
        smoothing_step(device, level.rough, level.rough_scales, terms, state, (old, new))
        following = 1 / (2 * sharpness - rho)
        old, new, rho = following * rho, 2 * following / half, following
    return state[0]


def _coarsest(tower: Tower, residual: Array, shifts: Float[np.ndarray, " b"]) -> Array:
    coarsest, right = tower.coarsest, fetch(tower.device, residual).astype(np.float64)
    right -= coarsest.pencil.weigh(coarsest.vectors @ (coarsest.vectors.T @ right))
    chosen = np.searchsorted([factor.shift for factor in coarsest.factors[1:]], shifts)
    for place, factor in enumerate(coarsest.factors):
        some = np.flatnonzero(chosen == place)
        if some.size:
            right[:, some] = factor.solve(np.ascontiguousarray(right[:, some]))
    right -= coarsest.vectors @ (coarsest.vectors.T @ coarsest.pencil.weigh(right))
    return put(tower.device, right.astype(np.float32))
