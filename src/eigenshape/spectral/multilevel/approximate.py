"""The lowest eigenpairs of a pencil, approximately: no factor of the whole operator, and no proof."""

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

    Points are joined into aggregates, whose indicators are smoothed (Vaněk, Mandel and Brezina 1996), until an
    operator of some thousand points is left. That one is solved exactly. On the way back its eigenvectors are smoothed
    level by level, and where that is not enough refined by Rayleigh-Ritz among them and their corrections through all
    coarser levels (block Davidson), in the spirit of Nasikun and Hildebrandt (2022). Some more pairs than requested
    are refined along, so that copies of a multiple eigenvalue find their place; but no count tells whether one is
    missing. Pencils of few points, or of few for k, are solved and certified.

    Raises
    ------
    InvalidParameterError
        If the memory is too small.
    ConvergenceError
        If the residuals do not come down to the accuracy.
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
        orthonormality=require_orthonormal(pencil, pairs.vectors),
        max_residual=float(
            pairs.residuals.max() / max(float(np.abs(pairs.values).max()), pencil.level / pencil.n)
        ),
        n_split=0,
    )
