"""Functions of a coarse space made eigenfunctions of the whole operator, nearly: smoothed, and combined."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float, Int

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.coarse_space import CoarseSpace, inverse_diagonal
from eigenshape.spectral.coarse_space_loops import apply_rows, multiply_rows, smoothing_step

WIDTH = 32  # columns that are smoothed at once
ROWS = 4096  # of a product of tall columns at once
CLOSED = 1e-10  # of a row's entries, below which their sum counts as 0
SMOOTHED = 0.6  # of a patch's points: how far below the top of the spectrum smoothing reaches
LEAST_SPREAD = 40.0
STEPS = 1.2  # of smoothing, times the square root of that reach
FURTHER = 4.0  # times that reach, for what a sample of the pairs is off by

Matrix = tuple[np.ndarray, np.ndarray, np.ndarray]
Columns = Float[np.ndarray, "n m"]  # in single precision


@dataclass(frozen=True, eq=False)
class FineOperator:
    """The whole operator in single precision, and how far smoothing reaches in it.

    Attributes
    ----------
    matrix : rows, columns and values of A
    diagonals : three (n,) float
        Sums of A's rows, M, and D⁻¹ of D = diag(A).
    mass : (n,) float
        M in double precision.
    top, low : float
        The interval of eigenvalues of D⁻¹A that smoothing takes away.
    """

    matrix: Matrix
    diagonals: tuple[np.ndarray, np.ndarray, np.ndarray]
    mass: Float[np.ndarray, " n"]
    top: float
    low: float


def fine_operator(stiffness: sp.csr_array, mass: Float[np.ndarray, " n"], space: CoarseSpace) -> FineOperator:
    """Take an operator down to single precision; what its rows sum to is kept apart, so that constants stay exact."""
    rests, sizes = np.asarray(stiffness.sum(axis=1)), np.asarray(abs(stiffness).sum(axis=1))
    rests[np.abs(rests) <= CLOSED * sizes] = 0.0
    spread = max(SMOOTHED * len(mass) / space.stiffness.shape[0], LEAST_SPREAD)
    return FineOperator(
        matrix=(stiffness.indptr, stiffness.indices, stiffness.data.astype(np.float32)),
        diagonals=(_single(rests), _single(mass), _single(inverse_diagonal(stiffness))),
        mass=mass,
        top=space.top,
        low=space.top / spread,
    )


def _single(values: Float[np.ndarray, " n"]) -> np.ndarray:
    return values.astype(np.float32)


def prolonged(space: CoarseSpace, vectors: Float[np.ndarray, "c m"]) -> Columns:
    """Return P u for each column u, in single precision."""
    down, rough = space.prolongation, vectors.astype(np.float32)
    columns = np.empty((down.shape[0], vectors.shape[1]), dtype=np.float32)
    multiply_rows((down.indptr, down.indices, down.data.astype(np.float32)), rough, 0, columns)
    return columns


def smooth(
    fine: FineOperator, columns: Columns, values: Float[np.ndarray, " m"], report: Callable[[float], None]
) -> None:
    """Take from each column in place what its patches left in it: Chebyshev iteration for (A - θM) x = 0.

    On the eigenvalues of D⁻¹A from `low` to `top` (Saad 2003, algorithm 12.1).
    """
    m = columns.shape[1]
    for first in range(0, m, WIDTH):
        some = slice(first, min(first + WIDTH, m))
        columns[:, some] = _smoothed(fine, np.ascontiguousarray(columns[:, some]), values[some], fine.low)
        report(some.stop / m)


def _smoothed(fine: FineOperator, columns: Columns, values: Float[np.ndarray, " w"], low: float) -> Columns:
    """Return columns smoothed; the array given is used up."""
    middle, half = (fine.top + low) / 2, (fine.top - low) / 2
    sharpness = middle / half
    rho, factors = 1 / sharpness, (0.0, 1 / middle)
    old, step, new, shifts = columns, np.zeros_like(columns), np.empty_like(columns), values.astype(np.float32)
    for _ in range(int(np.ceil(STEPS * np.sqrt(fine.top / low)))):
        smoothing_step(fine.matrix, fine.diagonals, shifts, old, step, new, np.array(factors, dtype=np.float32))
        following = 1 / (2 * sharpness - rho)
        rho, factors, old, new = following, (following * rho, 2 * following / half), new, old
    return old


def rayleigh_ritz(fine: FineOperator, columns: Columns) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m m"]]:
    """Return Ritz values of the columns' span, ascending, and the coefficients of M-orthonormal Ritz vectors.

    Raises
    ------
    ConvergenceError
        If the columns are dependent.
    """
    m = columns.shape[1]
    gram, projected = np.zeros((m, m)), np.zeros((m, m))
    for first in range(0, len(columns), ROWS):
        part = columns[first : first + ROWS]
        image = np.empty_like(part)
        apply_rows(fine.matrix, fine.diagonals[0], columns, first, image)
        part = part.astype(np.float64)
        gram += part.T @ (fine.mass[first : first + ROWS, None] * part)
        projected += part.T @ image.astype(np.float64)
    try:
        values, weights = sl.eigh((projected + projected.T) / 2, gram)
    except (ValueError, np.linalg.LinAlgError) as err:  # not finite, or not definite
        raise ConvergenceError(
            "Smoothed eigenvectors must stay independent; their Gram matrix is not positive definite. Take "
            "solve_spectrum and heat_kernel_signature."
        ) from err
    return values, weights


def diagonal_of(
    columns: Columns, weights: Float[np.ndarray, "m k"], decay: Float[np.ndarray, "k q"]
) -> Float[np.ndarray, "n q"]:
    """Return Σ_i decay_i φ_i² at each point, of φ = columns × weights, which are never held all at once."""
    rough, sums = weights.astype(np.float32), np.empty((len(columns), decay.shape[1]))
    for first in range(0, len(columns), ROWS):
        part = (columns[first : first + ROWS] @ rough).astype(np.float64)
        sums[first : first + ROWS] = (part * part) @ decay
    return sums


def changes_further(
    fine: FineOperator, columns: Columns, ritz: tuple[np.ndarray, np.ndarray], sample: Int[np.ndarray, " s"]
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " s"]]:
    """Smooth some Ritz vectors far further, and return what that changes: the norms of φ'² - φ² in M, and the values.

    `ritz` are the values and weights of `rayleigh_ritz`. Only what lies outside the span of all columns counts: within
    it Ritz vectors are what they can be.
    """
    values, weights = ritz[0][sample], ritz[1]
    vectors = columns @ weights[:, sample].astype(np.float32)
    step = _smoothed(fine, vectors.copy(), values, fine.low / FURTHER) - vectors
    step -= columns @ (weights @ (weights.T @ _products(fine, columns, step))).astype(np.float32)
    better, before = (vectors + step).astype(np.float64), vectors.astype(np.float64)
    better /= np.sqrt(fine.mass @ better**2)
    image = np.empty_like(better)
    apply_rows(fine.matrix, fine.diagonals[0], better, 0, image)
    lower = np.einsum("ij,ij->j", better, image)
    return np.sqrt(fine.mass @ (better**2 - before**2) ** 2), np.abs(values - lower)


def _products(fine: FineOperator, left: Columns, right: Float[np.ndarray, "n s"]) -> Float[np.ndarray, "m s"]:
    total = np.zeros((left.shape[1], right.shape[1]))
    for first in range(0, len(left), ROWS):
        rows = slice(first, first + ROWS)
        total += left[rows].T.astype(np.float64) @ (fine.mass[rows, None] * right[rows])
    return total


def reordered(
    stiffness: sp.csr_array, mass: Float[np.ndarray, " n"], order: Int[np.ndarray, " n"]
) -> tuple[sp.csr_array, Float[np.ndarray, " n"]]:
    """Return an operator with its points in another order."""
    moved = sp.csr_array(stiffness[order][:, order])
    moved.sort_indices()
    return moved, mass[order]
