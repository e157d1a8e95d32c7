"""Bounds for the change of eigenvalues, and the heat times at which eigenvalues are reliable."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, whole_numbers
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape.operators.clouds.kernel import time_range
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.requirements import require_matrix

# Points up to which the norm comes from a dense eigensolver: Lanczos' method needs more points than
# vectors.
DENSE = 64
# Largest number of iterations of Lanczos' method; one that needs more is an error.
MOST_STEPS = 3000
# Relative accuracy of the norm.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class WeylBound:
    """Upper bounds for the difference of two eigenvalues of the same number.

    Attributes
    ----------
    norm : float
        ‖D‖₂ of D = S - S' with S = B^(-1/2) W B^(-1/2), in 1/length²: the bound of Weyl's theorem.
        It is computed by Lanczos' method, and may be too small by a relative error of about 1e-6.
    proven : float
        Largest row sum of |D|, √(‖D‖₁ ‖D‖_∞) as in the proof of Theorem 4.3.1, in 1/length². It is
        never below the norm.

    See Also
    --------
    weyl_bound : Compute the bounds.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> longer = es.TriangleMesh(ball.vertices * [1, 1, 1.01], ball.faces)
    >>> one, two = (es.cotangent_laplacian(mesh) for mesh in (ball, longer))
    >>> bound = es.stability.weyl_bound(one, two)
    >>> bound.norm <= bound.proven
    True
    """

    norm: float
    proven: float

    _repr_html_ = html_repr


@one_blas_thread()
def weyl_bound(one: Laplacian, two: Laplacian, partners: ArrayLike | None = None) -> WeylBound:
    """Bound |λ_i - ω_i| for all eigenvalues of two operators (Weyl 1912; thesis 4.3).

    Parameters
    ----------
    one, two : Laplacian
        On the same number of points, with diagonal mass and without correction: the bound is for
        the eigenvalues of the pencils.
    partners : (n,) int, optional
        For each point of `one`, the corresponding point of `two`, without duplicates. By default,
        the point of the same number.

    Returns
    -------
    WeylBound
        In the unit of the eigenvalues.

    Raises
    ------
    InvalidParameterError
        If the operators differ in size, one is corrected or has a mass that is not diagonal, or
        `partners` is not a permutation.
    ConvergenceError
        If Lanczos' method does not converge.

    Examples
    --------
    >>> import eigenshape as es
    >>> one = es.cotangent_laplacian(es.icosphere(2))
    >>> es.stability.weyl_bound(one, one).norm
    0.0
    """
    require_type(one, Laplacian, "one")
    require_type(two, Laplacian, "two")
    if one.n_points != two.n_points:
        raise InvalidParameterError(
            "Weyl's bound needs operators on the same number of points; "
            f"they have {one.n_points} and {two.n_points}."
        )
    n = two.n_points
    order = np.arange(n) if partners is None else whole_numbers(partners, "partners", 0, n - 1)
    if len(order) != n:
        raise InvalidParameterError(
            f"partners must name each point once; there are {len(order)} of {n}."
        )
    times = np.bincount(order, minlength=n)
    if times.max() > 1:
        raise InvalidParameterError(
            f"partners must name each point once; point {times.argmax()} has {times.max()}."
        )
    first, second = _symmetric(one, "one"), _symmetric(two, "two")
    difference = (first - second[order][:, order]).tocsr()
    proven = float(abs(difference).sum(axis=1).max())
    if not proven:
        return WeylBound(0.0, proven)
    # The norm is the largest absolute eigenvalue.
    if n <= DENSE:
        norm = float(np.abs(np.linalg.eigvalsh(difference.toarray())).max())
        return WeylBound(min(norm, proven), proven)
    size = float(abs(difference).max())
    start = np.random.default_rng(0).standard_normal(n)
    try:
        values = eigsh(
            difference / size,
            1,
            which="LM",
            v0=start,
            tol=TOLERANCE,
            maxiter=MOST_STEPS,
            return_eigenvectors=False,
        )
    except ArpackNoConvergence as err:
        raise ConvergenceError(
            "The norm of the difference of two operators must converge; "
            f"it was not found in {MOST_STEPS} steps of Lanczos' method."
        ) from err
    return WeylBound(min(size * float(np.abs(values[0])), proven), proven)


def _symmetric(laplacian: Laplacian, name: str) -> sp.csr_array:
    """Return B^(-1/2) W B^(-1/2)."""
    require_matrix(laplacian, name)
    if laplacian.mass.nnz > laplacian.n_points:
        raise InvalidParameterError(
            f"Weyl's bound needs a diagonal mass; that of {name} is not. Build it with lumped mass."
        )
    roots = sp.diags_array(1 / np.sqrt(laplacian.mass.diagonal()))
    return (roots @ laplacian.stiffness @ roots).tocsr()


@dataclass(frozen=True)
class TimeRange:
    """Range of heat times at which the lowest eigenvalues of a kernel are reliable.

    Attributes
    ----------
    low, high : float
        Smallest and largest admissible time, in length². The range is empty if low > high.
    reach : float
        Smallest time at which the kernel reaches neighboring points, in length².

    See Also
    --------
    admissible_times : Compute the range.

    Examples
    --------
    If the points of two shapes differ too much, no heat time is reliable:

    >>> import eigenshape as es
    >>> times = es.stability.admissible_times(delta=0.2, spacing=0.1, eigenvalue=5.0)
    >>> round(times.low, 3), round(times.high, 3), times.empty
    (0.04, 0.1, False)
    >>> es.stability.admissible_times(delta=1.0, spacing=0.1, eigenvalue=5.0).empty
    True
    """

    low: float
    high: float
    reach: float

    _repr_html_ = html_repr

    @property
    def low_reason(self) -> str:
        """What determines `low`: "closeness", t ≥ δ² (Theorem 4.1.1), or "spacing" of points."""
        return "closeness" if self.low > self.reach else "spacing"

    @property
    def empty(self) -> bool:
        """Whether no heat time is admissible."""
        return self.low > self.high

    def explain(self) -> str:
        """Describe the range in plain words."""
        smaller = {
            "closeness": "smaller times, below δ², measure the change and not the shape",
            "spacing": "at smaller times the kernel does not reach from point to point",
        }[self.low_reason]
        low = f"{self.low:.3g} ({smaller})"
        high = f"{self.high:.3g} (at larger times the kernel cannot separate the last eigenvalues)"
        if self.empty:
            return f"No heat time is reliable: it would have to be above {low} and below {high}."
        return f"Reliable heat times are from {low} to {high}."


def admissible_times(
    *, delta: float, spacing: float, eigenvalue: float, corrected: bool = False
) -> TimeRange:
    """Compute the heat times at which the eigenvalues of a kernel, up to a given one, are reliable.

    The smallest time is δ² (Theorem 4.1.1 needs more than any δ^(2-ε)), and at least the time at
    which the width h = 2√t is twice the spacing (narrower kernels lose 5 to 20 % on irregular
    points). The largest time keeps the last eigenvalue below the essential spectrum 1/(2t) (thesis,
    Claim 3.2.2); for a corrected kernel, it keeps tλ within the range of the correction.

    Parameters
    ----------
    delta : float
        Largest displacement of a point, in length; 0 if no point moves.
    spacing : float
        Mean distance of neighboring points, in length.
    eigenvalue : float
        Largest eigenvalue of interest of the Laplace operator, in 1/length².
    corrected : bool
        Whether the eigenvalues of the kernel are corrected for bias.

    Returns
    -------
    TimeRange

    Raises
    ------
    InvalidParameterError
        If a value is not positive and finite (`delta` may be 0).

    Examples
    --------
    >>> import eigenshape as es
    >>> times = es.stability.admissible_times(delta=0.2, spacing=0.1, eigenvalue=5.0)
    >>> round(times.low, 6), round(times.high, 6), times.low_reason
    (0.04, 0.1, 'closeness')
    """
    positive_values([spacing, eigenvalue], "spacing and eigenvalue")
    if delta:
        positive_values(delta, "delta")
    reach, high = time_range(spacing, eigenvalue, corrected=corrected)
    return TimeRange(max(delta * delta, reach), high, reach)
