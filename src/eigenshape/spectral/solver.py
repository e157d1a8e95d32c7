"""The lowest eigenpairs of a Laplacian, proved complete."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import SupportsIndex

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import ConvergenceError, InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.sparse.lane_loops import LANES
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.certify import Pairs, in_user_units, prove, shortened
from eigenshape.spectral.factor import Factor
from eigenshape.spectral.kernel_values import to_pencil
from eigenshape.spectral.lanczos import Wanted, block_lanczos
from eigenshape.spectral.outcome import Progress, require_room, silent, spectrum_of
from eigenshape.spectral.pencil import Pencil, normalise, rayleigh_residuals
from eigenshape.spectral.shift import factor_below, shift_inside
from eigenshape.spectral.slices import walk
from eigenshape.spectral.spectrum import Spectrum

Start = Callable[[Pencil, int, Callable[[float], None]], tuple[np.ndarray, Factor]]
Road = Callable[[Pencil, int, Progress], tuple[Pairs, Certificate]]

SMALL = 300  # points up to which a dense solve is the faster one
DENSE_SHARE = 4  # and where more than one in so many pairs is wanted,
MORE = 8  # pairs that are added where a guess was too low
DENSE_LIMIT = 6000  # while the matrix still fits
WHOLE = 400  # pairs up to which one shift serves
FEWEST_VECTORS = 150  # of a space, however few pairs are wanted
WIDEST = 8  # groups of eight columns to a block
RUNS = 40
LOOSE = 1e-12
SKEW = 1e-5
POLISHED = 2e-9


def solve_spectrum(
    laplacian: Laplacian,
    k: SupportsIndex | None = None,
    *,
    below: float | None = None,
    progress: Progress | None = None,
) -> Spectrum:
    """Compute the k lowest eigenpairs of W φ = λ B φ, or all below a value, with the proof that none is missing.

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
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.

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
        If not one of k and below is given, k is not in 1..n, nothing lies below `below`, B is not positive definite, W
        has a negative eigenvalue, or one to be corrected is 1/t or more.
    ConvergenceError
        If the proof cannot be completed; no incomplete spectrum is ever returned.

    Warns
    -----
    UserWarning
        If eigenvalues of a kernel lie too near to 1/t to tell those of the shape.
    """
    if (k is None) == (below is None):
        raise InvalidParameterError(f"One of k and below says which pairs to compute; k is {k} and below is {below}.")
    wanted = whole_number(k, "k", 1, laplacian.n_points) if k is not None else 0
    limit = to_pencil(laplacian.kernel, positive_values([below], "below")) if below is not None else np.zeros(1)
    report = progress or silent
    with threadpool_limits(1, user_api="blas"):
        report(0.0, "scaling the operator")
        pencil = normalise(laplacian)
        if wanted:
            pairs, certificate = proved(pencil, wanted, report)
        else:
            pairs, certificate = _proved_below(pencil, float(np.ldexp(limit[0], -pencil.value_exponent)), report)
    report(1.0, "proved complete")
    return spectrum_of(laplacian, pencil, pairs, certificate)


def proved(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    """Return the k lowest pairs of a pencil and their proof, by the quickest road that reaches it."""
    if pencil.n <= SMALL or (DENSE_SHARE * k > pencil.n and pencil.n <= DENSE_LIMIT):
        return _dense(pencil, k, report)
    roads: list[Road] = [partial(_sparse, start=walk)] if k > WHOLE else []
    roads += [partial(_sparse, start=_at_once)]
    roads += [_dense] if pencil.n <= DENSE_LIMIT else []  # nothing there can fail to converge
    for road in roads[:-1]:
        with suppress(ConvergenceError):
            return road(pencil, k, report)
    return roads[-1](pencil, k, report)


def _proved_below(pencil: Pencil, limit: float, report: Progress) -> tuple[Pairs, Certificate]:
    """Prove one pair more than lie below the limit: then none of them is missing."""
    report(0.01, "counting eigenvalues")
    k = min(factor_below(pencil, limit).count + 1, pencil.n)
    while True:
        pairs, certificate = proved(pencil, k, report)
        count = int(np.count_nonzero(pairs.values < limit))
        if count < k or k == pencil.n:
            break
        k = min(k + max(k // 10, MORE), pencil.n)
    if not count:
        lowest, asked = pencil.values_out(np.array([pairs.values[0], limit]))
        raise InvalidParameterError(f"below must exceed the lowest eigenvalue, {lowest:.6g}; it is {asked:.6g}.")
    return shortened(pencil, pairs, certificate, count)


def _dense(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    _require_room(pencil, k, 32 * pencil.n**2)
    report(0.1, f"solving {pencil.n} points densely")
    roots = np.sqrt(pencil.mass_diagonal)
    stiffness = pencil.stiffness.toarray() / np.outer(roots, roots)
    mass = None if pencil.mass_floor == 1.0 else pencil.mass.toarray() / np.outer(roots, roots)
    _, vectors = sl.eigh(stiffness, mass)
    pairs = _lowest(pencil, vectors[:, :k] / roots[:, None], k)
    report(0.8, "counting eigenvalues")
    certificate = prove(pencil, pairs)
    if not certificate.complete:
        raise ConvergenceError(in_user_units(pencil, certificate).explain())
    return pairs, certificate


def _sparse(pencil: Pencil, k: int, report: Progress, *, start: Start) -> tuple[Pairs, Certificate]:
    _require_room(pencil, k, 24 * pencil.shifted.elimination.n_entries)  # two factors at once, and their making
    report(0.02, "looking for a shift")
    vectors, factor = start(pencil, k, _in_run(report, 0))
    for run in range(1, RUNS + 1):
        pairs = _polished(pencil, factor, _lowest(pencil, vectors, k))
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
    bases = 8 * pencil.n * (3 * k + FEWEST_VECTORS + 2 * min(k, WHOLE))  # a space of twice the pairs, results, a copy
    advice = "Ask for fewer pairs, or for approximate_spectrum, which needs no factor"
    require_room(f"{k} pairs of {pencil.n} points", {"bases": bases, "factors of their operator": factors}, advice)


def _at_once(pencil: Pencil, k: int, report: Callable[[float], None]) -> tuple[Float[np.ndarray, "n j"], Factor]:
    factor = shift_inside(pencil, k)
    wanted = Wanted(below=factor.count, above=k - factor.count)
    return block_lanczos(pencil, factor, wanted, locked=np.empty((pencil.n, 0)), report=report)[1], factor


def _in_run(report: Progress, run: int) -> Callable[[float], None]:
    return lambda done: report(0.05 + 0.8 * done, f"run {run + 1} of block Lanczos")


def _still_wanted(pencil: Pencil, factor: Factor, pairs: Pairs, k: int) -> tuple[Certificate | None, Wanted]:
    """Return the proof as far as it goes, and what a further run has to find."""
    certificate = prove(pencil, pairs) if len(pairs.values) == k else None
    missing = certificate.n_missing if certificate else k - len(pairs.values)
    missing = min(max(missing, 0), k)
    ceiling = certificate.shift if certificate else np.inf
    below = min(max(factor.count - int(np.count_nonzero(pairs.values < factor.shift)), 0), missing)
    return certificate, Wanted(below=below, above=missing - below, ceiling=ceiling)


def _polished(pencil: Pencil, factor: Factor, pairs: Pairs) -> Pairs:
    """Refine the pairs whose residual the rounding of the factor has kept large.

    One step of (W - σB)⁻¹ on a residual gives the error of the vector outside the space of those found.
    """
    late = np.flatnonzero(pairs.residuals > POLISHED * np.abs(pairs.values).max(initial=0.0))
    if not late.size:
        return pairs
    values, vectors, residuals = pairs.values.copy(), pairs.vectors.copy(), pairs.residuals.copy()
    part = vectors[:, late]
    step = factor.solve(pencil.stiffness @ part - pencil.weigh(part) * values[late])
    vectors[:, late] -= step - vectors @ (vectors.T @ pencil.weigh(step))
    values[late], residuals[late] = rayleigh_residuals(pencil, vectors[:, late])
    order = np.argsort(values, kind="stable")
    return Pairs(values[order], vectors[:, order], residuals[order])


def _lowest(pencil: Pencil, vectors: Float[np.ndarray, "n j"], k: int) -> Pairs:
    vectors = _orthonormal(pencil, vectors)
    values, residuals = rayleigh_residuals(pencil, vectors)
    order = np.argsort(values, kind="stable")[:k]
    if not np.array_equal(order, np.arange(vectors.shape[1])):
        vectors = vectors[:, order]
    return Pairs(values[order], vectors, residuals[order])


def _orthonormal(pencil: Pencil, vectors: Float[np.ndarray, "n j"]) -> Float[np.ndarray, "n j"]:
    # One Newton step towards the nearest B-orthonormal columns: they are so up to the tolerance of the iteration.
    gram = vectors.T @ pencil.weigh(vectors)
    identity = np.eye(len(gram))
    off = np.abs(gram - identity).max(initial=0.0)
    if off < LOOSE:
        return vectors
    if off > SKEW:
        raise ConvergenceError(f"Vectors of different runs must be B-orthogonal; two are off by {off:.1e}.")
    return vectors @ (1.5 * identity - 0.5 * gram)
