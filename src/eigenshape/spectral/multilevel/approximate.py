"""Approximate lowest eigenpairs of a pencil, without a factor of the operator or a proof."""

from dataclasses import replace

import numpy as np

from eigenshape._progress import Progress
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.multilevel.davidson import Goal, finish_vectors, refine
from eigenshape.spectral.multilevel.start import ROUNDS, SINGLE, climb, on_finest
from eigenshape.spectral.solver.certify import require_orthonormal
from eigenshape.spectral.solver.pairs import Pairs
from eigenshape.spectral.solver.pencil import Pencil, residual_norms
from eigenshape.spectral.solver.strategy import solve_lowest


def approximate_pairs(
    pencil: Pencil, k: int, accuracy: float, max_residual: float, report: Progress
) -> tuple[Pairs, Certificate]:
    """Compute approximations of the k lowest pairs of a pencil with diagonal mass.

    Smoothed aggregation (Vaněk, Mandel and Brezina 1996) coarsens the operator to some thousand
    points, where it is solved exactly. The eigenvectors are then interpolated and smoothed level by
    level. If that is not accurate enough, they are refined by block Davidson: Rayleigh-Ritz on the
    eigenvectors and their multilevel corrections, similar to Nasikun and Hildebrandt (2022). Some
    more pairs than requested are refined too, so that all copies of a multiple eigenvalue are
    found. No count proves that none is missing. Pencils with few points, or with few points for k,
    are solved and certified instead.

    Raises
    ------
    InvalidParameterError
        If the memory is too small.
    ConvergenceError
        If the residuals do not reach the accuracy.
    """
    goal = Goal(k, accuracy, max_residual, pencil.level / pencil.n, ROUNDS, strict=True)
    dtype = np.float32 if accuracy >= SINGLE and np.isinf(max_residual) else np.float64
    start = climb(pencil, k, report, dtype=dtype, kept=16 * pencil.n * k)
    if start is None:
        return solve_lowest(pencil, k, report)
    columns, values, estimate = refine(start.tower, start.below, goal, on_finest(report, start))
    columns, values = finish_vectors(start.tower, columns[:, :k], values[:k])
    vectors = np.empty((pencil.n, k))
    vectors[start.order] = columns
    pairs = Pairs(values, vectors, residual_norms(pencil, values, vectors))
    return pairs, replace(_uncounted_certificate(pencil, pairs), estimate=estimate)


def _uncounted_certificate(pencil: Pencil, pairs: Pairs) -> Certificate:
    return Certificate(
        n_pairs=len(pairs.values),
        shift=np.inf,
        count=None,
        n_found=len(pairs.values),
        gap=(float(pairs.values[-1]), np.inf),
        resolution=float(pairs.residuals.max()),
        orthonormality=require_orthonormal(pencil, pairs),
        max_residual=float(
            pairs.residuals.max() / max(float(np.abs(pairs.values).max()), pencil.level / pencil.n)
        ),
        n_split=0,
    )
