"""How far apart eigenvalues of two operators can be at most, and at which heat times they can be trusted."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_numbers
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.operators.kernel import EDGE_FACTOR, LAST
from eigenshape.operators.laplacian import Laplacian

DENSE = 64  # points, up to which all eigenvalues of the difference are taken
MOST_STEPS = 3000
TOLERANCE = 1e-6  # of the norm


@dataclass(frozen=True)
class WeylBound:
    """How far any eigenvalue of one operator is from that of the same number of the other, at most.

    Attributes
    ----------
    norm : float
        ‖D‖₂ of D = S - S', S = B^(-1/2) W B^(-1/2), in 1/length²: what Weyl's theorem asks for, found by Lanczos'
        method, which errs downwards by a share of 1e-6 or so.
    proven : float
        The largest row sum of |D|, √(‖D‖₁ ‖D‖_∞) as in the proof of Theorem 4.3.1: never below the norm.
    """

    norm: float
    proven: float


@one_blas_thread()
def weyl_bound(one: Laplacian, two: Laplacian, partners: ArrayLike | None = None) -> WeylBound:
    """Bound |λ_i - ω_i| for all eigenvalues of two operators on as many points (Weyl 1912; thesis 4.3).

    Parameters
    ----------
    one, two : Laplacian
        With diagonal mass, not corrected: the bound is for the eigenvalues of the pencils.
    partners : (n,) int, optional
        The point of `two` that belongs to each point of `one`, each once; by default the one of the same number.

    Returns
    -------
    WeylBound
        In the unit of the eigenvalues.

    Raises
    ------
    InvalidParameterError
        If the operators differ in size, one is corrected or has a mass that is not diagonal, or `partners` are no
        permutation.
    ConvergenceError
        If Lanczos' method does not settle.
    """
    require_type(one, Laplacian, "one")
    require_type(two, Laplacian, "two")
    if one.n_points != two.n_points:
        raise InvalidParameterError(
            f"Weyl's bound takes operators on as many points; they have {one.n_points} and {two.n_points}."
        )
    order = _permutation(partners, two.n_points)
    first, second = _symmetric(one, "one"), _symmetric(two, "two")
    difference = (first - second[order][:, order]).tocsr()
    proven = float(abs(difference).sum(axis=1).max())
    return WeylBound(min(_norm(difference), proven) if proven else 0.0, proven)


def _permutation(partners: ArrayLike | None, n: int) -> np.ndarray:
    if partners is None:
        return np.arange(n)
    order = whole_numbers(partners, "partners", 0, n - 1)
    times = np.bincount(order, minlength=n)
    if len(order) != n or times.max() > 1:
        fact = (
            f"there are {len(order)} of {n}"
            if len(order) != n
            else f"point {times.argmax()} has {times.max()}"
        )
        raise InvalidParameterError(f"partners must name each point once; {fact}.")
    return order


def _symmetric(laplacian: Laplacian, name: str) -> sp.csr_array:
    """Return B^(-1/2) W B^(-1/2)."""
    if laplacian.kernel is not None and laplacian.kernel.corrected:
        raise InvalidParameterError(
            f"Weyl's bound is for the eigenvalues of a pencil; those of {name} are corrected. Build it without correct."
        )
    if laplacian.mass.nnz > laplacian.n_points:
        raise InvalidParameterError(f"Weyl's bound takes a diagonal mass; that of {name} is not.")
    roots = sp.diags_array(1 / np.sqrt(laplacian.mass.diagonal()))
    return (roots @ laplacian.stiffness @ roots).tocsr()


def _norm(matrix: sp.csr_array) -> float:
    n = matrix.shape[0]
    if n <= DENSE:
        return float(np.abs(np.linalg.eigvalsh(matrix.toarray())).max())
    size = float(abs(matrix).max())
    start = np.random.default_rng(0).standard_normal(n)
    try:
        values = eigsh(
            matrix / size,
            1,
            which="LM",
            v0=start,
            tol=TOLERANCE,
            maxiter=MOST_STEPS,
            return_eigenvectors=False,
        )
    except ArpackNoConvergence as err:
        raise ConvergenceError(
            f"The norm of a difference of operators was not found in {MOST_STEPS} steps."
        ) from err
    return size * float(np.abs(values[0]))


@dataclass(frozen=True)
class TimeRange:
    """The heat times at which the lowest eigenvalues of a kernel can be trusted.

    Attributes
    ----------
    low, high : float
        In length²; none can be trusted where low > high.
    reach : float
        The least at which a kernel reaches the neighbours, in length².
    """

    low: float
    high: float
    reach: float

    @property
    def low_reason(self) -> str:
        """What asks for the least: "closeness", t ≥ δ² (Theorem 4.1.1), or "spacing"."""
        return "closeness" if self.low > self.reach else "spacing"

    @property
    def empty(self) -> bool:
        """Whether no heat time serves."""
        return self.low > self.high

    def explain(self) -> str:
        """Say it in plain words."""
        smaller = {
            "closeness": "smaller ones hear the change and not the shape, as t is under δ²",
            "spacing": "smaller ones do not reach from point to point",
        }[self.low_reason]
        low = f"{self.low:.3g} ({smaller})"
        high = f"{self.high:.3g} (larger ones press the last eigenvalues into what a kernel cannot tell apart)"
        if self.empty:
            return f"No heat time serves: it would have to be over {low} and under {high}."
        return f"Trust heat times from {low} to {high}."


def admissible_times(
    *, delta: float, spacing: float, eigenvalue: float, corrected: bool = False
) -> TimeRange:
    """Say at which heat times the eigenvalues of a kernel up to a given one can be trusted.

    At least δ² (Theorem 4.1.1 asks for more than any δ^(2-ε)), and at least what makes the width h = 2√t twice the
    spacing (narrower kernels lose 5 to 20 % on irregular points). At most what keeps the last eigenvalue under the
    essential spectrum 1/(2t) (thesis, Claim 3.2.2), or, corrected, tλ where the correction can still tell.

    Parameters
    ----------
    delta : float
        How far points move, in length; 0 where nothing does.
    spacing : float
        Mean distance of neighbours, in length.
    eigenvalue : float
        Of the Laplace operator, the last one asked for, in 1/length².
    corrected : bool

    Raises
    ------
    InvalidParameterError
        If a value is not positive and finite (delta may be 0).
    """
    positive_values([spacing, eigenvalue], "spacing and eigenvalue")
    if delta:
        positive_values(delta, "delta")
    reach = (EDGE_FACTOR * spacing / 2) ** 2
    high = (LAST if corrected else 0.5) / eigenvalue
    return TimeRange(max(delta**2, reach), high, reach)
