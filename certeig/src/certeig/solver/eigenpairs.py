"""Eigenpairs inside the solver: orthonormalized, sorted, refined."""

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float, Float32, Int

from certeig.kit.arrays import record
from certeig.kit.errors import ConvergenceError
from certeig.kit.threads import map_in_threads, share_units
from certeig.solver.factor import Factor
from certeig.solver.pencil import (
    Pencil,
    column_chunks,
    gram_columns,
    rayleigh_residuals,
)

# Largest entry of |ΦᵀBΦ - I| that needs no correction.
LOOSE = 1e-12
# Largest entry that one Newton step corrects to rounding, since its error is the square,
ONE_STEP = 1e-6
# and largest one from which these steps lead to rounding; copies are beyond it.
SKEW, NEWTON_STEPS = 0.03, 4
# Columns before one that it may lean on: more than a slice has.
LEANING_COLUMNS = 384
# Rows that are corrected at once.
CORRECTED_ROWS = 512
# Residual, relative to the largest eigenvalue, above which a pair takes one more solve.
POLISHED = 2e-10


@record
class Pairs:
    """Eigenpairs in a pencil's units, ascending, with residual bounds."""

    values: Float[np.ndarray, " k"]
    vectors: Float[np.ndarray, "n k"]
    residuals: Float[np.ndarray, " k"]

    def select(self, chosen: slice | Bool[np.ndarray, " k"] | Int[np.ndarray, " j"]) -> "Pairs":
        """Return some of the pairs."""
        return Pairs(self.values[chosen], self.vectors[:, chosen], self.residuals[chosen])

    @property
    def error_bound(self) -> float:
        """Bound the distance of the values to eigenvalues, matched one to one (Kahan 1967)."""
        return float(np.linalg.norm(self.residuals))


def polish(pencil: Pencil, factor: Factor, pairs: Pairs) -> Pairs:
    """Refine the pairs whose residuals are large because of rounding.

    Neighbors that are mixed are separated by Rayleigh and Ritz among these pairs. Then one step of
    (W - σB)⁻¹ on a residual gives the error of the vector outside the space of all vectors.
    """
    late = np.flatnonzero(pairs.residuals > POLISHED * np.abs(pairs.values).max(initial=0.0))
    if not late.size:
        return pairs
    values, vectors, residuals = pairs.values.copy(), pairs.vectors.copy(), pairs.residuals.copy()
    images = pencil.stiffness @ vectors[:, late]
    values[late], rotation = sl.eigh(vectors[:, late].T @ images)
    vectors[:, late] = part = vectors[:, late] @ rotation
    step = factor.solve(images @ rotation - pencil.weigh(part) * values[late])
    vectors[:, late] -= step - vectors @ (vectors.T @ pencil.weigh(step))
    values[late], residuals[late] = rayleigh_residuals(pencil, vectors[:, late])
    order = np.argsort(values, kind="stable")
    return Pairs(values, vectors, residuals).select(order)


def lowest_pairs(
    pencil: Pencil,
    vectors: Float[np.ndarray, "n j"],
    k: int,
    near: Float[np.ndarray, " j"] | None = None,
) -> Pairs:
    """Return the k lowest eigenpairs of nearly B-orthonormal vectors, by their Rayleigh quotients.

    The vectors are used up. What they nearly are may be given where B is diagonal.
    """
    width = vectors.shape[1]
    chunks = column_chunks(width)
    starts = [max(columns.start - LEANING_COLUMNS, 0) for columns in chunks]
    for _ in range(NEWTON_STEPS):
        offs = map_in_threads(
            lambda place: gram_columns(pencil, vectors, *place), zip(chunks, starts, strict=True)
        )
        off = max((float(np.abs(each).max()) for each in offs), default=0.0)
        if off < LOOSE:
            break
        if not off <= SKEW:
            raise ConvergenceError(
                f"Vectors of different runs must be B-orthogonal; two are off by {off:.1e}."
            )
        gram = np.zeros((width, width), np.float32)  # a correction needs few digits
        for columns, start, each in zip(chunks, starts, offs, strict=True):
            gram[start : columns.stop, columns] = each
            gram[columns, start : columns.start] = each[: columns.start - start].T
        _subtract_half(vectors, gram, chunks)
        if off <= ONE_STEP:
            break
    values, residuals = rayleigh_residuals(pencil, vectors, near)
    order = np.argsort(values, kind="stable")[:k]
    if not np.array_equal(order, np.arange(vectors.shape[1])):
        vectors = vectors[:, order]
    return Pairs(values[order], vectors, residuals[order])


def _subtract_half(
    vectors: Float[np.ndarray, "n k"], gram: Float32[np.ndarray, "k k"], chunks: list[slice]
) -> None:
    """Subtract half of the product of columns and a banded matrix from them, in single precision.

    In place, since touching new memory costs as much as the products.
    """

    def correct(share: tuple[int, int]) -> None:
        rows = vectors[slice(*share)]
        short = rows.astype(np.float32)
        step = np.empty_like(short)
        for columns in chunks:
            near = slice(max(columns.start - LEANING_COLUMNS, 0), columns.stop + LEANING_COLUMNS)
            np.matmul(short[:, near], gram[near, columns], out=step[:, columns])
        step *= 0.5
        rows -= step

    map_in_threads(correct, share_units(len(vectors), CORRECTED_ROWS, len(vectors)))
