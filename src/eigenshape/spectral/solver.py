"""The lowest eigenpairs of a Laplacian, proved complete."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import SupportsIndex

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from eigenshape._arrays import frozen, machine_memory, positive_values, whole_number
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.sparse.lane_loops import LANES
from eigenshape.spectral.cache import content_key, remembered
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.certify import in_user_units, part, prove
from eigenshape.spectral.components import Parts, connected_parts, pairs_of_parts
from eigenshape.spectral.diagnosis import require_solvable
from eigenshape.spectral.factor import Factor
from eigenshape.spectral.interval import count_interval, solve_interval
from eigenshape.spectral.kernel_values import from_pencil, reported, require_readable, to_pencil, widened
from eigenshape.spectral.lanczos import Wanted, block_lanczos
from eigenshape.spectral.pairs import Pairs, lowest, polished
from eigenshape.spectral.pencil import Pencil, finished, normalise
from eigenshape.spectral.shift import factor_below, shift_inside
from eigenshape.spectral.slices import walk
from eigenshape.spectral.spectrum import Spectrum

Progress = Callable[[float, str], None]
Start = Callable[[Pencil, int, Callable[[float], None]], tuple[np.ndarray, Factor]]
Road = Callable[[Pencil, int, Progress], tuple[Pairs, Certificate]]

SMALL = 300  # points up to which a dense solve is the faster one
DENSE_SHARE = 4  # and where more than one in so many pairs is wanted,
MORE = 8  # pairs that are added where a guess was too low
DENSE_LIMIT = 6000  # while the matrix still fits
FEW = 50  # eigenvalues below an interval that are not worth a second count
WHOLE = 400  # pairs up to which one shift serves
SHARE_OF_MEMORY = 0.9
FEWEST_VECTORS = 150  # of a space, however few pairs are wanted
WIDEST = 8  # groups of eight columns to a block
RUNS = 40


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
    wanted, limits = _asked(laplacian, k, above, below)
    if cache is not None:
        compute = partial(solve_spectrum, laplacian, k, above=above, below=below, progress=progress)
        return remembered(cache, content_key(laplacian, (wanted, *limits.tolist())), compute)
    report = progress or _silent
    with threadpool_limits(1, user_api="blas"):
        report(0.0, "scaling the operator")
        pencil = normalise(laplacian)
        try:
            if wanted:
                pairs, certificate = _proved(pencil, wanted, report)
            else:
                low, high = np.ldexp(limits, -pencil.value_exponent).tolist()
                pairs, certificate = _proved_between(pencil, low, high, report)
        except ConvergenceError as error:
            require_solvable(pencil, error)
            raise
    report(1.0, "proved complete")
    values, residuals = pencil.values_out(_without_negatives(pencil, pairs)), pencil.values_out(pairs.residuals)
    require_readable(laplacian.kernel, values)
    return Spectrum(
        eigenvalues=frozen(from_pencil(laplacian.kernel, values)),
        eigenvectors=finished(pencil, pairs.vectors),
        mass=laplacian.mass,
        residuals=frozen(widened(laplacian.kernel, values, residuals)),
        certificate=reported(laplacian.kernel, in_user_units(pencil, certificate), float(values[-1])),
    )


def _asked(
    laplacian: Laplacian, k: SupportsIndex | None, above: float | None, below: float | None
) -> tuple[int, Float[np.ndarray, " 2"]]:
    """Return k, or 0 and the ends of an interval of the pencil's eigenvalues."""
    if (k is None) == (below is None):
        raise InvalidParameterError(f"One of k and below says which pairs to compute; k is {k} and below is {below}.")
    if below is None and above is not None:
        raise InvalidParameterError(f"above needs below, the other end of an interval; above is {above}.")
    if k is not None:
        return whole_number(k, "k", 1, laplacian.n_points), np.zeros(2)
    high = float(positive_values(np.array([below], dtype=float), "below")[0])
    low = -np.inf if above is None or above == 0 else float(positive_values([above], "above")[0])
    if low >= high:
        raise InvalidParameterError(f"above must be less than below; above is {above} and below is {below}.")
    return 0, to_pencil(laplacian.kernel, np.array([low, high]))


def _silent(fraction: float, message: str) -> None:
    """Report to nobody."""


def _proved(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    parts = connected_parts(pencil)
    if len(parts.sizes) > 1 and parts.sizes.max() <= SMALL:
        return _in_parts(pencil, parts, k, report)
    if pencil.n <= SMALL or (DENSE_SHARE * k > pencil.n and pencil.n <= DENSE_LIMIT):
        return _dense(pencil, k, report)
    roads: list[Road] = [partial(_sparse, start=walk)] if k > WHOLE else []
    roads += [partial(_sparse, start=_at_once)]
    roads += [_dense] if pencil.n <= DENSE_LIMIT else []  # nothing there can fail to converge
    for road in roads[:-1]:
        with suppress(ConvergenceError):
            return road(pencil, k, report)
    return roads[-1](pencil, k, report)


def _proved_between(pencil: Pencil, low: float, high: float, report: Progress) -> tuple[Pairs, Certificate]:
    report(0.01, "counting eigenvalues")
    pairs, certificate = _far_up(pencil, low, high, report) or _lowest_below(pencil, high, report)
    start, stop = np.searchsorted(pairs.values, [low, high]).tolist()
    if start == stop:
        raise InvalidParameterError(_nothing(pencil, pairs, certificate.first + start, low, high))
    return part(pencil, pairs, certificate, start, stop)


def _far_up(pencil: Pencil, low: float, high: float, report: Progress) -> tuple[Pairs, Certificate] | None:
    """Solve for an interval by itself where it is less work than all eigenvalues below its upper end."""
    if pencil.n <= SMALL or low <= 0:
        return None
    interval = count_interval(pencil, low, high)
    within = interval.below_high - interval.below_low
    if interval.below_low < max(within, FEW) or (
        DENSE_SHARE * interval.below_high > pencil.n and pencil.n <= DENSE_LIMIT
    ):
        return None
    _require_room(pencil, within, 24 * pencil.shifted.elimination.n_entries)
    with suppress(ConvergenceError):
        return solve_interval(pencil, interval, lambda done: report(0.05 + 0.9 * done, "slices of the interval"))
    return None


def _lowest_below(pencil: Pencil, limit: float, report: Progress) -> tuple[Pairs, Certificate]:
    """Prove one pair more than lie below the limit: then none of them is missing."""
    k = min(factor_below(pencil, limit).count + 1, pencil.n)
    while True:
        pairs, certificate = _proved(pencil, k, report)
        count = int(np.count_nonzero(pairs.values < limit))
        if count < k or k == pencil.n:
            return pairs, certificate
        k = min(k + max(k // 10, MORE), pencil.n)


def _nothing(pencil: Pencil, pairs: Pairs, number: int, low: float, high: float) -> str:
    below, above = pencil.values_out(np.array([high, low])).tolist()
    if number == 0:
        return (
            f"below must exceed the lowest eigenvalue, {pencil.values_out(pairs.values[:1])[0]:.6g}; it is {below:.6g}."
        )
    return (
        f"above and below must have eigenvalues between them; {number} lie below {above:.6g} and none from there to "
        f"{below:.6g}."
    )


def _dense(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    _require_room(pencil, k, 32 * pencil.n**2)
    report(0.1, f"solving {pencil.n} points densely")
    roots = np.sqrt(pencil.mass_diagonal)
    stiffness = pencil.stiffness.toarray() / np.outer(roots, roots)
    mass = None if pencil.mass_floor == 1.0 else pencil.mass.toarray() / np.outer(roots, roots)
    _, vectors = sl.eigh(stiffness, mass)
    pairs = lowest(pencil, vectors[:, :k] / roots[:, None], k)
    report(0.8, "counting eigenvalues")
    return _complete(pencil, pairs)


def _in_parts(pencil: Pencil, parts: Parts, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    _require_room(pencil, k, 24 * int((parts.sizes**2).sum()))
    report(0.1, f"solving {len(parts.sizes)} parts densely")
    pairs = pairs_of_parts(pencil, parts, k)
    report(0.8, "counting eigenvalues")
    return _complete(pencil, pairs)


def _complete(pencil: Pencil, pairs: Pairs) -> tuple[Pairs, Certificate]:
    certificate = prove(pencil, pairs)
    if not certificate.complete:
        raise ConvergenceError(in_user_units(pencil, certificate).explain())
    return pairs, certificate


def _sparse(pencil: Pencil, k: int, report: Progress, *, start: Start) -> tuple[Pairs, Certificate]:
    _require_room(pencil, k, 24 * pencil.shifted.elimination.n_entries)  # two factors at once, and their making
    report(0.02, "looking for a shift")
    vectors, factor = start(pencil, k, _in_run(report, 0))
    for run in range(1, RUNS + 1):
        pairs = polished(pencil, factor, lowest(pencil, vectors, k))
        report(0.9, "counting eigenvalues")
        certificate, wanted = _still_wanted(pencil, factor, pairs, k)
        missing = wanted.below + wanted.above
        if certificate is not None and certificate.complete:
            return pairs, certificate
        if missing == 0 or run == RUNS:
            break
        groups, more = min(1 + -(-missing // LANES), WIDEST), _in_run(report, run)
        _, found = block_lanczos(pencil, factor, wanted, locked=pairs.vectors, groups=groups, report=more)
        if not found.shape[1]:
            break
        vectors = np.hstack([pairs.vectors, found])
    raise ConvergenceError(
        f"Every eigenvalue that inertia counts must be found; {len(pairs.values)} of {k} were found in {run} runs "
        f"and {missing} are missing."
    )


def _require_room(pencil: Pencil, k: int, factors: int) -> None:
    """Estimate the memory of a solve and refuse what the machine has not got."""
    bases = 8 * pencil.n * (3 * k + FEWEST_VECTORS + 2 * min(k, WHOLE))  # a space of twice the pairs, results, a copy
    room = SHARE_OF_MEMORY * machine_memory()
    if bases + factors > room:
        raise InvalidParameterError(
            f"A spectrum must fit into memory, {room / 2**30:.1f} GiB; {k} pairs of {pencil.n} points take about "
            f"{bases / 2**30:.1f} GiB, factors of their operator {factors / 2**30:.1f} GiB. Ask for fewer pairs."
        )


def _at_once(pencil: Pencil, k: int, report: Callable[[float], None]) -> tuple[Float[np.ndarray, "n j"], Factor]:
    factor = shift_inside(pencil, k)
    wanted = Wanted(below=factor.count, above=k - factor.count)
    return block_lanczos(pencil, factor, wanted, locked=np.empty((pencil.n, 0)), report=report)[1], factor


def _in_run(report: Progress, run: int) -> Callable[[float], None]:
    return lambda done: report(0.05 + 0.8 * done, f"run {run + 1} of block Lanczos")


def _still_wanted(pencil: Pencil, factor: Factor, pairs: Pairs, k: int) -> tuple[Certificate | None, Wanted]:
    """Return the proof as far as it goes, and what a further run has to find."""
    certificate = prove(pencil, pairs) if len(pairs.values) == k else None
    missing = certificate.count - certificate.n_found if certificate else k - len(pairs.values)
    missing = min(max(missing, 0), k)
    ceiling = certificate.shift if certificate else np.inf
    below = min(max(factor.count - int(np.count_nonzero(pairs.values < factor.shift)), 0), missing)
    return certificate, Wanted(below=below, above=missing - below, ceiling=ceiling)


def _without_negatives(pencil: Pencil, pairs: Pairs) -> Float[np.ndarray, " k"]:
    rounding = 4 * pairs.residuals + 1e-14 * pencil.level
    bad = np.flatnonzero(pairs.values < -rounding)
    if bad.size:
        value, bound = pencil.values_out(np.array([pairs.values[bad[0]], rounding[bad[0]]]))
        raise InvalidParameterError(
            f"stiffness must be positive semidefinite; eigenvalue {bad[0]} is {value:.6g}, its error under {bound:.1e}."
        )
    return np.maximum(pairs.values, 0.0)
