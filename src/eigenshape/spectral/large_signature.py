"""Heat kernel signatures of very many points, from an operator of few, with an estimated error."""

from contextlib import suppress
from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import reverse_cuthill_mckee
from threadpoolctl import threadpool_limits

from eigenshape._arrays import frozen, positive_values, whole_number
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.coarse_refinement import (
    FineOperator,
    changes_further,
    diagonal_of,
    fine_operator,
    prolonged,
    rayleigh_ritz,
    reordered,
    smooth,
)
from eigenshape.spectral.coarse_space import CoarseSpace, coarse_space
from eigenshape.spectral.kernel_values import from_pencil, require_readable
from eigenshape.spectral.outcome import Progress, silent
from eigenshape.spectral.pencil import Pencil, normalise
from eigenshape.spectral.signature import heat_kernel_signature
from eigenshape.spectral.solver import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

LARGE = 25_000  # points beyond which the command line takes approximate signatures, as the thesis does (5.4)
PER_PAIR = 40  # coarse functions to a pair, at least
LEAST_COARSE = 6000
COARSENED = 3  # times fewer functions than points, at least: else the exact solve is as quick
LEAST_PER_PAIR = 2  # coarse functions to a pair that their operator can be solved for
GUARDS = 8
GUARD_SHARE = 1.1
SAMPLES = 16  # pairs that are refined further to see what they are off by; those between are interpolated
ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class ApproximateSignature:
    """Heat kernel signatures with an estimate of what they are off by.

    Attributes
    ----------
    values : (n, q) float
        Heat per unit mass, in 1/length^dim.
    times : (q,) float
        In length².
    errors : (q,) float
        Estimate of the error of each column, root mean square by the mass, relative to that of the column.
    eigenvalues : (k,) float
        Ritz values, in 1/length².
    n_coarse : int
        Functions that the operator was reduced to; n where it was solved as it is.
    """

    values: Float[np.ndarray, "n q"]
    times: Float[np.ndarray, " q"]
    errors: Float[np.ndarray, " q"]
    eigenvalues: Float[np.ndarray, " k"]
    n_coarse: int


@dataclass(frozen=True, eq=False)
class _Wanted:
    """What is asked for."""

    k: int
    n_coarse: int
    times: Float[np.ndarray, " q"]


def approximate_heat_kernel_signature(
    laplacian: Laplacian,
    k: SupportsIndex,
    times: ArrayLike,
    *,
    n_coarse: SupportsIndex | None = None,
    progress: Progress | None = None,
) -> ApproximateSignature:
    """Measure the heat left at each of very many points, nearly, with no factor of the whole operator.

    What `heat_kernel_signature` gives for the spectrum of k pairs. The thesis names an approximation for its large
    models, HKS-simp, and does not print it (5.4); this one is ours. Points are joined into patches, whose smoothed
    indicators carry a small operator PᵀWP, PᵀBP (`coarse_space`). It is solved with proof; its eigenvectors, taken up
    to all points, are smoothed and combined anew by Rayleigh and Ritz, once, in single precision.

    The error is estimated, not bounded: some of the pairs are smoothed on, four times as far down the spectrum, and
    what this changes in their squares, weighted by exp(-tλ), adds up to `errors`. On meshes of good and of poor
    triangles it was 1 to 4 times the true error. What such smoothing cannot reach it does not see, and a pair
    missing from the coarse operator neither.

    Parameters
    ----------
    laplacian : Laplacian
        With a diagonal mass.
    k : int
        Number of eigenpairs, 1 to n.
    times : (q,) float
        Diffusion times, in length², all > 0.
    n_coarse : int, optional
        Functions of the small operator, about; 40 k and at least 6000 otherwise. More are nearer and slower.
        Where they are no third of the points, or fewer than two a pair, the operator is solved as it is.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    ApproximateSignature

    Raises
    ------
    InvalidParameterError
        If k is not in 1..n, a time not positive and finite, the mass not diagonal, or what `solve_spectrum` refuses.
    ConvergenceError
        If the small operator cannot be solved, or its eigenvectors become dependent on the way up.
    """
    coarse = 1 if n_coarse is None else whole_number(n_coarse, "n_coarse", 1)
    pairs = whole_number(k, "k", 1, laplacian.n_points)
    wanted = _Wanted(
        pairs, coarse if n_coarse else max(PER_PAIR * pairs, LEAST_COARSE), positive_values(times, "times")
    )
    report = progress or silent
    with threadpool_limits(1, user_api="blas"):
        pencil = normalise(laplacian)
        if pencil.mass_floor != 1.0:
            raise InvalidParameterError(
                "mass must be diagonal for an approximate signature; it has entries beside the diagonal. Take the "
                "lumped mass, or solve_spectrum and heat_kernel_signature."
            )
        if pencil.n < COARSENED * wanted.n_coarse or wanted.n_coarse < LEAST_PER_PAIR * _with_guards(wanted.k):
            return _exact(laplacian, wanted, report)
        return _coarsened(pencil, wanted, report)


def _with_guards(k: int) -> int:
    return max(k + GUARDS, int(GUARD_SHARE * k))


def _exact(laplacian: Laplacian, wanted: _Wanted, report: Progress) -> ApproximateSignature:
    found = solve_spectrum(laplacian, wanted.k, progress=report)
    return ApproximateSignature(
        values=frozen(heat_kernel_signature(found, wanted.times)),
        times=frozen(wanted.times),
        errors=frozen(np.full(len(wanted.times), ROUNDING)),
        eigenvalues=found.eigenvalues,
        n_coarse=laplacian.n_points,
    )


def _coarsened(pencil: Pencil, wanted: _Wanted, report: Progress) -> ApproximateSignature:
    report(0.01, "joining points into patches")
    order = reverse_cuthill_mckee(sp.csr_matrix(pencil.stiffness), symmetric_mode=True)
    stiffness, mass = reordered(sp.csr_array(pencil.stiffness), pencil.mass_diagonal, order)
    space, coarse = _solved(stiffness, mass, wanted, lambda done, what: report(0.05 + 0.35 * done, what))
    fine = fine_operator(stiffness, mass, space)
    columns = prolonged(space, coarse.eigenvectors)
    smooth(fine, columns, coarse.eigenvalues, lambda done: report(0.4 + 0.3 * done, "smoothing eigenvectors"))
    report(0.7, "combining eigenvectors")
    ritz = rayleigh_ritz(fine, columns)
    report(0.85, "heat and its error")
    lowest = pencil.values_out(ritz[0][: wanted.k])
    require_readable(pencil.kernel, lowest)
    lowest = from_pencil(pencil.kernel, lowest)
    decay = np.exp(-np.outer(lowest, wanted.times))
    heat = diagonal_of(columns, ritz[1][:, : wanted.k], decay)
    errors = _errors(fine, columns, ritz, decay, np.ldexp(wanted.times, pencil.value_exponent))
    report(1.0, "estimated")
    values = np.empty_like(heat)
    values[order] = np.ldexp(heat, 2 * pencil.vector_exponent)
    off = errors / np.sqrt(mass @ heat**2) + ROUNDING
    return ApproximateSignature(
        frozen(values), frozen(wanted.times), frozen(off), frozen(lowest), space.stiffness.shape[0]
    )


def _solved(
    stiffness: sp.csr_array, mass: Float[np.ndarray, " n"], wanted: _Wanted, report: Progress
) -> tuple[CoarseSpace, Spectrum]:
    """Return a coarse space with its spectrum; one of rough functions where smooth ones are too much alike."""
    m = _with_guards(wanted.k)
    with suppress(ConvergenceError, InvalidParameterError):
        space = coarse_space(stiffness, mass, wanted.n_coarse)
        return space, solve_spectrum(Laplacian(space.stiffness, space.mass), m, progress=report)
    space = coarse_space(stiffness, mass, wanted.n_coarse, smooth=False)
    return space, solve_spectrum(Laplacian(space.stiffness, space.mass), m, progress=report)


def _errors(
    fine: FineOperator,
    columns: Float[np.ndarray, "n m"],
    ritz: tuple[np.ndarray, np.ndarray],
    decay: Float[np.ndarray, "k q"],
    times: Float[np.ndarray, " q"],
) -> Float[np.ndarray, " q"]:
    """Add up what further smoothing changes, as if all of it had one sign: |Σ e^{-tλ} (φ'² - φ²)|, t e^{-tλ} (θ' - θ).

    The mean of φ² over the shape is 1 / its measure, so of the constant of that height is a change of eigenvalues.
    """
    k = len(decay)
    sample = np.unique(np.linspace(0, k - 1, min(k, SAMPLES)).round().astype(np.int64))
    squares, falls = (np.interp(np.arange(k), sample, found) for found in changes_further(fine, columns, ritz, sample))
    return np.asarray(squares @ decay + times * (falls @ decay) / np.sqrt(fine.mass.sum()))
