"""The lowest eigenpairs of a Laplacian, roughly but at once: no factor of the whole operator, and no proof."""

from dataclasses import replace
from typing import SupportsIndex

import numpy as np

from eigenshape._arguments import require_type
from eigenshape._arrays import whole_number
from eigenshape._progress import Progress, silent
from eigenshape._threads import one_blas_thread
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.multilevel.davidson import Goal, refine, settled
from eigenshape.spectral.multilevel.start import (
    LEAST_ACCURATE,
    ROUNDS,
    SINGLE,
    climb,
    on_finest,
    require_accuracy,
    require_lumped,
)
from eigenshape.spectral.solver.certify import require_orthonormal
from eigenshape.spectral.solver.pairs import Pairs
from eigenshape.spectral.solver.pencil import Pencil, normalise, residual_norms
from eigenshape.spectral.solver.result import spectrum_of
from eigenshape.spectral.solver.strategy import proved
from eigenshape.spectral.spectrum import Spectrum

ACCURATE = 1e-10


def approximate_spectrum(
    laplacian: Laplacian,
    k: SupportsIndex,
    *,
    accuracy: float = 1e-3,
    bound: float | None = None,
    progress: Progress | None = None,
) -> Spectrum:
    """Compute approximations of the k lowest eigenpairs of W φ = λ B φ, without a factor of W - σB and without proof.

    Points are joined into aggregates, whose indicators are smoothed (Vaněk, Mandel and Brezina 1996), until an
    operator of some thousand points is left. That one is solved exactly. On the way back its eigenvectors are smoothed
    level by level, and where that is not enough refined by Rayleigh-Ritz among them and their corrections through all
    coarser levels (block Davidson), in the spirit of Nasikun and Hildebrandt (2022). Some more pairs than asked for
    are refined along, so that copies of a multiple eigenvalue find their place; but no count tells whether one is
    missing.

    Parameters
    ----------
    laplacian : Laplacian
        W positive semidefinite and B diagonal.
    k : int
        Number of eigenpairs, 1 to n.
    accuracy : float
        Error of the eigenvalues relative to the k-th, judged by how far the last round lowered them and their
        residuals; 1e-10 to 0.1. The estimate is told in `certificate.estimate`.
    bound : float, optional
        Go on until every residual, relative to the k-th eigenvalue, is at most this too. It bounds the error for
        certain, and is far larger than the error: that goes with its square.
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.

    Returns
    -------
    Spectrum
        Ascending eigenvalues in 1/length². Each is within its residual of an eigenvalue of the operator (where the
        kernel is corrected: each corrected). `certificate.count` is None and `certificate.complete` False: nothing was
        counted. Operators of few points, or of few for k, are solved and certified as by `solve_spectrum`.

    Raises
    ------
    InvalidParameterError
        If k is not in 1..n, the accuracy out of range, B not diagonal, W seen to have a negative
        eigenvalue, a corrected eigenvalue 1/t or more, or the memory too small.
    ConvergenceError
        If the residuals do not come down to the accuracy.

    Warns
    -----
    UserWarning
        If eigenvalues of a kernel lie too near to 1/t to tell those of the shape.
    """
    require_type(laplacian, Laplacian, "laplacian")
    wanted = whole_number(k, "k", 1, laplacian.n_points)
    for name, value in (
        ("accuracy", accuracy),
        ("bound", LEAST_ACCURATE if bound is None else bound),
    ):
        require_accuracy(name, value, ACCURATE)
    report = progress or silent
    require_lumped(laplacian)
    with one_blas_thread():
        report(0.0, "scaling the operator")
        pencil = normalise(laplacian)
        limits = float(accuracy), np.inf if bound is None else float(bound)
        goal = Goal(wanted, *limits, pencil.level / pencil.n, ROUNDS, strict=True)
        pairs, certificate = _approximated(pencil, goal, report)
    report(1.0, "proved complete" if certificate.complete else "accurate enough")
    return spectrum_of(laplacian, pencil, pairs, certificate)


def _approximated(pencil: Pencil, goal: Goal, report: Progress) -> tuple[Pairs, Certificate]:
    dtype = np.float32 if goal.accuracy >= SINGLE and np.isinf(goal.bound) else np.float64
    start = climb(pencil, goal.k, report, dtype=dtype, kept=16 * pencil.n * goal.k)
    if start is None:
        return proved(pencil, goal.k, report)
    columns, values, estimate = refine(start.tower, start.below, goal, on_finest(report, start))
    columns, values = settled(start.tower, columns[:, : goal.k], values[: goal.k])
    vectors = np.empty((pencil.n, goal.k))
    vectors[start.order] = columns
    pairs = Pairs(values, vectors, residual_norms(pencil, values, vectors))
    return pairs, replace(_uncounted(pencil, pairs), estimate=estimate)


def _uncounted(pencil: Pencil, pairs: Pairs) -> Certificate:
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
