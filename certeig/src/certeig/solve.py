"""The eigenpairs of W φ = λ B φ: the lowest ones or those of an interval, with their proof."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from certeig.certificate import Certificate
from certeig.kit.arrays import finite_number, freeze, whole_number
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from certeig.matrices import as_symmetric, require_points
from certeig.solver.certified import certified_pairs
from certeig.solver.certify import certify_pairs, in_user_units
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import factorize as factorize_at
from certeig.solver.factor import rounding
from certeig.solver.pencil import Pencil, normalize, to_user_vectors
from certeig.sparse.symmetric_factor import SymmetricFactor, factor_matrix
from certeig.spectrum import Spectrum

# Eigenvalues down to minus this share of trace W / trace B may be rounding of 0.
NEGATIVE_ROUNDING = 1e-9
# The lower bound of all eigenvalues is searched at these many steps, each four times as far from 0.
STEP_DOWN, MOST_STEPS_DOWN = 4.0, 200
# The rounding of a factor is moved aside by this multiple of what it was without.
SLACK = 2.0
# Where no factor serves at a value, or rounding is too large there, eigenvalues are counted this far on
# both sides of it, in shares of trace W / trace B: the same count proves that none is between.
COUNT_STEPS = (0.0, 1e-9, 1e-6, 1e-4)


def eigenpairs(  # noqa: PLR0913 - one keyword for each choice of pairs
    W: Any,
    B: Any = None,
    *,
    k: Integer | None = None,
    below: float | None = None,
    above: float | None = None,
    fixed: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Spectrum:
    """Compute the lowest eigenpairs of W φ = λ B φ, or all in an interval, and prove that none is missing.

    Block Lanczos runs on (W - σB)⁻¹B with σ among the wanted eigenvalues. The eigenvalues below a
    gap are counted by Sylvester's law of inertia (Parlett 1998, section 3.3), and what is missing is
    searched for until both counts agree. Small matrices are solved densely. Matrices with a hundred
    entries a row or more are not factored: Lanczos runs on a Chebyshev polynomial (Zhou, Saad, Tiago
    and Chelikowsky 2006), and eigenvalues are counted in a sparser matrix below the given one.

    Results do not depend on the scale of the matrices.

    Parameters
    ----------
    W : (n, n) sparse
        Symmetric; it may have negative eigenvalues.
    B : (n, n) sparse, optional
        Symmetric and positive definite. By default the identity.
    k : int, optional
        Number of eigenpairs, 1 to the number of free unknowns. Either `k` or `below` must be given.
    below : float, optional
        Compute all pairs with λ < below.
    above : float, optional
        With `below`: compute all pairs with above ≤ λ < below. `certificate.first` is the number of
        eigenvalues below `above`.
    fixed : (c,) int, optional
        Unknowns that are held at 0: their rows and columns are left out, and their entries in the
        eigenvectors are 0.
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.

    Returns
    -------
    Spectrum
        Eigenvalues ascending, and B-orthonormal eigenvectors on all n unknowns. If k cuts a multiple
        eigenvalue, `certificate.n_split` is the number of copies left out.

    Raises
    ------
    InvalidParameterError
        If a matrix is not sparse, square, real, finite and symmetric, or B is not positive definite;
        not exactly one of `k` and `below` is given; `k` is not in 1..n; no eigenvalue is in the
        interval; an unknown is out of range, or none is free; the entries span too many orders of
        magnitude; or the memory is too small.
    ConvergenceError
        If the proof cannot be completed. Incomplete spectra are never returned as complete.

    See Also
    --------
    count_below : Count eigenvalues without computing them.
    certify : Prove that pairs of another solver are complete.

    Examples
    --------
    The modes of a string of 50 equal masses, fixed at both ends, are λ_j = 4 sin²(πj/102):

    >>> import certeig
    >>> from scipy.sparse import diags_array
    >>> string = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(50, 50))
    >>> spectrum = certeig.eigenpairs(string, k=3)
    >>> spectrum.eigenvalues.round(6).tolist()
    [0.003793, 0.015158, 0.034052]
    >>> print(spectrum.certificate.explain()[:74])
    These are the 3 lowest eigenvalues of the operator: none is missing and no

    All eigenvalues in an interval:

    >>> len(certeig.eigenpairs(string, above=1.0, below=2.0).eigenvalues)
    9
    """
    stiffness, whole = _matrices(W, B)
    mass = whole
    free = _free_unknowns(fixed, stiffness.shape[0])
    if free is not None:
        stiffness, mass = stiffness[free][:, free], mass[free][:, free]
    interval = _interval(k, above, below)
    wanted = 0 if k is None else whole_number(k, "k", 1, stiffness.shape[0])
    report = progress or silent
    with one_blas_thread():
        report(0.0, "scaling the matrices")
        moved = _above_zero(stiffness, mass)
        if k is None:
            _require_any(moved, *interval)
        limits = np.array(interval) - moved.origin
        pairs, certificate = certified_pairs(moved.pencil, wanted, limits, report)
    report(1.0, "proved complete")
    return _spectrum(moved, pairs, certificate, whole, free)


def count_below(W: Any, B: Any = None, value: float = 0.0) -> int:
    """Count the eigenvalues of W φ = λ B φ below a value, without computing any.

    The number of negative pivots of a factor of W - σB is the number of eigenvalues below σ
    (Sylvester's law of inertia; Parlett 1998, section 3.3). It is counted twice, each time with a
    diagonal added that is larger than the rounding of the factor, to the one side and to the other.

    Parameters
    ----------
    W, B : (n, n) sparse
        As for `eigenpairs`.
    value : float

    Returns
    -------
    int

    Raises
    ------
    InvalidParameterError
        If a matrix is not valid, as for `eigenpairs`, or the value is not finite.
    ConvergenceError
        If the counts differ, because an eigenvalue is at the value up to rounding.

    Examples
    --------
    >>> import certeig
    >>> from scipy.sparse import diags_array
    >>> string = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(50, 50))
    >>> certeig.count_below(string, value=2.0)
    25
    """
    with one_blas_thread():
        pencil = normalize(*_matrices(W, B))
        return _count(pencil, finite_number(value, "value"))


def certify(W: Any, B: Any, eigenvalues: ArrayLike, eigenvectors: ArrayLike) -> Certificate:
    """Prove that given eigenpairs are the k lowest ones, or raise an error.

    Parameters
    ----------
    W, B : (n, n) sparse
        As for `eigenpairs`; W without negative eigenvalues. B may be None, the identity.
    eigenvalues : (k,) float
        Ascending.
    eigenvectors : (n, k) float
        B-orthonormal columns.

    Returns
    -------
    Certificate

    Raises
    ------
    InvalidParameterError
        If the arrays do not fit the matrices, or are not finite or not ascending.
    ConvergenceError
        If the columns are not B-orthonormal eigenvectors, or the number of eigenvalues differs.

    Examples
    --------
    >>> import certeig
    >>> from scipy.linalg import eigh
    >>> from scipy.sparse import diags_array
    >>> string = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(50, 50))
    >>> values, vectors = eigh(string.toarray())
    >>> certeig.certify(string, None, values[:4], vectors[:, :4]).complete
    True
    """
    with one_blas_thread():
        certificate, _ = certify_pairs(normalize(*_matrices(W, B)), eigenvalues, eigenvectors)
    if not certificate.complete:
        raise ConvergenceError(certificate.explain())
    return certificate


def factorize(matrix: Any) -> SymmetricFactor:
    """Factor a symmetric sparse matrix, A = L D Lᵀ in an order of elimination by nested dissection.

    Pivots are on the diagonal, as they are.

    Parameters
    ----------
    matrix : (n, n) sparse
        Symmetric, definite or not.

    Returns
    -------
    SymmetricFactor
        `solve(right)` solves for one or many right-hand sides, `n_negative` counts the negative
        eigenvalues of L D Lᵀ, and `rounding()` bounds how far that is from A.

    Raises
    ------
    InvalidParameterError
        If the matrix is not sparse, square, real, finite and symmetric, or a pivot is zero.

    Examples
    --------
    >>> import certeig
    >>> from scipy.sparse import diags_array
    >>> factor = certeig.factorize(diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(4, 4)))
    >>> factor.solve([1.0, 0.0, 0.0, 1.0]).round(12).tolist()
    [1.0, 1.0, 1.0, 1.0]
    >>> factor.n_negative
    0
    """
    factor = factor_matrix(as_symmetric("matrix", matrix))
    if factor is None:
        raise InvalidParameterError(
            "matrix must have a factor with its pivots on the diagonal; a pivot is zero or overflows. "
            "Add a small multiple of the identity."
        )
    return factor


def _matrices(W: Any, B: Any) -> tuple[sp.csr_array, sp.csr_array]:
    stiffness = as_symmetric("W", W)
    mass = sp.eye_array(stiffness.shape[0], format="csr") if B is None else as_symmetric("B", B)
    if stiffness.shape != mass.shape:
        raise InvalidParameterError(
            f"W and B must have the same shape; the shapes are {stiffness.shape} and {mass.shape}."
        )
    diagonal = mass.diagonal()
    bad = np.flatnonzero(diagonal <= 0)
    if bad.size:
        raise InvalidParameterError(
            f"B must be positive definite; entry ({bad[0]}, {bad[0]}) is {diagonal[bad[0]]}."
        )
    return stiffness, mass


def _free_unknowns(fixed: ArrayLike | None, n: int) -> Int[np.ndarray, " f"] | None:
    if fixed is None or not np.size(fixed):
        return None
    free = np.setdiff1d(np.arange(n), require_points(fixed, n))
    if not free.size:
        raise InvalidParameterError(f"At least one unknown must be free; all {n} are fixed.")
    return free


def _interval(k: Integer | None, above: float | None, below: float | None) -> tuple[float, float]:
    if (k is None) == (below is None):
        raise InvalidParameterError(
            f"Exactly one of k and below must be given; k is {k} and below is {below}."
        )
    if below is None:
        if above is not None:
            raise InvalidParameterError(
                f"above needs below, the other end of an interval; above is {above}."
            )
        return 0.0, 0.0
    high = finite_number(below, "below")
    low = -np.inf if above is None else finite_number(above, "above")
    if low >= high:
        raise InvalidParameterError(
            f"above must be less than below; above is {above} and below is {below}."
        )
    return low, high


class _Moved(NamedTuple):
    """The pencil of W - origin·B, which has no negative eigenvalue but by rounding."""

    pencil: Pencil
    origin: float


def _above_zero(stiffness: sp.csr_array, mass: sp.csr_array) -> _Moved:
    """Move all eigenvalues above zero if some are negative, since the solver works from zero upward."""
    pencil = normalize(stiffness, mass)
    off_diagonal = abs(stiffness).sum(axis=1) - np.abs(stiffness.diagonal())
    dominant = stiffness.diagonal() >= off_diagonal * (1 - 1e-12)
    level = pencil.level
    if dominant.all() or _is_floor(pencil, -NEGATIVE_ROUNDING * level):
        return _Moved(pencil, 0.0)
    # The first of ever lower values that no eigenvalue is below, in the pencil's units
    floor = -1e-3 * level
    for _ in range(MOST_STEPS_DOWN):
        if _is_floor(pencil, floor):
            origin = float(np.ldexp(floor, pencil.value_exponent))
            return _Moved(normalize(stiffness - origin * mass, mass), origin)
        floor *= STEP_DOWN
    raise ConvergenceError(
        "W must have a lowest eigenvalue within the range of floats; none was found."
    )


def _is_floor(pencil: Pencil, shift: float) -> bool:
    """Whether a factor proves that no eigenvalue lies below a shift in the pencil's units."""
    return _bound_count(pencil, shift, 1.0) == 0


def _count(pencil: Pencil, value: float) -> int:
    """Count the eigenvalues below a value in the user's units."""
    shift = float(np.ldexp(value, -pencil.value_exponent))
    for step in COUNT_STEPS:
        below, above = shift - step * pencil.level, shift + step * pencil.level
        least, most = _bound_count(pencil, below, -1.0), _bound_count(pencil, above, 1.0)
        if least is not None and least == most:
            return least
    raise ConvergenceError(
        f"To count eigenvalues below a value none may be at it, up to rounding; {value:.6g} is too near to one. "
        "Choose a value a little higher or lower."
    )


def _bound_count(pencil: Pencil, shift: float, side: float) -> int | None:
    """Bound the number of eigenvalues below a shift, from above or (side -1) below; None if rounding forbids it."""
    plain = factorize_at(pencil, shift)
    if plain is None or not np.isfinite(loss := rounding(plain)).all():
        return None
    # W - σB - S with S above the rounding is nowhere above W - σB, and has at least as many negative
    # eigenvalues; with -S it has at most as many.
    slack = SLACK * loss
    moved = factorize_at(pencil, shift, side * slack)
    return moved.count if moved and (rounding(moved) <= slack).all() else None


def _require_any(moved: _Moved, low: float, high: float) -> None:
    """Raise an error if no eigenvalue is in an interval, with values as the user has them."""
    if not moved.origin:
        return  # the solver's own message has them
    try:
        first = 0 if np.isinf(low) else _count(moved.pencil, low - moved.origin)
        n_below = _count(moved.pencil, high - moved.origin)
    except ConvergenceError:
        return  # an eigenvalue is at an end
    if first == n_below:
        raise InvalidParameterError(
            f"There must be eigenvalues in the interval; {first} lie below {low:.6g} and none from there "
            f"to {high:.6g}."
        )


def _spectrum(
    moved: _Moved,
    pairs: Pairs,
    certificate: Certificate,
    mass: sp.csr_array,
    free: Int[np.ndarray, " f"] | None,
) -> Spectrum:
    """Convert pairs of a pencil to a spectrum in the user's units, on all unknowns."""
    pencil, origin = moved
    proof = in_user_units(pencil, certificate)
    vectors = to_user_vectors(pencil, pairs.vectors)
    if free is not None:
        every = np.zeros((mass.shape[0], vectors.shape[1]))
        every[free] = vectors
        vectors = freeze(every)
    return Spectrum(
        eigenvalues=freeze(pencil.values_out(pairs.values) + origin),
        eigenvectors=vectors,
        mass=mass,
        residuals=freeze(pencil.values_out(pairs.residuals)),
        certificate=replace(
            proof,
            shift=proof.shift + origin,
            floor=proof.floor + origin,
            gap=(proof.gap[0] + origin, proof.gap[1] + origin),
        ),
    )
