"""Block Lanczos for the eigenvalues around a shift, with known eigenvectors deflated."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS, TINY, record
from certeig.kit.errors import ConvergenceError
from certeig.solver.chebyshev import ChebyshevFilter
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil
from certeig.sparse.basis import (
    Block,
    Slots,
    SparseRows,
    combine_columns,
    multiply,
    pack_columns,
    products,
    sparse_rows,
    subtract,
)
from certeig.sparse.basis_loops import LANES
from certeig.sparse.symmetric_factor import Scratch

# Residual of a converged pair, relative to the shift.
TOLERANCE = 5e-12
# Residual that rounding leaves, relative to the largest θ.
FLOOR = 32 * EPS
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


@record
class ShiftedInverse:
    """(W - σB)⁻¹B in an inner product in which it is symmetric.

    Where B is diagonal that is B^½ (W - σB)⁻¹ B^½ in the plain one, on u = B^½ φ, and nothing is
    weighed.
    """

    pencil: Pencil
    factor: Factor
    roots: Float[np.ndarray, "n 1"] | None
    mass: SparseRows
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
                multiply(self.mass, slot, image)
                self.factor.lower.solve_lanes(image, image, self.scratch)
            else:
                np.multiply(slot, self.roots, out=image)
                self.factor.lower.solve_lanes(image, image, self.scratch)
                np.multiply(image, self.roots, out=image)
        return images

    def weigh(self, block: Block) -> Block:
        """Return what the plain product with columns is the inner product with."""
        if self.roots is not None:
            return block
        weighed = np.empty_like(block)
        for slot, product in zip(block, weighed, strict=True):
            multiply(self.mass, slot, product)
        return weighed

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
        # A column without direction has θ = 0; even the square of 1/θ stays finite.
        sizes = np.maximum(np.abs(thetas), np.sqrt(TINY))
        distances = np.copysign(1 / sizes, thetas)
        return self.factor.shift + distances, distances**2


# What a Krylov space is made of: an operator, symmetric in some inner product, whose largest |θ|
# belong to the wanted eigenvalues of its pencil.
Operator: TypeAlias = ShiftedInverse | ChebyshevFilter


@dataclass(frozen=True)
class Wanted:
    """What a run has to find: the nearest eigenvalues, this many on each side of the shift, all within bounds."""

    below: int
    above: int
    floor: float = -np.inf
    ceiling: float = np.inf


@record
class RitzSpace:
    """A Krylov space V of an operator A, and the eigenpairs of A projected on it.

    A V = V (T + R) + F C Eᵀ, with T symmetric and block tridiagonal, and E the last columns of the
    identity. R is what projections on older blocks took away, the rounding of the recurrence; it
    lies above the blocks of T.

    Attributes
    ----------
    inner : Operator
        A.
    basis : (s, n, 8) float
        V, and F, the block that continues it.
    projected : (m, m) float
        The upper triangle of T + R.
    coupling : (b, b) float
        C.
    thetas : (m,) float
        Eigenvalues of T + R + Rᵀ, ascending.
    coefficients : (m, m) float
        Their eigenvectors.
    rests : (m,) float
        The lengths of their residuals.
    values : (m,) float
        What eigenvalue of the pencil each is.
    chosen : (j,) int
        The numbers of those that are wanted and have converged, by ascending eigenvalues.
    """

    inner: Operator
    basis: Slots
    projected: Float[np.ndarray, "m m"]
    coupling: Float[np.ndarray, "b b"]
    thetas: Float[np.ndarray, " m"]
    coefficients: Float[np.ndarray, "m m"]
    rests: Float[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    chosen: Int[np.ndarray, " j"]

    def lowest(self, count: int) -> Int[np.ndarray, " j"]:
        """Return the numbers of the Ritz pairs with the lowest eigenvalues, up to one that is not precise enough."""
        order = np.argsort(self.values, kind="stable")
        precise = self.rests <= PRECISE * np.abs(self.thetas)
        return order[: min(count, int(np.argmin(np.append(precise[order], False))))]

    def vectors(self, numbers: Int[np.ndarray, " j"]) -> Float[np.ndarray, "n j"]:
        """Return eigenvectors for some of the Ritz pairs."""
        block = len(self.coupling)
        weights, thetas = self.coefficients[:, numbers], self.thetas[numbers]

        # These are eigenvectors s of T + R + Rᵀ. To first order, those of T + R are without
        # Σ_i s_i (s_iᵀ Rᵀ s) / (θ - θ_i). Close neighbors stay skew, which `lowest_pairs` and
        # `polish` make good, as what is of second order.
        rows = np.arange(len(self.projected)) // block
        rounding = np.where(rows - rows[:, None] > 1, self.projected, 0.0)
        parts = self.coefficients.T @ (rounding.T @ weights)
        gaps = thetas - self.thetas[:, None]
        parts[np.abs(gaps) <= CLUSTERED * np.abs(thetas)] = 0.0
        weights = weights - self.coefficients @ np.divide(parts, gaps, out=parts, where=parts != 0)

        # One step of A takes the residual out of a Ritz vector y: A y / θ = y + F C s / θ, which
        # is known already.
        step = self.coupling @ weights[-block:] / thetas
        return self.inner.leave(combine_columns(self.basis, np.concatenate([weights, step])))


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

    Raises a ConvergenceError as `grow_space` does.
    """
    roots = np.sqrt(pencil.mass_diagonal)[:, None] if pencil.mass_floor == 1.0 else None
    inner = ShiftedInverse(pencil, factor, roots, sparse_rows(pencil.mass), factor.lower.scratch())
    found = grow_space(inner, wanted, locked=locked, groups=groups, report=report)
    return found.values[found.chosen], found.vectors(found.chosen)


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
    1994), in blocks of `groups` times eight columns. Copies of an eigenvalue beyond the width of
    the block may be missing, which an inertia count tells afterwards.

    Raises a ConvergenceError if the space has grown to four times what is wanted, or to all there
    is.
    """
    n, n_wanted = inner.pencil.n, wanted.below + wanted.above
    block = groups * LANES
    available = n - locked.shape[1] - block
    capacity = max(min(available, 4 * n_wanted + 40 * block) // block, 1) * block

    # The locked vectors, the space, and the block that continues it. Memory is touched only as the
    # space grows.
    first = -(-locked.shape[1] // LANES)
    space = np.empty((first + capacity // LANES + groups, n, LANES))
    space[:first] = pack_columns(inner.enter(locked))
    projected = np.zeros((capacity, capacity))
    rng = np.random.default_rng(0)
    start = rng.standard_normal((groups, n, LANES))
    _orthonormalize(inner, space[: first + groups], start, rng)

    skip, last_check = False, (0, n_wanted)
    check = min(8 * n_wanted // 5 + 8 * block, capacity)  # sooner they have never all converged
    for size in range(block, capacity + 1, block):
        filled = first + size // LANES
        image = inner.image(space[filled - groups : filled])
        along, coupling = _orthonormalize(inner, space[: filled + groups], image, rng, skip=skip)
        projected[:size, size - block : size] = along[first * LANES :]

        # Every second block is orthogonalized against two blocks only, where the one before lost
        # nearly nothing to older ones (Simon 1984). What that leaves in the recurrence is taken out
        # of the eigenvectors; but nothing could take out what is left of locked vectors.
        older = np.abs(along[: -2 * block])
        orthogonal = bool((older <= MOST_LOST * np.diag(coupling).min()).all())
        skip = orthogonal and not first and not skip

        if size >= check:
            basis = space[first : filled + groups]
            found, missing = _ritz_space(inner, basis, projected[:size, :size], coupling, wanted)
            if not missing:
                return found
            # What is missing falls nearly in proportion, and a check costs as much as a few blocks.
            size_before, missing_before = last_check
            pace = (missing_before - missing) / (size - size_before) if size_before else 1.0
            ahead = max(int(missing / max(pace, 0.5)), size // CHECK_SHARE, block)
            check = min(size + min(ahead, max(size // 4, block)), capacity)
            last_check = size, missing
        report(size / (size + 0.6 * n_wanted + block))
    raise ConvergenceError(
        f"Block Lanczos must converge within {capacity} vectors; {missing} of {n_wanted} eigenvalues did not. "
        f"{inner.pencil.advice.slow}"
    )


def _ritz_space(
    inner: Operator,
    basis: Slots,
    projected: Float[np.ndarray, "m m"],
    coupling: Float[np.ndarray, "b b"],
    wanted: Wanted,
) -> tuple[RitzSpace, int]:
    """Return a space with its Ritz pairs, and how many of those wanted are still to converge."""
    thetas, coefficients = sl.eigh(projected, lower=False)
    values, slopes = inner.values(thetas)
    rests = np.linalg.norm(coupling @ coefficients[-len(coupling) :], axis=0)
    # Converged as an eigenvalue of the pencil, or as far as rounding lets it.
    precise = rests <= FLOOR * np.abs(thetas).max()
    converged = (rests <= TOLERANCE * inner.size / slopes) | (precise & np.isfinite(values))

    # On either side of the shift, nearest first, only those count that no unconverged one is nearer
    # than: nothing seen lies between.
    above, below = np.flatnonzero(thetas > 0)[::-1], np.flatnonzero(thetas < 0)
    n_above, n_below = (
        int(np.argmin(np.append(converged[side], False))) for side in (above, below)
    )
    past_ceiling = n_above > 0 and values[above[n_above - 1]] > wanted.ceiling
    past_floor = n_below > 0 and values[below[n_below - 1]] < wanted.floor
    late_above = 0 if past_ceiling else max(wanted.above - n_above, 0)
    # Copies that the space cannot see are left to a later run; one converged value above proves it
    # has looked.
    goal = min(len(below), wanted.below) if n_above else wanted.below
    late_below = 0 if past_floor else max(goal - n_below, 0)

    chosen = np.concatenate(
        [below[: min(n_below, wanted.below)], above[: min(n_above, wanted.above)]]
    )
    within = (values[chosen] > wanted.floor) & (values[chosen] <= wanted.ceiling)
    chosen = chosen[within]
    chosen = chosen[np.argsort(values[chosen], kind="stable")]
    space = RitzSpace(
        inner, basis, projected, coupling, thetas, coefficients, rests, values, chosen
    )
    return space, late_above + late_below


def _orthonormalize(
    inner: Operator,
    space: Slots,
    columns: Block,
    rng: np.random.Generator,
    *,
    skip: bool = False,
) -> tuple[Float[np.ndarray, "m b"], Float[np.ndarray, "b b"]]:
    """Split columns = known along + fresh upper, with [known, fresh] = space orthonormal; return along and upper.

    The last slots of `space` are filled with what is fresh; the columns are used up.
    """
    groups, block = len(columns), len(columns) * LANES
    known, fresh = space[:-groups], space[-groups:]
    along, upper = np.zeros((len(known) * LANES, block)), np.eye(block)
    weighed = inner.weigh(columns)
    lengths = np.sqrt(np.einsum("gij,gij->gj", columns, weighed)).ravel()

    # The recent blocks take most of a Lanczos image away. Then all are projected out, or the recent
    # ones again where the others are to be skipped.
    recent = known[-2 * groups :]
    passes: tuple[Slots, ...] = (recent, recent if skip else known)
    for _ in range(1 + REPEATS):
        for near in passes:
            part = products(near, weighed)
            subtract(near, part, columns)
            along[len(along) - len(part) :] += part @ upper
            weighed = inner.weigh(columns)
        triangle, short = _gram_schmidt(inner, columns, weighed, fresh, lengths, rng)
        upper = triangle @ upper
        if not short:
            break
        # A column that became short has lost digits: once more, against all.
        columns[:] = fresh
        weighed = inner.weigh(columns)
        lengths, passes = np.ones(block), (known,)
    return along, upper


def _gram_schmidt(
    inner: Operator,
    columns: Block,
    weighed: Block,
    fresh: Block,
    lengths: Float[np.ndarray, " b"],
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "b b"], bool]:
    """Orthonormalize a block into `fresh`; return the triangle, and whether a column became short against what it was.

    By the Cholesky factor of the Gram matrix, twice where the first leaves digits to be gained
    (Yamamoto and others 2015), and column by column where it fails. The columns are used up;
    `weighed` is B times them, or what stands for it in the inner product.
    """
    width = len(lengths)
    upper, before = np.eye(width), lengths
    for _ in range(2):
        triangle = _cholesky(products(columns, weighed))
        if triangle is None:
            upper = _one_by_one(inner, columns, fresh, before, rng) @ upper
            break
        fresh[:] = 0.0
        subtract(columns, -sl.solve_triangular(triangle, np.eye(width)), fresh)
        upper = triangle @ upper
        if np.diag(upper).min() > INDEPENDENT_PIVOT * np.linalg.norm(upper, axis=0).max():
            break
        columns[:] = fresh
        weighed = inner.weigh(columns)
        before = np.ones(width)
    return upper, bool((np.diag(upper) < SHRUNK * lengths).any())


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
) -> Float[np.ndarray, "b b"]:
    """Orthonormalize a block column by column, each twice; return the triangle R.

    A negligible column is replaced by a random one that R leaves out, or by zeros if the others span all there is.
    """

    def weigh(column: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        weighed = inner.weigh(pack_columns(column[:, None]))  # in a slot of eight
        return np.ascontiguousarray(weighed[0, :, 0])

    def size_of(column: Float[np.ndarray, " n"]) -> float:
        # Rounding makes the square of what is nearly nothing negative.
        return float(np.sqrt(max(column @ weigh(column), 0.0)))

    columns, width = np.concatenate(list(block), axis=1), len(lengths)
    upper = np.zeros((width, width))
    for i in range(width):
        known = columns[:, :i]
        for _ in range(2):
            part = known.T @ weigh(columns[:, i])
            columns[:, i] -= known @ part
            upper[:i, i] += part
        length = size_of(columns[:, i])
        if length > NEGLIGIBLE * lengths[i]:
            columns[:, i] /= length
            upper[i, i] = length
            continue
        other = rng.standard_normal(len(columns))
        whole = size_of(other)
        for _ in range(2):
            other -= known @ (known.T @ weigh(other))
        length = size_of(other)
        columns[:, i] = other / length if length > NEGLIGIBLE * whole else 0.0
    fresh[:] = pack_columns(columns)
    return upper
