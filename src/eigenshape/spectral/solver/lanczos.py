"""Block Lanczos for the eigenvalues around a shift, with known eigenvectors deflated."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float, Int

from eigenshape._errors import ConvergenceError
from eigenshape.sparse.basis import Block, Slots, combine_columns, pack_columns, products, subtract
from eigenshape.sparse.lane_loops import LANES
from eigenshape.sparse.symmetric_factor import Scratch
from eigenshape.spectral.solver.factor import Factor
from eigenshape.spectral.solver.pencil import Pencil

# Residual of a converged pair, relative to the shift.
TOLERANCE = 5e-12
# Residual that rounding leaves, relative to the largest θ.
FLOOR = 32 * float(np.finfo(np.float64).eps)
# A column that projection shortens below this share of its length is projected once more.
SHRUNK = 1e-2
# Projections of a block at most.
REPEATS = 5
# A column that projection shortens to this share is rounding: the space is invariant.
NEGLIGIBLE = 1e-13
# A projection on older blocks is skipped if the one before took at most this share of a block away:
# eigenvectors are corrected to first order, and what is left is its square.
MOST_LOST = 1e-6
# Distance of two θ, relative to them, below which one eigenvector is not corrected by the other.
CLUSTERED = 1e-6
# Residual of a Ritz vector, relative to θ, up to which it is orthogonal to the others after a step of
# the operator, up to the square.
PRECISE = 1e-6
# A space grows by at least this part of itself before it is checked again.
CHECK_SHARE = 16
# Pivots of a Gram matrix, relative to lengths: below this one Cholesky has lost too many digits,
DEPENDENT_PIVOT = 1e-4
# and above this one none.
INDEPENDENT_PIVOT = 0.1


@runtime_checkable
class Operator(Protocol):
    """What a Krylov space is made of: an operator, symmetric in some inner product, whose largest θ are wanted."""

    @property
    def pencil(self) -> Pencil:
        """The pencil whose eigenvectors are wanted."""

    @property
    def size(self) -> float:
        """The size of the wanted eigenvalues of the pencil, which residuals are compared with."""

    def image(self, block: Block) -> Block:
        """Return the operator's image of each slot."""

    def weigh(self, block: Float[np.ndarray, "g n b"]) -> Float[np.ndarray, "g n b"]:
        """Return what the plain product with columns is the inner product with."""

    def enter(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return the operator's vectors u for those of the pencil, φ."""

    def leave(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return φ for u, which is used up."""

    def values(
        self, thetas: Float[np.ndarray, " m"]
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return the eigenvalues λ of the pencil for θ, and |dλ/dθ| there; both infinite where θ tells none."""


@dataclass(frozen=True, eq=False)
class ShiftedInverse:
    """(W - σB)⁻¹B in an inner product in which it is symmetric.

    Where B is diagonal that is B^½ (W - σB)⁻¹ B^½ in the plain one, on u = B^½ φ, and nothing is
    weighed.
    """

    pencil: Pencil
    factor: Factor
    roots: Float[np.ndarray, "n 1"] | None
    scratch: Scratch

    @property
    def size(self) -> float:
        """|σ|, since eigenvalues near the shift are wanted."""
        return abs(self.factor.shift)

    def image(self, block: Block) -> Block:
        """Return the operator's image of each slot."""
        images = np.empty_like(block)
        for slot, image in zip(block, images, strict=True):
            if self.roots is None:
                self.factor.lower.solve_lanes(self.pencil.weigh(slot), image, self.scratch)
            else:
                np.multiply(slot, self.roots, out=image)
                self.factor.lower.solve_lanes(image, image, self.scratch)
                np.multiply(image, self.roots, out=image)
        return images

    def weigh(self, block: Float[np.ndarray, "g n b"]) -> Float[np.ndarray, "g n b"]:
        """Return what the plain product with columns is the inner product with."""
        return (
            block
            if self.roots is not None
            else np.stack([self.pencil.weigh(slot) for slot in block])
        )

    def enter(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return u for φ."""
        return vectors if self.roots is None else vectors * self.roots

    def leave(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return φ for u, in its place."""
        if self.roots is not None:
            vectors /= self.roots
        return vectors

    def values(
        self, thetas: Float[np.ndarray, " m"]
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return λ = σ + 1/θ, and 1/θ²."""
        distances = 1 / np.where(thetas == 0, np.finfo(np.float64).tiny, thetas)
        return self.factor.shift + distances, distances**2


def shifted_inverse(pencil: Pencil, factor: Factor) -> ShiftedInverse:
    """Choose the inner product, and allocate the memory for the solves of one run."""
    roots = np.sqrt(pencil.mass_diagonal)[:, None] if pencil.mass_floor == 1.0 else None
    return ShiftedInverse(pencil, factor, roots, factor.lower.scratch())


@dataclass(frozen=True)
class Wanted:
    """What a run has to find: the nearest eigenvalues, this many on each side of the shift, all within bounds."""

    below: int
    above: int
    floor: float = -np.inf
    ceiling: float = np.inf


@dataclass(frozen=True, eq=False)
class Krylov:
    """A space V, the operator projected on it, and the block that continues it.

    (W - σB)⁻¹B V = V (T + R) + fresh C Eᵀ, with T symmetric and block tridiagonal, and E the last
    columns of the identity. R is what projections on older blocks took away, the rounding of the
    recurrence: `projected` holds the upper triangle of T + R, and R lies above the blocks of T.
    """

    space: Slots
    projected: Float[np.ndarray, "m m"]
    coupling: Float[np.ndarray, "b b"]

    def rounding(self) -> Float[np.ndarray, "m m"]:
        """Return R."""
        rows = np.arange(len(self.projected)) // len(self.coupling)
        return np.where(rows - rows[:, None] > 1, self.projected, 0.0)


@dataclass(frozen=True, eq=False)
class Ritz:
    """Eigenpairs of `Krylov.projected`, and what they are of the pencil.

    θ ascending, coefficients, lengths of their residuals, eigenvalues λ, and which have converged.
    """

    thetas: Float[np.ndarray, " m"]
    coefficients: Float[np.ndarray, "m m"]
    rests: Float[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    converged: Bool[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class RitzSpace:
    """A Krylov space, its Ritz pairs, and the numbers of those that were wanted, by ascending eigenvalues."""

    inner: Operator
    krylov: Krylov
    ritz: Ritz
    chosen: Int[np.ndarray, " j"]

    def lowest(self, count: int) -> Int[np.ndarray, " j"]:
        """Return the numbers of the Ritz pairs with the lowest eigenvalues, up to one that is not precise enough."""
        order = np.argsort(self.ritz.values, kind="stable")
        precise = self.ritz.rests <= PRECISE * np.abs(self.ritz.thetas)
        return order[: min(count, int(np.argmin(np.append(precise[order], False))))]

    def vectors(self, numbers: Int[np.ndarray, " j"]) -> Float[np.ndarray, "n j"]:
        """Return eigenvectors for some of the Ritz pairs."""
        return self.inner.leave(_vectors(self.krylov, self.ritz, numbers))


def block_lanczos(
    pencil: Pencil,
    factor: Factor,
    wanted: Wanted,
    *,
    locked: Float[np.ndarray, "n l"],
    groups: int = 1,
    report: Callable[[float], None],
) -> tuple[Float[np.ndarray, " j"], Float[np.ndarray, "n j"]]:
    """Return eigenvalues around the shift of a factor, ascending, and eigenvectors, orthogonal to `locked`.

    They are B-orthonormal to more than half of the digits, and `lowest_pairs` makes them so to all.

    Raises
    ------
    ConvergenceError
        If the space has grown to four times what is wanted, or to all there is.
    """
    inner = shifted_inverse(pencil, factor)
    found = grow_space(inner, wanted, locked=locked, groups=groups, report=report)
    return found.ritz.values[found.chosen], found.vectors(found.chosen)


def grow_space(
    inner: Operator,
    wanted: Wanted,
    *,
    locked: Float[np.ndarray, "n l"],
    groups: int = 1,
    report: Callable[[float], None],
) -> RitzSpace:
    """Return a Krylov space, orthogonal to `locked`, in which what it has seen of `wanted` has converged.

    The columns of `locked` are B-orthonormal. Unrestarted block Lanczos (Grimes, Lewis and Simon
    1994), in blocks of `groups` times eight columns. Where nothing is locked, every second block is
    orthogonalized against all before it, the others against two (Simon 1984), and what that leaves
    in the recurrence is taken out of the eigenvectors. Copies of an eigenvalue beyond the width of the block may be
    missing, which an inertia count tells afterwards.

    Raises
    ------
    ConvergenceError
        If the space has grown to four times what is wanted, or to all there is.
    """
    pencil = inner.pencil
    rng, first, block = np.random.default_rng(0), -(-locked.shape[1] // LANES), groups * LANES
    capacity = _capacity(pencil, wanted, locked.shape[1], block)
    space = np.empty(
        (first + capacity // LANES + groups, pencil.n, LANES)
    )  # pages are touched only as it grows
    space[:first] = pack_columns(inner.enter(locked))
    projected = np.zeros((capacity, capacity))
    _orthonormalize(
        inner, space[: first + groups], rng.standard_normal((groups, pencil.n, LANES)), rng
    )
    missing = wanted.below + wanted.above
    check = min(8 * missing // 5 + 8 * block, capacity)  # sooner they have never all converged
    seen: list[tuple[int, int]] = []
    skip = False
    for size in range(block, capacity + 1, block):
        filled = first + size // LANES
        image = inner.image(space[filled - groups : filled])
        along, coupling = _orthonormalize(inner, space[: filled + groups], image, rng, skip=skip)
        projected[:size, size - block : size] = along[first * LANES :]
        # What is left of locked vectors is in no recurrence, so that nothing could take it out.
        skip = not (first or skip) and _stays_orthogonal(along, coupling)
        if size >= check:
            krylov = Krylov(space[first : filled + groups], projected[:size, :size], coupling)
            ritz = _ritz(krylov, inner)
            chosen, missing = _choose(ritz, wanted)
            if not missing:
                chosen = chosen[np.argsort(ritz.values[chosen], kind="stable")]
                return RitzSpace(inner, krylov, ritz, chosen)
            seen.append((size, missing))
            check = min(size + _until_next_check(seen, block), capacity)
        report(size / (size + 0.6 * (wanted.below + wanted.above) + block))
    raise ConvergenceError(
        f"Block Lanczos must converge within {capacity} vectors; {missing} of {wanted.below + wanted.above} "
        f"eigenvalues did not. Repair nearly degenerate elements, or request fewer pairs."
    )


def _until_next_check(seen: list[tuple[int, int]], block: int) -> int:
    """Return how far the space grows before the next check, given its sizes and what was missing at them.

    What is missing falls nearly in proportion. A check costs as much as a few blocks.
    """
    size, missing = seen[-1]
    pace = (seen[-2][1] - missing) / (size - seen[-2][0]) if len(seen) > 1 else 1.0
    expected = int(missing / max(pace, 0.5))
    return min(max(expected, size // CHECK_SHARE, block), max(size // 4, block))


def _capacity(pencil: Pencil, wanted: Wanted, n_locked: int, block: int) -> int:
    available = pencil.n - n_locked - block
    most = 4 * (wanted.below + wanted.above) + 40 * block
    return max(min(available, most) // block, 1) * block


def _stays_orthogonal(along: Float[np.ndarray, "m b"], upper: Float[np.ndarray, "b b"]) -> bool:
    """Return whether a block came out nearly orthogonal to those before the last two."""
    older = np.abs(along[: -2 * len(upper)])
    return bool((older <= MOST_LOST * np.diag(upper).min()).all())


def _orthonormalize(
    inner: Operator,
    space: Slots,
    columns: Block,
    rng: np.random.Generator,
    *,
    skip: bool = False,
) -> tuple[Float[np.ndarray, "m b"], Float[np.ndarray, "b b"]]:
    """Split columns = known along + fresh upper, with [known, fresh] = space orthonormal; return along and upper.

    The last slots of `space` are filled with what is fresh; the columns are used up. The recent
    blocks, which take most of a Lanczos image away, are projected out first, then all of them, or
    the recent ones again where the others are to be skipped and no column became short.
    """
    groups, block = len(columns), len(columns) * LANES
    known, fresh = space[:-groups], space[-groups:]
    recent = known[-2 * groups :]
    along = np.zeros((len(known) * LANES, block))
    lengths = np.sqrt(np.einsum("gij,gij->gj", columns, inner.weigh(columns))).ravel()
    for near in (recent, recent if skip else known):
        along[(len(known) - len(near)) * LANES :] += _project(inner, near, columns)
    upper, short = _gram_schmidt(inner, columns, fresh, lengths, rng)
    for _ in range(REPEATS):
        if not short:
            break
        columns[:] = fresh
        again = _project(inner, known, columns)
        second, short = _gram_schmidt(inner, columns, fresh, np.ones(block), rng)
        along += again @ upper
        upper = second @ upper
    return along, upper


def _project(inner: Operator, space: Slots, columns: Block) -> Float[np.ndarray, "m b"]:
    part = products(space, inner.weigh(columns))
    subtract(space, part, columns)
    return part


def _gram_schmidt(
    inner: Operator,
    columns: Block,
    fresh: Block,
    lengths: Float[np.ndarray, " b"],
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "b b"], bool]:
    """Orthonormalize a block into `fresh`; return the triangle, and whether a column became short against what it was.

    By the Cholesky factor of the Gram matrix, twice where the first leaves digits to be gained
    (Yamamoto and others 2015), and column by column where it fails. The columns are used up.
    """
    upper = _by_cholesky(inner, columns, fresh)
    if upper is None:
        return _one_by_one(inner, columns, fresh, lengths, rng)
    if np.diag(upper).min() <= INDEPENDENT_PIVOT * np.linalg.norm(upper, axis=0).max():
        columns[:] = fresh
        second = _by_cholesky(inner, columns, fresh)
        if second is None:
            second, _ = _one_by_one(inner, columns, fresh, np.ones(len(lengths)), rng)
        upper = second @ upper
    return upper, bool((np.diag(upper) < SHRUNK * lengths).any())


def _by_cholesky(inner: Operator, columns: Block, fresh: Block) -> Float[np.ndarray, "b b"] | None:
    triangle = _cholesky(products(columns, inner.weigh(columns)))
    if triangle is not None:
        fresh[:] = 0.0
        subtract(columns, -sl.solve_triangular(triangle, np.eye(len(triangle))), fresh)
    return triangle


def _cholesky(gram: Float[np.ndarray, "b b"]) -> Float[np.ndarray, "b b"] | None:
    """Return the triangle R with RᵀR = gram, or None where the columns are too much alike."""
    sizes = np.sqrt(np.maximum(np.diag(gram), 0))
    if not sizes.all():
        return None
    try:
        triangle = sl.cholesky(gram / np.outer(sizes, sizes))
    except np.linalg.LinAlgError:
        return None
    return triangle * sizes if np.diag(triangle).min() > DEPENDENT_PIVOT else None


def _one_by_one(
    inner: Operator,
    block: Block,
    fresh: Block,
    lengths: Float[np.ndarray, " b"],
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "b b"], bool]:
    """Orthonormalize a block; a negligible column is replaced by a random one that the triangle R leaves out."""
    columns, width = np.concatenate(list(block), axis=1), len(lengths)
    upper, short = np.zeros((width, width)), False
    for i in range(width):
        for _ in range(2):
            part = columns[:, :i].T @ _weigh(inner, columns[:, i])
            columns[:, i] -= columns[:, :i] @ part
            upper[:i, i] += part
        length = float(np.sqrt(columns[:, i] @ _weigh(inner, columns[:, i])))
        short |= bool(length < SHRUNK * lengths[i])
        if length <= NEGLIGIBLE * lengths[i]:
            columns[:, i] = _random_unit(inner, columns[:, :i], rng)
        else:
            columns[:, i] /= length
            upper[i, i] = length
    fresh[:] = pack_columns(columns)
    return upper, short


def _random_unit(
    inner: Operator, against: Float[np.ndarray, "n b"], rng: np.random.Generator
) -> Float[np.ndarray, " n"]:
    column = rng.standard_normal(len(against))
    for _ in range(2):
        column -= against @ (against.T @ _weigh(inner, column))
    return np.asarray(column / np.sqrt(column @ _weigh(inner, column)))


def _weigh(inner: Operator, column: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return inner.weigh(column[None, :, None])[0, :, 0]


def _ritz(krylov: Krylov, inner: Operator) -> Ritz:
    thetas, coefficients = sl.eigh(krylov.projected, lower=False)
    block = len(krylov.coupling)
    values, slopes = inner.values(thetas)
    rests = np.linalg.norm(krylov.coupling @ coefficients[-block:], axis=0)
    precise = rests <= FLOOR * np.abs(thetas).max()
    converged = (rests <= TOLERANCE * inner.size / slopes) | (precise & np.isfinite(values))
    return Ritz(thetas, coefficients, rests, values, converged)


def _choose(ritz: Ritz, wanted: Wanted) -> tuple[Int[np.ndarray, " j"], int]:
    """Return the converged pairs of the window, and how many are still to converge.

    On either side only those count that no unconverged one is nearer than: nothing seen lies
    between.
    """
    above, below = np.flatnonzero(ritz.thetas > 0)[::-1], np.flatnonzero(ritz.thetas < 0)
    n_above, n_below = (
        int(np.argmin(np.append(ritz.converged[side], False))) for side in (above, below)
    )
    past_ceiling = n_above > 0 and ritz.values[above[n_above - 1]] > wanted.ceiling
    past_floor = n_below > 0 and ritz.values[below[n_below - 1]] < wanted.floor
    late_above = 0 if past_ceiling else max(wanted.above - n_above, 0)
    # Copies that the space cannot see are left to a later run; one converged value above proves it
    # has looked.
    goal = min(len(below), wanted.below) if n_above else wanted.below
    late_below = 0 if past_floor else max(goal - n_below, 0)
    above, below = above[: min(n_above, wanted.above)], below[: min(n_below, wanted.below)]
    chosen = np.concatenate([below, above])
    return chosen[
        (ritz.values[chosen] > wanted.floor) & (ritz.values[chosen] <= wanted.ceiling)
    ], late_above + late_below


def _vectors(krylov: Krylov, ritz: Ritz, chosen: Int[np.ndarray, " j"]) -> Float[np.ndarray, "n j"]:
    # One step of the operator takes the residual out of a Ritz vector y: A y / θ = y + fresh C s /
    # θ, known already.
    weights = _corrected(krylov, ritz, chosen)
    step = krylov.coupling @ weights[-len(krylov.coupling) :] / ritz.thetas[chosen]
    return combine_columns(krylov.space, np.concatenate([weights, step]))


def _corrected(
    krylov: Krylov, ritz: Ritz, chosen: Int[np.ndarray, " j"]
) -> Float[np.ndarray, "m j"]:
    """Return coefficients of eigenvectors of T + R, to first order in R.

    Those of `ritz` are of T + R + Rᵀ, so s loses Σ_i s_i (s_iᵀ Rᵀ s) / (θ - θ_i). Close neighbors
    stay skew to second order, which `lowest_pairs` and `polish` make good.
    """
    weights, thetas = ritz.coefficients[:, chosen], ritz.thetas[chosen]
    parts = ritz.coefficients.T @ (krylov.rounding().T @ weights)
    gaps = thetas - ritz.thetas[:, None]
    parts[np.abs(gaps) <= CLUSTERED * np.abs(thetas)] = 0.0
    return weights - ritz.coefficients @ np.divide(parts, gaps, out=parts, where=parts != 0)
