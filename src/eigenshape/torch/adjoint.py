"""The equations of the gradient of eigenvectors, solved beside the pairs that are known."""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from certeig.kit.arrays import record
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.solver.certify import RESOLUTION
from certeig.solver.pencil import Pencil
from certeig.solver.shift import factorize_near
from eigenshape.operators.laplacian import Laplacian

# Equations that are solved with one factor: two times the lanes of a factor. Fewer take more
# factors, more take more iterations since the shift is farther from their eigenvalues.
COLUMNS_AT_ONCE = 16
# Residual at which conjugate gradients stop, relative to the right-hand side,
SOLVED = 1e-8
# and their iterations at most. Seven are usual.
MOST_ITERATIONS = 200
# Rounding adds a little of the known pairs to each direction, and near the shift it grows by a factor
# of up to 16 an iteration. It is taken out each time for so many pairs on both sides,
NEIGHBORS = 8
# and for all pairs, which takes as long as the solves, after so many iterations.
CLEANED_EVERY = 8
# Parts of a gradient that differ by less than this share count as equal: first derivatives of a
# smooth function at two eigenvalues of a group, which differ by 1e-6, do.
EQUAL_SHARES = 1e-4
# How much of a gradient may depend on the basis of a group: the rounding of single precision.
INVARIANT = 1e-6


def find_groups(values: Float[np.ndarray, " k"]) -> list[slice]:
    """Divide ascending eigenvalues into groups whose neighbors differ by 1e-6 of the largest or less."""
    cuts = np.flatnonzero(np.diff(values) > RESOLUTION * values[-1]) + 1
    return [slice(start, stop) for start, stop in pairwise([0, *cuts.tolist(), len(values)])]


@record
class SolvedPencil:
    """An operator with its lowest pairs, the first of which are shown.

    Attributes
    ----------
    laplacian : Laplacian
    pencil : Pencil
        The operator in the units of the solver, with its order of elimination.
    values : (K,) float
    vectors : (n, K) float
    groups : list of slice
        Of all K values.
    n_shown : int
        Pairs that have gradients, k ≤ K.
    """

    laplacian: Laplacian
    pencil: Pencil
    values: Float[np.ndarray, " K"]
    vectors: Float[np.ndarray, "n K"]
    groups: list[slice]
    n_shown: int

    def numbers(self) -> np.ndarray:
        """Return the group of each value."""
        sizes = [each.stop - each.start for each in self.groups]
        return np.repeat(np.arange(len(sizes)), sizes)

    def same_group(self) -> Bool[np.ndarray, "k k"]:
        """Return which of the shown pairs are in one group."""
        numbers = self.numbers()[: self.n_shown]
        return numbers[:, None] == numbers

    def require_sums(self, by_value: Float[np.ndarray, " k"]) -> None:
        """Raise an error if a function of eigenvalues depends on more than the sum of a group."""
        for group in self.groups:
            part = by_value[group]
            if len(part) > 1 and np.ptp(part) > EQUAL_SHARES * np.abs(part).max():
                raise InvalidParameterError(
                    "Eigenvalues that are not separated are differentiated by their sum; "
                    f"{self._name(group)}, and the gradient asks for each. Use their sum or mean, "
                    "a signature of eigenshape.torch, or a shape without the symmetry."
                )

    def require_whole(
        self, by_level: Float[np.ndarray, "k k"], by_vector: Float[np.ndarray, "n k"] | None
    ) -> None:
        """Raise an error if a gradient concerns a group that is not shown completely."""
        last = self.groups[self.numbers()[self.n_shown - 1]]
        # A group that ends with the last pair known may go on after it.
        ends_here = last.stop == len(self.values) < self.laplacian.n_points
        if last.stop <= self.n_shown and not ends_here:
            return
        concerned = by_level[last].any() or (by_vector is not None and by_vector[:, last].any())
        if concerned:
            more = f"k={last.stop} or more" if not ends_here else "a larger k"
            raise InvalidParameterError(
                "A group of eigenvalues must be complete to be differentiated; "
                f"{self._name(last)}, and k={self.n_shown} cuts it. Solve for k={last.start} or "
                f"{more}, or leave out eigenvalues from number {last.start} on."
            )

    def require_invariant(
        self,
        by_vector: Float[np.ndarray, "n k"],
        by_level: Float[np.ndarray, "k k"],
        products: Float[np.ndarray, "K k"],
    ) -> None:
        """Raise an error if a function depends on the basis of a group.

        A turn of the basis by an antisymmetric matrix A takes Φ to Φ + ΦA and Λ to Λ + ΛA - AΛ.
        `products` are ΦᵀG of the gradient G by the vectors.
        """
        for group in self.groups:
            part = products[group, group]
            if part.shape[1] < 2:
                continue
            levels = self.values[group][: part.shape[1]]
            turned = 2 * by_level[group, group] * (levels[:, None] - levels)
            turns = np.abs(part - part.T + turned).max()
            terms = np.abs(self.vectors[:, group]).T @ np.abs(by_vector[:, group])
            if turns > INVARIANT * terms.max():
                raise InvalidParameterError(
                    "Eigenvectors that are not separated are differentiated by their projector "
                    f"Φ Φᵀ; {self._name(group)}, and the gradient depends on their basis. Use the "
                    "projector, a signature of eigenshape.torch, or a shape without the symmetry."
                )

    def _name(self, group: slice) -> str:
        values = self.values[group]
        gap = float(np.diff(values).max())
        return (
            f"numbers {group.start} to {group.stop - 1} lie near {values.mean():.9g} with gaps of "
            f"at most {gap:.2g}"
        )


@one_blas_thread()
def pull_back(
    solved: SolvedPencil, by_vector: Float[np.ndarray, "n k"], by_level: Float[np.ndarray, "k k"]
) -> tuple[Float[np.ndarray, "n k"], Float[np.ndarray, "n k"]]:
    """Return U and V such that the gradients by W and B are the symmetric parts of UΦᵀ and VΦᵀ.

    G, the gradient by the vectors, is `by_vector`. With R_ji = φ_jᵀg_i / (λ_i - λ_j) for the known
    pairs outside of the group of i, and z_i the solution of (W - λ_i B) z_i = BΦΦᵀg_i - g_i beyond all
    known pairs, u_i = Φ r_i + z_i. V = -UΛ - Φ S / 2 with S_ji = φ_jᵀg_i inside of groups, since
    ΦᵀBΦ = I.

    Raises an InvalidParameterError if the function depends on the basis of a group, and a
    ConvergenceError if the equations cannot be solved.
    """
    k = solved.n_shown
    products = solved.vectors.T @ by_vector
    solved.require_invariant(by_vector, by_level, products)
    numbers = solved.numbers()
    inside = numbers[:, None] == numbers[:k]
    gaps = solved.values[:k] - solved.values[:, None]
    mixed = np.where(inside, 0.0, products / np.where(inside, 1.0, gaps))
    outside, known = _solve_outside(solved, by_vector, products)
    by_stiffness = outside + solved.vectors @ (mixed - known)
    turned = solved.vectors @ np.where(inside, products, 0.0)
    return by_stiffness, -by_stiffness * solved.values[:k] - turned / 2


def _solve_outside(
    solved: SolvedPencil, by_vector: Float[np.ndarray, "n k"], products: Float[np.ndarray, "K k"]
) -> tuple[Float[np.ndarray, "n k"], Float[np.ndarray, "K k"]]:
    """Solve (W - λ_i B) z_i = BΦΦᵀg_i - g_i for z_i orthogonal to all known pairs.

    Return y and the coefficients of the little that rounding left of the known pairs: z = y - Φ ΦᵀBy.

    Conjugate gradients: beyond the known pairs W - λ_i B is positive definite, and so is the factor
    of W - σB with σ below the last known eigenvalue, which serves as preconditioner.
    """
    bases, W, B = solved.vectors, solved.laplacian.stiffness, solved.laplacian.mass
    n, n_known = bases.shape
    found = np.zeros_like(by_vector)
    if n_known == n:
        return found, np.zeros_like(products)
    weighed = B @ bases
    right = weighed @ products - by_vector
    lumped = solved.pencil.mass_floor == 1.0
    masses = B.diagonal()[:, None] if lumped else B
    for start in range(0, solved.n_shown, COLUMNS_AT_ONCE):
        columns = slice(start, min(start + COLUMNS_AT_ONCE, solved.n_shown))
        numbers, values = np.arange(columns.start, columns.stop), solved.values[columns]
        rest = right[:, columns].copy()
        if not rest.any():
            continue
        factor = factorize_near(solved.pencil, _shift_near(solved, columns))
        goal = SOLVED**2 * _dots(rest, rest)
        solution, direction, slope = np.zeros_like(rest), np.zeros_like(rest), np.ones(len(values))
        beside = slice(max(start - NEIGHBORS, 0), columns.stop + NEIGHBORS)
        for iteration in range(MOST_ITERATIONS):
            # Columns near the shift are solved first, and no more is computed of them; some were 0.
            is_open = _dots(rest, rest) > goal
            if not is_open.all():
                found[:, numbers[~is_open]] = solution[:, ~is_open]
                numbers = numbers[is_open]
                values, goal, slope = values[is_open], goal[is_open], slope[is_open]
                rest, solution, direction = (
                    np.ascontiguousarray(each[:, is_open]) for each in (rest, solution, direction)
                )
            if not numbers.size:
                break
            near = factor.solve(rest)
            last, slope = slope, _dots(near, rest)
            direction *= slope / last
            direction += near
            is_due = (iteration + 1) % CLEANED_EVERY == 0
            known = slice(0, n_known) if is_due else beside
            direction -= bases[:, known] @ (weighed[:, known].T @ direction)
            scaled = direction * values
            image = W @ direction
            if lumped:
                scaled *= masses
                image -= scaled
            else:
                image -= masses @ scaled
            step = slope / _dots(direction, image)
            solution += np.multiply(direction, step, out=scaled)
            image *= step
            rest -= image
        else:
            raise ConvergenceError(
                "The equations of a gradient must converge; those of eigenvalues "
                f"{columns.start} to {columns.stop - 1} have {len(numbers)} residuals above "
                f"{SOLVED:.0e} after {MOST_ITERATIONS} iterations."
            )
    return found, weighed.T @ found


def _dots(one: Float[np.ndarray, "n b"], two: Float[np.ndarray, "n b"]) -> Float[np.ndarray, " b"]:
    return np.einsum("nb,nb->b", one, two)


def _shift_near(solved: SolvedPencil, columns: slice) -> float:
    """Return a shift amid some eigenvalues, in the widest gap, in the units of the solver."""
    near = solved.values[max(columns.start - 1, 0) : columns.stop + 1]
    widest = int(np.diff(near).argmax())
    shift = float(near[widest : widest + 2].mean())
    return float(np.ldexp(shift, -solved.pencil.value_exponent))
