"""Heat kernel signatures of large shapes, by approximate eigenvectors, with an estimated error."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, positive_values, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from certeig.solver.pencil import Pencil
from eigenshape.operators.laplacian import GaussianKernel, Laplacian
from eigenshape.spectral.diffusion.decay import exponential_decay
from eigenshape.spectral.kernel_values import from_pencil, require_readable
from eigenshape.spectral.multilevel.approximate import (
    MOST_ROUNDS,
    SINGLE,
    climb,
    on_level,
    require_accuracy,
    require_lumped,
)
from eigenshape.spectral.multilevel.davidson import Goal, misses_pairs, refine
from eigenshape.spectral.multilevel.residuals import (
    Interpolated,
    Stored,
    change_rows,
    images,
    map_groups,
    norms_of_residuals,
)
from eigenshape.spectral.multilevel.vcycle import correct
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum

LARGE = 100_000  # points beyond which the command line computes approximate signatures
USUAL_ACCURACY = 1e-2  # of eigenvalues; the heat then has a relative error of about 1e-3
# Pairs that are corrected further to estimate their error; those in between are interpolated.
SAMPLED_PAIRS = 16
CORRECTION_STEPS = (
    30  # smoothing steps of these corrections, more than those of a round of refinement
)
SINGLE_ROUNDING = 1e-6  # relative error of single precision sums, added to every estimate


@record
class ApproximateSignature(ReadOnly):
    """Heat kernel signatures with an estimate of their error.

    Attributes
    ----------
    values : (n, q) float
        Heat per unit mass, in 1/length^dim.
    times : (q,) float
        In length².
    errors : (q,) float
        Estimated error of each column: root mean square weighted by the mass, relative to that of
        the column.
    eigenvalues : (k,) float
        Ritz values, in 1/length².
    complete : bool
        Whether the eigenvalues are certified, as they are for operators of few points.

    Examples
    --------
    The signature of 642 points at two times, with an estimated error below 1 % at both:

    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(3))
    >>> found = es.spectral.approximate_heat_signature(laplacian, 16, [0.5, 1.0])
    >>> found.values.shape
    (642, 2)
    >>> (found.errors < 0.01).tolist()
    [True, True]
    >>> found.complete  # whether an eigenvalue is missing was not counted
    False
    """

    values: Float[np.ndarray, "n q"]
    times: Float[np.ndarray, " q"]
    errors: Float[np.ndarray, " q"]
    eigenvalues: Float[np.ndarray, " k"]
    complete: bool


@one_blas_thread()
def approximate_heat_signature(
    laplacian: Laplacian,
    k: Integer,
    times: ArrayLike,
    *,
    accuracy: float = USUAL_ACCURACY,
    progress: Progress | None = None,
) -> ApproximateSignature:
    """Compute the heat kernel signature of a large shape approximately.

    The result approximates `heat_kernel_signature` of the spectrum of k pairs, without a factor of
    the whole operator and in less memory. The thesis names an approximation for its large models,
    HKS-simp, without its definition (5.4); this one is ours. Points are joined into aggregates, the
    indicators of these are smoothed, and the pairs are computed in their span, as the approximate
    method of `solve_spectrum` begins. If their estimated errors and that of the heat are within the
    accuracy, their squares are summed as they are; otherwise they are refined by that method, in
    single precision.

    The error is estimated, not bounded: some of the pairs are corrected further, and the resulting
    changes of their squares, weighted by exp(-tλ), add up to `errors`. On scans, creatures and poor
    triangles the estimate was 0.5 to 4.5 times the true error. It does not include missing
    pairs.

    Parameters
    ----------
    laplacian : Laplacian
        With a diagonal mass.
    k : int
        Number of eigenpairs, 1 to n.
    times : (q,) float
        Diffusion times, in length², all > 0.
    accuracy : float
        Error of the eigenvalues, relative to the k-th, at which refinement stops, 1e-4 to 0.1. At
        1e-2 the relative error of the heat was 0.0002 to 0.0035; at 1e-3 nearly all maxima were at
        the same vertices as those of the certified heat.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    ApproximateSignature

    Raises
    ------
    InvalidParameterError
        If k is not in 1..n, a time is not positive and finite, or so long that rounding errors of
        eigenvalues count, the accuracy is out of range, the
        mass is not diagonal, the memory is too small, or `solve_spectrum` refuses the operator.
    ConvergenceError
        If the accuracy is not reached.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(4))
    >>> found = es.spectral.approximate_heat_signature(laplacian, 16, [0.5, 1.0])
    >>> found.values.shape
    (2562, 2)
    >>> bool(found.errors.max() < 0.01)
    True
    """
    require_type(laplacian, Laplacian, "laplacian")
    wanted, clock = whole_number(k, "k", 1, laplacian.n_points), positive_values(times, "times")
    require_accuracy("accuracy", accuracy, SINGLE)
    require_lumped(laplacian)
    report = progress or silent
    pencil = normalize(laplacian)
    start = climb(pencil, wanted, report)
    if start is None:  # too few points to gain from levels
        found = solve_spectrum(laplacian, wanted, progress=report)
        return ApproximateSignature(
            values=heat_kernel_signature(found, clock),
            times=clock,
            errors=np.full(len(clock), SINGLE_ROUNDING),
            eigenvalues=found.eigenvalues,
            complete=True,
        )
    goal = Goal(wanted, float(accuracy), np.inf, pencil.level / pencil.n, MOST_ROUNDS, strict=True)
    # Eigenvectors of the second level may be good enough as they are.
    columns: Interpolated | Stored
    columns = Interpolated(start.tower, np.ascontiguousarray(start.below[0], np.float32))
    ritz = start.below[1]
    estimate = _estimate(laplacian.kernel, pencil, columns, ritz[:wanted], clock)
    bound = goal.accuracy * goal.scale(ritz)
    if (
        estimate.fall > bound
        or (estimate.errors > goal.accuracy * estimate.means).any()
        or misses_pairs(columns, ritz, wanted, bound)
    ):
        stored, ritz, _ = refine(
            start.tower, start.below, goal, on_level(report, 0, len(start.tower.levels))
        )
        columns = Stored(start.tower, stored)
        estimate = _estimate(laplacian.kernel, pencil, columns, ritz[:wanted], clock)
    report(0.95, "heat")
    heat = np.empty((pencil.n, len(clock)))
    decay = estimate.decay.astype(np.float32)

    def fill(rows: slice) -> None:
        part = columns.rows(rows)[:, :wanted]
        heat[rows] = (part * part) @ decay

    change_rows(start.tower, fill)
    sizes = np.sqrt(pencil.mass_diagonal[start.order] @ heat**2)
    with np.errstate(invalid="ignore"):
        errors = estimate.errors / sizes
    if np.isnan(errors).any():
        raise InvalidParameterError(
            f"times must be so short that rounding errors of eigenvalues do not count; "
            f"{clock[np.isnan(errors)].min():g} is too long. Leave it out: so late all heat is constant."
        )
    values = np.empty_like(heat)
    values[start.order] = np.ldexp(heat, 2 * pencil.vector_exponent)
    report(1.0, "heat")
    return ApproximateSignature(
        values=values,
        times=clock,
        errors=errors + SINGLE_ROUNDING,
        eigenvalues=estimate.eigenvalues,
        complete=False,
    )


@record
class _Estimate:
    """What is known of the heat of approximate eigenvectors before it is summed up.

    Attributes
    ----------
    eigenvalues : (k,) float
        Ritz values, in 1/length².
    decay : (k, q) float
        exp(-tλ).
    errors : (q,) float
        Estimated error of the heat, in the norm of M.
    means : (q,) float
        Norm of the mean heat, and so a lower bound of the norm of the heat.
    fall : float
        The most by which further corrections lower a value, in the unit of the pencil.
    """

    eigenvalues: Float[np.ndarray, " k"]
    decay: Float[np.ndarray, "k q"]
    errors: Float[np.ndarray, " q"]
    means: Float[np.ndarray, " q"]
    fall: float


def _estimate(
    kernel: GaussianKernel | None,
    pencil: Pencil,
    columns: Interpolated | Stored,
    ritz: Float[np.ndarray, " k"],
    times: Float[np.ndarray, " q"],
) -> _Estimate:
    """Correct a sample of the columns further, and add up what that changes in the heat.

    The changes are added as if all had one sign: |Σ e^{-tλ} (φ'² - φ²)|, t e^{-tλ} (θ' - θ). The
    mean of φ² over the shape is 1 / its measure, so a change of eigenvalues changes the heat as a
    constant of that height would.
    """
    values = pencil.values_out(ritz)
    require_readable(kernel, values)
    values = from_pencil(kernel, values)
    decay = exponential_decay(np.maximum(values, 0), times)
    k, root = len(ritz), np.sqrt(columns.tower.levels[0].weights.sum())
    sample = np.unique(np.linspace(0, k - 1, min(k, SAMPLED_PAIRS)).round().astype(np.int64))
    # What these Ritz vectors become with their corrections: the norms of φ'² - φ² in M, and the fall
    # of their values. Only what lies outside the span of all columns counts: within it Ritz vectors
    # are what they can be.
    tower = columns.tower
    vectors, own, mass = columns.pick(sample), ritz[sample], tower.levels[0].weights
    residual = np.empty(vectors.shape, dtype=np.float32)
    norms_of_residuals(tower, vectors, own, residual)
    step = correct(tower, residual, own.astype(np.float32), CORRECTION_STEPS)
    columns.keep_outside(step)
    before, step = vectors.astype(np.float64), step.astype(np.float64)
    step /= np.sqrt((mass * step**2).sum(axis=0)) + np.finfo(np.float32).tiny

    def sum_rows(chunks: list[slice]) -> np.ndarray:
        found = [
            ((before[rows] * image).sum(axis=0), (step[rows] * image).sum(axis=0))
            for rows, image, _ in images(tower, step, chunks)
        ]
        return np.sum(found, axis=0)

    beside, above = np.sum(map_groups(tower, sum_rows), axis=0)
    turn = np.arctan2(2 * beside, above - own) / 2  # of the lowest Ritz vector of the two
    better = np.cos(turn) * before - np.sin(turn) * step
    fall = np.hypot((above - own) / 2, beside) - (above - own) / 2
    change = np.sqrt((mass * (better**2 - before**2) ** 2).sum(axis=0))
    squares, falls = (np.interp(np.arange(k), sample, found) for found in (change, fall))
    errors = squares @ decay + np.ldexp(times, pencil.value_exponent) * (falls @ decay) / root
    return _Estimate(values, decay, errors, decay.sum(axis=0) / root, float(falls.max()))
