"""The heat operator e^{-tL}: where the heat of a function is after a time (thesis 2.3)."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.fft import dct

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import find_zero_row_sums
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from certeig.solver.pencil import Pencil
from certeig.sparse.symmetric_factor import SymmetricFactor, factorize_symmetric
from eigenshape._arrays import point_functions
from eigenshape.operators.laplacian import Laplacian, require_matrix
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.spectrum import Spectrum, decay_factors

# Largest error by default, relative to the norm of the values: 25 to 30 solves for each factor.
DEFAULT_ACCURACY = 1e-10
# Smallest and largest accuracy that can be requested. Below the first, rounding dominates; above
# the second, nothing is computed.
ACCURACIES = (1e-12, 0.1)
# Largest t times trace W / trace B. Then 1 + τλ of the highest eigenvalue is about 1e9, and 7
# digits of the solves are left. On a surface of n points it is about 1e9/n times the area.
LONGEST = 1e10
# Times over τ, the time of one implicit step. Between 6 and 48 an accuracy of 1e-10 takes at most
# 30 steps, and 25 at best (at 17): one factor serves times within a factor of 8 of each other.
SMALLEST_RATIO = 6.0
TIMES_OF_ONE_FACTOR = 8.0
# Chebyshev coefficients that are computed. At these ratios those beyond 60 are below 1e-16.
N_COEFFICIENTS = 256

Columns = Float[np.ndarray, "n c"]


@one_blas_thread()
def apply_heat(
    operator: Laplacian | Spectrum,
    values: ArrayLike,
    t: ArrayLike,
    *,
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> Float[np.ndarray, "..."]:
    """Apply the heat operator: let the heat of a function flow for a time.

    H_t f = e^{-tL} f, L = B⁻¹W           (thesis 2.3)

    solves ∂u/∂t = -Lu from u = f, with no flow through the boundary.

    - **With a Laplacian** no eigenvector is needed. A polynomial in S = (B + τW)⁻¹B, the implicit
      Euler step of a time τ, approximates e^{-tL}. One factor of B + τW serves all columns of
      `values` and all times within a factor of 8 of each other. The polynomial is within `accuracy`
      of e^{-tλ} at every λ ≥ 0, so ‖result - e^{-tL} f‖ ≤ accuracy ‖f‖ in the norm of B, plus
      rounding.
    - **With a spectrum** of k pairs the result is Σ_i e^{-tλ_i} φ_i φ_iᵀBf. What is missing is at
      most e^{-tλ_k} ‖f - ΦΦᵀBf‖, λ_k the last eigenvalue.

    Both are linear in f, self-adjoint in B, and keep the integral 1ᵀBf of each component (of a
    spectrum: if it has the constants of all components). Heat never becomes negative if B is
    diagonal and W_ij ≤ 0 between different points; then an entry of the result is at worst
    -accuracy ‖f‖/√B_ii.

    Parameters
    ----------
    operator : Laplacian or Spectrum
        To fix points at 0, pass a spectrum that was computed with `fixed`, or the operator that
        `es.operators.dirichlet_laplacian` makes on the free points, with the values there.
    values : (n,) or (n, c) float
        One function, or one in each column.
    t : float or (q,) float
        Diffusion times, in length², > 0.
    accuracy : float, optional
        Largest error in the norm of B, relative to that of f, 1e-12 to 0.1. With a Laplacian the
        default is 1e-10. With a spectrum it is a demand on k: e^{-tλ_k} must not be larger.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    (n,) or (n, c) float; (n, q) or (n, c, q) for several times
        In the unit of the values.

    Raises
    ------
    InvalidParameterError
        If the values do not fit or are not finite; a time is not positive and finite, or too long
        for factors; the accuracy is out of range, or more than the spectrum can give; the kernel of
        the operator is corrected; or the operator has a negative eigenvalue.

    See Also
    --------
    heat_kernel : Entries of the heat operator.
    es.heat_kernel_signature : The diagonal of the heat kernel.
    es.calculus.solve_heat : Heat with sources and given values at points, by implicit Euler steps.

    Examples
    --------
    On the unit sphere Δz = 2z, so z becomes e^{-2t} z:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(4)
    >>> z = mesh.vertices[:, 2]
    >>> warm = es.spectral.apply_heat(es.cotangent_laplacian(mesh), z, 0.5)
    >>> (warm @ z / (z @ z)).round(3).item()  # e^{-1} = 0.368
    0.368

    With the boundary of a square fixed at 0, heat is lost there:

    >>> import numpy as np
    >>> square = es.shapes.grid(8, 8)
    >>> laplacian, boundary = es.cotangent_laplacian(square), es.geometry.boundary_vertices(square)
    >>> inner, free = es.operators.dirichlet_laplacian(laplacian, boundary)
    >>> values, warm = np.ones(square.n_vertices), np.zeros(square.n_vertices)
    >>> warm[free] = es.spectral.apply_heat(inner, values[free], 0.1)
    >>> bool(laplacian.mass.diagonal() @ warm < 0.1)  # it was the area, 1
    True
    """
    require_type(operator, Laplacian | Spectrum, "operator")
    n = operator.mass.shape[0]
    columns = point_functions(values, "values", n).reshape(n, -1)
    times = positive_values(t, "t")
    low, high = ACCURACIES
    if accuracy is not None and not low <= accuracy <= high:
        raise InvalidParameterError(f"accuracy must lie in {low}..{high}; it is {accuracy!r}.")
    if isinstance(operator, Spectrum):
        decay = decay_factors(operator, times, "t")
        k = len(operator.eigenvalues)
        left = float(decay[-1].max())
        if accuracy is not None and k < n and left > accuracy:
            needed = -np.log(accuracy) / times.min()
            raise InvalidParameterError(
                f"A spectrum must reach the accuracy: {k} pairs leave up to {left:.2g} of a function at "
                f"t = {times.min():.4g}, and accuracy is {accuracy:.2g}. Compute all pairs below "
                f"{needed:.4g}, or pass the Laplacian itself."
            )
        coefficients = operator.eigenvectors.T @ (operator.mass @ columns)
        damped = coefficients[:, :, None] * decay[:, None, :]
        warm = np.tensordot(operator.eigenvectors, damped, axes=1)
    else:
        warm = _flow_by_steps(
            operator, columns, times, accuracy or DEFAULT_ACCURACY, progress or silent
        )
    warm = warm.reshape(*np.shape(values), len(times))
    return warm if np.ndim(t) else warm[..., 0]


def _flow_by_steps(
    laplacian: Laplacian,
    columns: Columns,
    times: Float[np.ndarray, " q"],
    accuracy: float,
    progress: Progress,
) -> Float[np.ndarray, "n c q"]:
    require_matrix(laplacian, "operator")
    pencil = normalize(laplacian)
    own_times = np.ldexp(times, pencil.value_exponent)  # tλ has no unit
    longest = int(np.argmax(own_times))
    if own_times[longest] * pencil.level > LONGEST:
        limit = times[longest] * (LONGEST / pencil.level / own_times[longest])
        raise InvalidParameterError(
            f"Without a spectrum t must be at most {limit:.4g}, {LONGEST:.0e} times trace B / trace W; "
            f"it is {times[longest]:.4g}. Pass a spectrum: after such a time few pairs are enough."
        )

    # Constants stay. Held apart, they are exact however long the time, and solves need not carry a
    # part that is 1 + τλ times as large as the rest.
    averages, members = _constants(pencil)
    still = members @ (averages @ columns)
    warm = np.empty((*columns.shape, len(times)))
    groups = group_times(own_times)
    for number, places in enumerate(groups):
        tau = step_time(own_times[places])
        pattern = pencil.shift_pattern
        factor = factorize_symmetric(pattern.elimination, pattern.mass + tau * pattern.stiffness)
        if factor is None or (factor.pivots <= 0).any():
            raise InvalidParameterError(
                "The operator must have no negative eigenvalue, or heat grows without limit; B + τW is "
                f"not positive definite at τ = {tau * 2.0**-pencil.value_exponent:.4g}. "
                "es.spectral.check_laplacian(laplacian) says more."
            )
        polynomials = [step_coefficients(time / tau, accuracy) for time in own_times[places]]
        degree = max(map(len, polynomials))
        coefficients = np.array([np.pad(each, (0, degree - len(each))) for each in polynomials])

        def step(given: Columns, factor: SymmetricFactor = factor) -> Columns:
            """Return S times columns of mean 0, their means set to 0 again, which rounding moves."""
            stepped = factor.solve(pencil.weigh(given))
            return stepped - members @ (averages @ stepped)

        # Σ_d c_d T_d(2S - 1) of what moves, by the recurrence of Chebyshev polynomials.
        before = columns - still
        now = 2 * step(before) - before
        found = before[:, :, None] * coefficients[:, 0] + now[:, :, None] * coefficients[:, 1]
        for order in range(2, degree):
            before, now = now, 4 * step(now) - 2 * now - before
            found += now[:, :, None] * coefficients[:, order]
            progress((number + (order + 1) / degree) / len(groups), "heat")
        warm[:, :, places] = found
    return warm + still[:, :, None]


def _constants(pencil: Pencil) -> tuple[sp.csr_array, sp.csr_array]:
    """Return the functions that are constant on one component and 0 elsewhere, where W makes them 0.

    First rows (p, n) that take the mean of a function over each of these components, in the mass;
    then columns (n, p), their indicators.
    """
    losing = np.unique(pencil.labels[~find_zero_row_sums(pencil.stiffness)])
    n_parts = int(pencil.labels.max()) + 1
    keeping = np.setdiff1d(np.arange(n_parts), losing)
    where = np.arange(pencil.n), pencil.labels
    members = sp.csr_array((np.ones(pencil.n), where), shape=(pencil.n, n_parts))[:, keeping]
    weighed = sp.csr_array(pencil.mass @ members)
    averages = weighed.T / weighed.sum(axis=0)[:, None]
    return sp.csr_array(averages), sp.csr_array(members)


def step_time(times: Float[np.ndarray, " q"]) -> float:
    """Return the time τ of one implicit step that suits some times; the last is at most 8 times the first."""
    middle = SMALLEST_RATIO * TIMES_OF_ONE_FACTOR**0.5
    return float(np.sqrt(times.min()) * np.sqrt(times.max()) / middle)


def group_times(times: Float[np.ndarray, " q"]) -> list[np.ndarray]:
    """Return the places of times that share a factor, from the shortest times on."""
    groups: list[list[int]] = []
    for place in np.argsort(times, kind="stable"):
        if not groups or times[place] > TIMES_OF_ONE_FACTOR * times[groups[-1][0]]:
            groups.append([])
        groups[-1].append(int(place))
    return [np.array(group) for group in groups]


def step_coefficients(ratio: float, accuracy: float) -> Float[np.ndarray, " d"]:
    """Return the Chebyshev coefficients of a polynomial p in S = 1/(1 + τλ) near e^{-tλ}, ratio = t/τ.

    With s = 1/(1 + τλ) in (0, 1] for every λ ≥ 0, e^{-tλ} = exp(-(t/τ)(1/s - 1)) is a smooth
    function of s. Its Chebyshev series in 2s - 1 is cut where the sum of the absolute values of the
    rest falls below half of `accuracy`, and two coefficients are changed by at most as much so that
    p(1) = 1 (constants stay) and p(0) = 0 (λ = ∞ vanishes). So |p(s) - e^{-tλ}| ≤ accuracy for all
    λ ≥ 0. The number of steps grows with log(1/accuracy); the best rational function with one real
    pole of order d errs by about 0.414^d (Andersson 1981; van den Eshof and Hochbruck 2006).
    """
    angles = (np.arange(N_COEFFICIENTS) + 0.5) * np.pi / N_COEFFICIENTS
    s = (1 + np.cos(angles)) / 2
    coefficients = dct(np.exp(-ratio * (1 / s - 1)), type=2) / N_COEFFICIENTS
    coefficients[0] /= 2
    rest = np.cumsum(np.abs(coefficients)[::-1])[::-1]  # rest[d] is the error of degree d - 1
    kept = coefficients[: int(np.argmax(rest <= accuracy / 2))].copy()
    signs = (-1.0) ** np.arange(len(kept))
    above, below = 1 - kept.sum(), -(kept * signs).sum()
    kept[0] += (above + below) / 2
    kept[1] += (above - below) / 2
    return kept
