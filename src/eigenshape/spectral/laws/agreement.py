"""Two operators that should be one: how far apart their entries lie, or their eigenvalues."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS, TINY
from certeig.kit.errors import ConvergenceError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.laws.outcomes import Law, Outcome, SkippedLaw, make_law
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

# Lowest eigenvalues that are compared if rows are not points.
N_EIGENVALUES = 20
# Tolerance above which a comparison would prove nothing.
MOST_ROUNDING = 1e-4


def sizes_of(matrix: sp.csr_array) -> Float[np.ndarray, " n"]:
    """Return the root of each diagonal entry: of a semidefinite matrix no |W_ij| is above √W_ii √W_jj."""
    diagonal = np.abs(matrix.diagonal())
    return np.sqrt(np.maximum(diagonal, EPS * diagonal.max(initial=0.0)))


def same_entries(name: str, found: Laplacian, expected: Laplacian, allowed: float) -> Law:
    """Compare entry by entry."""
    if found.n_points != expected.n_points:
        return make_law(name, np.inf, allowed, _other_rows(found.n_points, expected.n_points))
    measured, explanation = distance(expected, found)
    return make_law(name, measured, allowed, f"{explanation}; rounding may cause {allowed:.1e}.")


def _other_rows(found: int, expected: int) -> str:
    return f"the operator has {found} rows where {expected} are expected."


def distance(expected: Laplacian, found: Laplacian) -> tuple[float, str]:
    """Return the largest change of an entry, relative to √(W_ii W_jj) or √(B_ii B_jj), and say where it is."""
    largest, explanation = 0.0, "no entry of W changes"
    for name, before, after in zip("WB", matrices(expected), matrices(found), strict=True):
        change, roots = (after - before).tocoo(), sizes_of(before)
        scales = np.maximum(roots[change.row] * roots[change.col], TINY)
        relative = np.abs(change.data) / scales
        if relative.max(initial=0.0) > largest:
            worst = int(relative.argmax())
            largest, i, j = float(relative[worst]), int(change.row[worst]), int(change.col[worst])
            explanation = (
                f"the largest change is that of {name}_ij at ({i}, {j}), from {before[i, j]:.6g} to {after[i, j]:.6g}, "
                f"{largest:.1e} of √({name}_ii {name}_jj)"
            )
    return largest, explanation


def same_eigenvalues(
    name: str, found: Laplacian, spectrum: Spectrum, allowed: float, *, copies: int = 1
) -> Outcome:
    """Compare the lowest eigenvalues, whatever the order of the rows, with those of so many copies of an operator."""
    n_rows, k = copies * len(spectrum.eigenvectors), len(spectrum.eigenvalues)
    if found.n_points != n_rows:
        return make_law(name, np.inf, allowed, _other_rows(found.n_points, n_rows))
    try:
        lowest = lowest_eigenvalues(found, k)
    except ConvergenceError as err:
        return SkippedLaw(name, str(err))
    expected = np.repeat(spectrum.eigenvalues, copies)[:k]
    change, worst = spectral_distance(expected, lowest.eigenvalues)
    allowed += float(spectrum.residuals.max() + lowest.residuals.max()) / (
        float(expected[-1]) or 1.0
    )
    if allowed > MOST_ROUNDING:
        return SkippedLaw(
            name, f"rounding may change eigenvalues by {allowed:.0e} of the last: elements are thin"
        )
    explanation = (
        f"of the {len(expected)} lowest eigenvalues, {worst} changes most, from {expected[worst]:.6g} to "
        f"{lowest.eigenvalues[worst]:.6g}, {change:.1e} of the last; rounding may cause {allowed:.1e}."
    )
    return make_law(name, change, allowed, explanation)


def spectral_distance(
    expected: Float[np.ndarray, " k"], found: Float[np.ndarray, " k"]
) -> tuple[float, int]:
    """Return the largest change of an eigenvalue relative to the last, and its index."""
    change = np.abs(found - expected) / (float(expected[-1]) or 1.0)
    worst = int(change.argmax())
    return float(change[worst]), worst


def lowest_eigenvalues(laplacian: Laplacian, k: int = N_EIGENVALUES) -> Spectrum:
    """Solve the pencil itself, whatever correction its kernel has."""
    return solve_spectrum(
        Laplacian(laplacian.stiffness, laplacian.mass), min(k, laplacian.n_points)
    )


def permute(laplacian: Laplacian, old_of_new: Int[np.ndarray, " n"]) -> Laplacian:
    """Return the operator with its rows in another order."""
    return Laplacian(*(matrix[old_of_new][:, old_of_new] for matrix in matrices(laplacian)))


def matrices(laplacian: Laplacian) -> tuple[sp.csr_array, sp.csr_array]:
    """Return W and B."""
    return laplacian.stiffness, laplacian.mass
