"""Pencils moved so that their eigenvalues begin near zero, from where the solver works upward."""

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float

from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import find_zero_row_sums
from certeig.solver.factor import factorize
from certeig.solver.inertia import bound_count
from certeig.solver.pencil import Pencil, normalize
from certeig.solver.strategy import is_filled

# Eigenvalues down to minus this share of trace W / trace B may be rounding of 0.
NEGATIVE_ROUNDING = 1e-9
# Rows whose diagonal is below the sum of the others by this share of it are dominant up to rounding.
DOMINANCE_ROUNDING = 1e-12
# Vectors of inverse iteration and steps of it before each look at their Ritz values.
COLUMNS, STEPS = 8, 3
# The lowest eigenvalue is near zero if it is not higher than this many times the spread of the eight
# lowest Ritz values: farther off, shifts could not tell eigenvalues apart.
NEAR = 4.0
# What counts as near in any case, as a share of trace W / trace B.
SMALL = 1e-6
MOST_ROUNDS = 8
# The smallest trace W / trace B with which low eigenvalues keep their digits
SMALLEST_LEVEL = 1e-300


def pencil_from_zero(stiffness: sp.csr_array, mass: sp.csr_array) -> Pencil:
    """Return the scaled pencil of W - origin·B, whose lowest eigenvalue is not negative and near zero.

    The origin is 0 if that holds for W itself.

    Raises an InvalidParameterError as `normalize` does, or if eigenvalues are beyond the range of
    floats.
    """
    pencil = normalize(stiffness, mass)
    _require_representable(pencil)
    least = _gershgorin(pencil)
    dominant = least >= -DOMINANCE_ROUNDING
    weighty = not find_zero_row_sums(pencil.stiffness).all()
    # Of a matrix that is too filled to be factored, dominance is enough.
    if dominant.all() and not (weighty and not is_filled(pencil)):
        return pencil
    floor = zero = -NEGATIVE_ROUNDING * pencil.level
    if not dominant.all() and bound_count(pencil, zero, 1.0) != 0:
        # W ≥ diag(e) ≥ m D ≥ (m/c) B with m = min e_i/d_i < 0
        diagonals = abs(pencil.stiffness).sum(axis=1) / pencil.mass_diagonal
        floor = float((least * diagonals).min()) / pencil.mass_floor
    floor = _raised(pencil, floor)
    if floor == zero:
        return pencil
    origin = pencil.place_out(floor)
    moved = sp.csr_array(stiffness - origin * mass)
    return normalize(moved, mass, known_floor=pencil.mass_floor, origin=origin)


def _require_representable(pencil: Pencil) -> None:
    power = np.log10(pencil.level) + pencil.value_exponent * np.log10(2)
    if not np.log10(SMALLEST_LEVEL) < power < np.log10(np.finfo(np.float64).max):
        raise InvalidParameterError(
            f"Eigenvalues must lie within the range of floats; trace W / trace B is about 1e{power:.0f}. "
            "Multiply W or B by a number."
        )


def _gershgorin(pencil: Pencil) -> Float[np.ndarray, " n"]:
    """Return W_ii - Σ |W_ij| of each row, relative to the sum of all |W_ij|; 0 where that is 0."""
    diagonal = pencil.stiffness.diagonal()
    sums = abs(pencil.stiffness).sum(axis=1)
    excess = diagonal - (sums - np.abs(diagonal))
    return np.divide(excess, sums, out=np.zeros(pencil.n), where=sums > 0)


def _raised(pencil: Pencil, floor: float) -> float:
    """Raise a lower bound of all eigenvalues until the lowest is near it, as inverse iteration shows."""
    vectors = np.random.default_rng(0).standard_normal((pencil.n, min(COLUMNS, pencil.n)))
    for _ in range(MOST_ROUNDS):
        factor = factorize(pencil, floor)
        if factor is None:
            return floor
        for _ in range(STEPS):
            vectors, _ = np.linalg.qr(factor.solve(pencil.weigh(vectors)))
        ritz = sl.eigh(
            vectors.T @ (pencil.stiffness @ vectors),
            vectors.T @ pencil.weigh(vectors),
            eigvals_only=True,
        )
        distance, spread = float(ritz[0]) - floor, float(ritz[-1] - ritz[0])
        small = SMALL * pencil.level
        if distance <= max(NEAR * spread, small):
            return floor
        # The lowest Ritz value is above the lowest eigenvalue; how far a factor tells.
        for below in (max(spread, small / 2), distance / 8, distance / 2):
            higher = float(ritz[0]) - below
            if higher > floor and bound_count(pencil, higher, 1.0) == 0:
                floor = higher
                break
    return floor
