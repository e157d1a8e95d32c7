"""The lowest eigenpairs of a Laplacian, proved complete."""

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape._progress import Progress, silent
from eigenshape._threads import one_blas_thread
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.solver.cache import content_key, remembered
from eigenshape.spectral.solver.certify import part
from eigenshape.spectral.solver.diagnosis import require_solvable
from eigenshape.spectral.solver.interval import count_interval, solve_interval
from eigenshape.spectral.solver.kernel_values import to_pencil
from eigenshape.spectral.solver.pairs import Pairs
from eigenshape.spectral.solver.pencil import Pencil, normalise
from eigenshape.spectral.solver.result import spectrum_of
from eigenshape.spectral.solver.shift import factor_below
from eigenshape.spectral.solver.strategy import dense_serves, proved, require_memory_for_pairs
from eigenshape.spectral.spectrum import Spectrum

MORE = 8  # pairs that are added where a guess was too low
FEW = 50  # eigenvalues below an interval that are not worth a second count


def solve_spectrum(
    laplacian: Laplacian,
    k: SupportsIndex | None = None,
    *,
    above: float | None = None,
    below: float | None = None,
    progress: Progress | None = None,
    cache: str | Path | None = None,
) -> Spectrum:
    """Compute the k lowest eigenpairs of W φ = λ B φ, or all in an interval, with the proof that none is missing.

    Block Lanczos on (W - σB)⁻¹B with σ among the wanted eigenvalues; what a count of eigenvalues by Sylvester's law
    of inertia finds missing (copies of a multiple eigenvalue) is searched for again with everything found deflated,
    until the counts agree. Small operators are solved densely. Nothing depends on units: coordinates scaled by s
    give the eigenvalues divided by s².

    Parameters
    ----------
    laplacian : Laplacian
        Any symmetric pencil with W positive semidefinite and B positive definite.
    k : int, optional
        Number of eigenpairs, 1 to n.
    below : float, optional
        Instead of k: all pairs with λ < below, in 1/length².
    above : float, optional
        With `below`: all pairs with above ≤ λ < below. `certificate.first` says how many eigenvalues lie lower.
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.
    cache : path, optional
        A folder, made when missing, in which spectra are kept under a hash of W, B and what is asked; what it has is
        loaded, without a word of progress. Nothing in it is ever deleted.

    Returns
    -------
    Spectrum
        Eigenvalues in 1/length², ascending and ≥ 0: one that comes out below zero by less than its residual is
        reported as 0. Where k cuts a multiple eigenvalue, `certificate.n_split` says how many copies are left out.
        Where the operator's kernel is corrected, λ = -log(1 - t μ)/t stands for the eigenvalue μ of the pencil, in the
        residuals and the certificate too.

    Raises
    ------
    InvalidParameterError
        If not one of k and below is given, k is not in 1..n, no eigenvalue lies below `below` or in the interval, B is
        not positive definite, W has a negative eigenvalue, or one to be corrected is 1/t or more; or W_ii/B_ii spans
        more digits than floats have and no proof can be had; or the folder `cache` cannot be written to.
    ConvergenceError
        If the proof cannot be completed; no incomplete spectrum is ever returned.

    Warns
    -----
    UserWarning
        If eigenvalues of a kernel lie too near to 1/t to tell those of the shape, or a file in `cache` is damaged.
    """
    require_type(laplacian, Laplacian, "laplacian")
    wanted, limits = _asked(laplacian, k, above, below)
    if cache is not None:
        compute = partial(solve_spectrum, laplacian, k, above=above, below=below, progress=progress)
        return remembered(cache, content_key(laplacian, (wanted, *limits.tolist())), compute)
    report = progress or silent
    with one_blas_thread():
        report(0.0, "scaling the operator")
        pencil = normalise(laplacian)
        try:
            if wanted:
                pairs, certificate = proved(pencil, wanted, report)
            else:
                low, high = np.ldexp(limits, -pencil.value_exponent).tolist()
                pairs, certificate = _proved_between(pencil, low, high, report)
        except ConvergenceError as error:
            require_solvable(pencil, error)
            raise
    report(1.0, "proved complete")
    return spectrum_of(laplacian, pencil, pairs, certificate)


def _asked(
    laplacian: Laplacian, k: SupportsIndex | None, above: float | None, below: float | None
) -> tuple[int, Float[np.ndarray, " 2"]]:
    """Return k, or 0 and the ends of an interval of the pencil's eigenvalues."""
    if (k is None) == (below is None):
        raise InvalidParameterError(
            f"One of k and below says which pairs to compute; k is {k} and below is {below}."
        )
    if below is None and above is not None:
        raise InvalidParameterError(
            f"above needs below, the other end of an interval; above is {above}."
        )
    if k is not None:
        return whole_number(k, "k", 1, laplacian.n_points), np.zeros(2)
    high = float(positive_values(np.array([below], dtype=float), "below")[0])
    low = -np.inf if above is None or above == 0 else float(positive_values([above], "above")[0])
    if low >= high:
        raise InvalidParameterError(
            f"above must be less than below; above is {above} and below is {below}."
        )
    return 0, to_pencil(laplacian.kernel, np.array([low, high]))


def _proved_between(
    pencil: Pencil, low: float, high: float, report: Progress
) -> tuple[Pairs, Certificate]:
    report(0.01, "counting eigenvalues")
    pairs, certificate = _far_up(pencil, low, high, report) or _lowest_below(pencil, high, report)
    start, stop = np.searchsorted(pairs.values, [low, high]).tolist()
    if start == stop:
        raise InvalidParameterError(_nothing(pencil, pairs, certificate.first + start, low, high))
    return part(pencil, pairs, certificate, start, stop)


def _far_up(
    pencil: Pencil, low: float, high: float, report: Progress
) -> tuple[Pairs, Certificate] | None:
    """Solve for an interval by itself where it is less work than all eigenvalues below its upper end."""
    if low <= 0 or dense_serves(pencil, 1):
        return None
    interval = count_interval(pencil, low, high)
    within = interval.below_high - interval.below_low
    if interval.below_low < max(within, FEW) or dense_serves(pencil, interval.below_high):
        return None
    require_memory_for_pairs(pencil, within)
    with suppress(ConvergenceError):
        return solve_interval(
            pencil, interval, lambda done: report(0.05 + 0.9 * done, "slices of the interval")
        )
    return None


def _lowest_below(pencil: Pencil, limit: float, report: Progress) -> tuple[Pairs, Certificate]:
    """Prove one pair more than lie below the limit: then none of them is missing."""
    k = min(factor_below(pencil, limit).count + 1, pencil.n)
    while True:
        pairs, certificate = proved(pencil, k, report)
        count = int(np.count_nonzero(pairs.values < limit))
        if count < k or k == pencil.n:
            return pairs, certificate
        k = min(k + max(k // 10, MORE), pencil.n)


def _nothing(pencil: Pencil, pairs: Pairs, number: int, low: float, high: float) -> str:
    below, above = pencil.values_out(np.array([high, low])).tolist()
    if number == 0:
        lowest = pencil.values_out(pairs.values[:1])[0]
        return f"below must exceed the lowest eigenvalue, {lowest:.6g}; it is {below:.6g}."
    return (
        f"above and below must have eigenvalues between them; {number} lie below {above:.6g} and none from there to "
        f"{below:.6g}."
    )
