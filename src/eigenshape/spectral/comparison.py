"""Two operators that should be one: how far apart their entries lie, or their eigenvalues."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.factor import EPS
from eigenshape.spectral.laws import Law, judged
from eigenshape.spectral.solver import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_EIGENVALUES = 20


def sizes_of(matrix: sp.csr_array) -> Float[np.ndarray, " n"]:
    """Return the root of each diagonal entry: of a semidefinite matrix no |W_ij| is above √W_ii √W_jj."""
    diagonal = np.abs(matrix.diagonal())
    return np.sqrt(np.maximum(diagonal, EPS * diagonal.max(initial=0.0)))


def same_entries(name: str, found: Laplacian, expected: Laplacian, allowed: float) -> Law:
    """Compare entry by entry."""
    if found.n_points != expected.n_points:
        says = f"the operator has {found.n_points} rows where {expected.n_points} are expected."
        return judged(name, np.inf, allowed, says)
    measured, says = distance(expected, found)
    return judged(name, measured, allowed, f"{says}; rounding takes up to {allowed:.1e}.")


def distance(expected: Laplacian, found: Laplacian) -> tuple[float, str]:
    """Return the largest change of an entry, relative to √(W_ii W_jj) or √(B_ii B_jj), and say where it is."""
    sized = zip("WB", matrices(expected), matrices(found), strict=True)
    return max((_largest_change(*each) for each in sized), key=lambda change: change[0])


def _largest_change(name: str, expected: sp.csr_array, found: sp.csr_array) -> tuple[float, str]:
    change = (found - expected).tocoo()
    roots = sizes_of(expected)
    relative = np.abs(change.data) / np.maximum(roots[change.row] * roots[change.col], np.finfo(float).tiny)
    if not relative.any():
        return 0.0, f"no entry of {name} changes"
    worst = int(relative.argmax())
    i, j = int(change.row[worst]), int(change.col[worst])
    where = f"the largest change is that of {name}_ij at ({i}, {j}), from {expected[i, j]:.6g} to {found[i, j]:.6g}"
    return float(relative[worst]), f"{where}, {relative[worst]:.1e} of √({name}_ii {name}_jj)"


def same_spectrum(name: str, found: Laplacian, expected: Laplacian, allowed: float) -> Law:
    """Compare the lowest eigenvalues, whatever the order of the rows."""
    if found.n_points != expected.n_points:
        return same_entries(name, found, expected, allowed)
    one, two = _spectrum(expected), _spectrum(found)
    last = float(one.eigenvalues[-1]) or 1.0
    change = np.abs(two.eigenvalues - one.eigenvalues) / last
    worst = int(change.argmax())
    allowed = (_spectral_rounding(allowed, expected) + float(one.residuals.max() + two.residuals.max())) / last
    says = (
        f"of the {len(change)} lowest eigenvalues, {worst} changes most, from {one.eigenvalues[worst]:.6g} to "
        f"{two.eigenvalues[worst]:.6g}, {change[worst]:.1e} of the last; rounding takes up to {allowed:.1e}."
    )
    return judged(name, float(change[worst]), allowed, says)


def _spectral_rounding(share: float, laplacian: Laplacian) -> float:
    """Estimate what changes by a share of √(W_ii W_jj) do to an eigenvalue whose vector is spread over the shape."""
    traces = [float(matrix.diagonal().sum()) for matrix in matrices(laplacian)]
    return share * laplacian.stiffness.nnz / laplacian.n_points * abs(traces[0]) / traces[1]


def _spectrum(laplacian: Laplacian) -> Spectrum:
    bare = Laplacian(laplacian.stiffness, laplacian.mass)  # of the pencil itself, not corrected
    return solve_spectrum(bare, min(N_EIGENVALUES, laplacian.n_points))


def permuted(laplacian: Laplacian, old_of_new: Int[np.ndarray, " n"]) -> Laplacian:
    """Return the operator with its rows in another order."""
    return Laplacian(*(matrix[old_of_new][:, old_of_new] for matrix in matrices(laplacian)))


def matrices(laplacian: Laplacian) -> tuple[sp.csr_array, sp.csr_array]:
    """Return W and B."""
    return laplacian.stiffness, laplacian.mass
