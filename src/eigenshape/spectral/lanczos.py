"""Block Lanczos for the eigenvalues around a shift, with whatever was found before deflated."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float, Int

from eigenshape._errors import ConvergenceError
from eigenshape.spectral.factor import Factor
from eigenshape.spectral.pencil import Pencil

TOLERANCE = 5e-12  # of a residual, relative to the shift
FLOOR = 32 * float(np.finfo(np.float64).eps)  # of a residual, relative to the largest θ: rounding goes no lower
SHRUNK = 1e-2  # a column that projection shortened this much is projected once more
REPEATS = 5
NEGLIGIBLE = 1e-13  # a column this short against what it was is rounding: the space is invariant

Columns = Float[np.ndarray, "n b"]


@dataclass(frozen=True)
class Wanted:
    """What a run is to find: so many eigenvalues below the shift, so many above it in order, none past `ceiling`."""

    below: int
    above: int
    ceiling: float = np.inf


@dataclass(frozen=True, eq=False)
class Krylov:
    """A space V, the operator projected on it, and the block that continues it.

    (W - σB)⁻¹B V = V T + fresh C Eᵀ, with E the last columns of the identity.
    """

    vectors: Float[np.ndarray, "n m"]
    projected: Float[np.ndarray, "m m"]
    fresh: Columns
    coupling: Float[np.ndarray, "b b"]


@dataclass(frozen=True, eq=False)
class Ritz:
    """Eigenpairs of `Krylov.projected`: θ ascending, coefficients, values σ + 1/θ, and which of them have converged."""

    thetas: Float[np.ndarray, " m"]
    coefficients: Float[np.ndarray, "m m"]
    values: Float[np.ndarray, " m"]
    converged: Bool[np.ndarray, " m"]


def block_lanczos(
    pencil: Pencil,
    factor: Factor,
    wanted: Wanted,
    *,
    locked: Float[np.ndarray, "n l"],
    block: int,
    report: Callable[[float], None],
) -> Float[np.ndarray, "n j"]:
    """Return B-orthonormal eigenvectors around the shift, orthogonal to the B-orthonormal `locked`.

    Unrestarted block Lanczos on (W - σB)⁻¹B in the inner product of B (Grimes, Lewis and Simon 1994), every block
    orthogonalised against all before it. It stops when what the space has seen of `wanted` has converged; copies
    of an eigenvalue beyond the width of the block may be missing, which an inertia count tells afterwards.

    Raises
    ------
    ConvergenceError
        If the space has grown to four times what is wanted, or to all there is.
    """
    rng, first = np.random.default_rng(0), locked.shape[1]
    capacity = _capacity(pencil, wanted, first, block)
    basis = np.empty((pencil.n, first + capacity + block), order="F")  # pages are touched only as the space grows
    basis[:, :first] = locked
    projected = np.zeros((capacity, capacity))
    fresh, _, _ = _orthonormalise(pencil, basis[:, :first], rng.standard_normal((pencil.n, block)), rng)
    check = min(wanted.below + wanted.above, capacity // 4) + 2 * block
    for size in range(block, capacity + 1, block):
        filled = first + size
        basis[:, filled - block : filled] = fresh
        image = factor.solve(pencil.weigh(fresh))
        fresh, along, coupling = _orthonormalise(pencil, basis[:, :filled], image, rng)
        projected[:size, size - block : size] = along[first:]
        if size >= check:
            krylov = Krylov(basis[:, first:filled], projected[:size, :size], fresh, coupling)
            ritz = _ritz(krylov, factor.shift)
            chosen, missing = _choose(ritz, wanted)
            if not missing:
                return _vectors(krylov, ritz, chosen)
            check = size + min(max(missing // 2, size // 20, block), max(size // 4, block))
        report(size / (size + 0.6 * (wanted.below + wanted.above) + block))
    raise ConvergenceError(
        f"Block Lanczos must converge within {capacity} vectors; {missing} of {wanted.below + wanted.above} "
        f"eigenvalues did not. Repair nearly degenerate elements, or ask for fewer pairs."
    )


def _capacity(pencil: Pencil, wanted: Wanted, first: int, block: int) -> int:
    room = pencil.n - first - block
    most = 4 * (wanted.below + wanted.above) + 40 * block
    return max(min(room, most) // block, 1) * block


def _orthonormalise(
    pencil: Pencil, basis: Float[np.ndarray, "n m"], columns: Columns, rng: np.random.Generator
) -> tuple[Columns, Float[np.ndarray, "m b"], Float[np.ndarray, "b b"]]:
    """Split columns = basis @ along + fresh @ upper, with [basis, fresh] B-orthonormal.

    The recent blocks, which take most of a Lanczos image away, are projected out first, then all of them.
    """
    width = columns.shape[1]
    along = np.zeros((basis.shape[1], width))
    lengths = _lengths(columns, pencil.weigh(columns))
    recent = max(basis.shape[1] - 2 * width, 0)
    columns = _project(pencil, basis[:, recent:], columns, along[recent:])
    columns = _project(pencil, basis, columns, along)
    fresh, upper, short = _gram_schmidt(pencil, columns, lengths, rng)
    for _ in range(REPEATS):
        if not short:
            break
        again = np.zeros_like(along)
        fresh = _project(pencil, basis, fresh, again)
        fresh, second, short = _gram_schmidt(pencil, fresh, np.ones(width), rng)
        along += again @ upper
        upper = second @ upper
    return fresh, along, upper


def _project(
    pencil: Pencil, basis: Float[np.ndarray, "n m"], columns: Columns, along: Float[np.ndarray, "m b"]
) -> Columns:
    part = basis.T @ pencil.weigh(columns)
    along += part
    return columns - basis @ part


def _gram_schmidt(
    pencil: Pencil, columns: Columns, lengths: Float[np.ndarray, " b"], rng: np.random.Generator
) -> tuple[Columns, Float[np.ndarray, "b b"], bool]:
    """B-orthonormalise a block; a negligible column is replaced by a random one that the triangle R leaves out."""
    columns, width = np.array(columns, order="F"), columns.shape[1]
    upper, short = np.zeros((width, width)), False
    for i in range(width):
        for _ in range(2):
            weighed = pencil.weigh(columns[:, i : i + 1])
            part = columns[:, :i].T @ weighed
            columns[:, i : i + 1] -= columns[:, :i] @ part
            upper[:i, i] += part[:, 0]
        length = float(np.sqrt(columns[:, i] @ pencil.weigh(columns[:, i : i + 1])[:, 0]))
        short |= bool(length < SHRUNK * lengths[i])
        if length <= NEGLIGIBLE * lengths[i]:
            columns[:, i] = _random_unit(pencil, columns[:, :i], rng)
        else:
            columns[:, i] /= length
            upper[i, i] = length
    return columns, upper, short


def _random_unit(pencil: Pencil, against: Columns, rng: np.random.Generator) -> Float[np.ndarray, " n"]:
    column = rng.standard_normal((pencil.n, 1))
    for _ in range(2):
        column -= against @ (against.T @ pencil.weigh(column))
    return np.asarray(column[:, 0] / np.sqrt(column[:, 0] @ pencil.weigh(column)[:, 0]))


def _lengths(columns: Columns, weighed: Columns) -> Float[np.ndarray, " b"]:
    return np.sqrt(np.einsum("ij,ij->j", columns, weighed))


def _ritz(krylov: Krylov, shift: float) -> Ritz:
    thetas, coefficients = sl.eigh(krylov.projected, lower=False)
    block = len(krylov.coupling)
    values = shift + 1 / np.where(thetas == 0, np.finfo(np.float64).tiny, thetas)
    rests = np.linalg.norm(krylov.coupling @ coefficients[-block:], axis=0)
    residuals = rests * (values - shift) ** 2
    converged = (residuals <= TOLERANCE * abs(shift)) | (rests <= FLOOR * np.abs(thetas).max())
    return Ritz(thetas, coefficients, values, converged)


def _choose(ritz: Ritz, wanted: Wanted) -> tuple[Int[np.ndarray, " j"], int]:
    """Return the converged pairs of the window, and how many are still to converge."""
    above = np.flatnonzero(ritz.thetas > 0)[::-1]
    run = int(np.argmin(np.append(ritz.converged[above], False)))  # leading converged ones: nothing seen lies between
    passed = run > 0 and ritz.values[above[run - 1]] > wanted.ceiling
    late_above = 0 if passed else max(wanted.above - run, 0)
    seen = np.flatnonzero(ritz.thetas < 0)
    below = seen[ritz.converged[seen]][: wanted.below]
    # Copies that the space cannot see are left to a later run; one converged value above proves it has looked.
    goal = len(seen) if run else wanted.below
    late_below = max(min(goal, wanted.below) - len(below), 0)
    above = above[: min(run, wanted.above)]
    return np.concatenate([below, above[ritz.values[above] <= wanted.ceiling]]), late_above + late_below


def _vectors(krylov: Krylov, ritz: Ritz, chosen: Int[np.ndarray, " j"]) -> Float[np.ndarray, "n j"]:
    # One step of the operator takes the residual out of a Ritz vector y: A y / θ = y + fresh C s / θ, known already.
    weights = ritz.coefficients[:, chosen]
    block = len(krylov.coupling)
    return krylov.vectors @ weights + krylov.fresh @ (krylov.coupling @ weights[-block:] / ritz.thetas[chosen])
