"""The eigenpairs of W φ = λ B φ: the lowest ones or those of an interval, with their proof."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from certeig.certificate import Certificate
from certeig.kit.arrays import as_interval, finite_number, freeze, whole_number
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.matrices import as_symmetric, on_all_rows, require_points
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from certeig.solver.certified import certified_pairs
from certeig.solver.certify import certify_pairs, in_user_units
from certeig.solver.inertia import count_below_shift
from certeig.solver.origin import pencil_from_zero
from certeig.solver.pencil import normalize, to_user_vectors
from certeig.sparse.symmetric_factor import SymmetricFactor, factor_matrix
from certeig.spectrum import Spectrum


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
    searched for until both counts agree. Small matrices are solved densely. Diagonally dominant
    matrices with a hundred entries a row or more are not factored: Lanczos runs on a Chebyshev
    polynomial (Zhou, Saad, Tiago and Chelikowsky 2006), and eigenvalues are counted in a sparser
    matrix below the given one.

    If eigenvalues are negative, or all are far above zero, W - σB with σ near the lowest eigenvalue
    is solved, which moves all of them to where shifts tell them apart.

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
        eigenvalues below `above`. An eigenvalue at an end, up to rounding, may be on either side.
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
        magnitude, or eigenvalues are beyond the range of floats; or the memory is too small.
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
    [0.003793, 0.015159, 0.034054]
    >>> print(spectrum.certificate.explain()[:74])
    These are the 3 lowest eigenvalues of the pencil: none is missing and none

    All eigenvalues in an interval:

    >>> len(certeig.eigenpairs(string, above=1.1, below=2.0).eigenvalues)
    8
    """
    stiffness, whole = _matrices(W, B)
    mass = whole
    free = _free_unknowns(fixed, stiffness.shape[0])
    if free is not None:
        stiffness, mass = stiffness[free][:, free], mass[free][:, free]
    interval = as_interval(k, above, below, finite_number)
    wanted = 0 if k is None else whole_number(k, "k", 1, stiffness.shape[0])
    report = progress or silent
    with one_blas_thread():
        report(0.0, "scaling the matrices")
        pencil = pencil_from_zero(stiffness, mass)
        pairs, certificate = certified_pairs(pencil, wanted, interval, report)
        vectors = to_user_vectors(pencil, pairs.vectors)
        # A shift beyond the range of floats is as good as infinite.
        with np.errstate(over="ignore"):
            proof, values = in_user_units(pencil, certificate), pencil.places_out(pairs.values)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InvalidParameterError(
            f"Eigenvalues must lie within the range of floats; number {bad[0]} does not. Multiply W or B by a number."
        )
    report(1.0, "proved complete")
    return Spectrum(
        eigenvalues=freeze(values),
        eigenvectors=vectors if free is None else on_all_rows(vectors, free, whole.shape[0]),
        mass=whole,
        residuals=freeze(pencil.values_out(pairs.residuals)),
        certificate=proof,
    )


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
    matrices, sigma = _matrices(W, B), finite_number(value, "value")
    with one_blas_thread():
        pencil = normalize(*matrices)
        # A value beyond the range of floats in the pencil's units is as good as infinite.
        with np.errstate(over="ignore"):
            shift = float(pencil.places_in(np.array([sigma]))[0])
        return count_below_shift(pencil, shift)


def certify(W: Any, B: Any, eigenvalues: ArrayLike, eigenvectors: ArrayLike) -> Certificate:
    """Prove that given eigenpairs are the k lowest ones, or raise an error.

    Parameters
    ----------
    W, B : (n, n) sparse
        As for `eigenpairs`. B may be None, the identity.
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
    matrices = _matrices(W, B)
    with one_blas_thread():
        certificate, _ = certify_pairs(pencil_from_zero(*matrices), eigenvalues, eigenvectors)
    if not certificate.complete:
        raise ConvergenceError(certificate.explain())
    return certificate


def factorize(matrix: Any) -> SymmetricFactor:
    """Factor a symmetric sparse matrix, A = L D Lᵀ in an order of elimination by nested dissection.

    Pivots are taken from the diagonal, one after the other, so that an indefinite matrix may have
    no factor, or an inaccurate one: `rounding()` tells.

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
    factor = factor_matrix(_as_sparse("matrix", matrix))
    if factor is None:
        raise InvalidParameterError(
            "matrix must have a factor with its pivots on the diagonal; a pivot is zero or overflows. "
            "Add a small multiple of the identity."
        )
    return factor


def _matrices(W: Any, B: Any) -> tuple[sp.csr_array, sp.csr_array]:
    stiffness = _as_sparse("W", W)
    mass = sp.eye_array(stiffness.shape[0], format="csr") if B is None else _as_sparse("B", B)
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


def _as_sparse(name: str, value: Any) -> sp.csr_array:
    if isinstance(value, np.ndarray | list | tuple):
        raise InvalidParameterError(
            f"{name} must be a square sparse matrix; it is a {type(value).__name__} of shape {np.shape(value)}. "
            f"Pass scipy.sparse.csr_array({name})."
        )
    if np.shape(value) == (0, 0):
        raise InvalidParameterError(f"{name} must have at least one row; its shape is (0, 0).")
    return as_symmetric(name, value)


def _free_unknowns(fixed: ArrayLike | None, n: int) -> Int[np.ndarray, " f"] | None:
    if fixed is None or not np.size(fixed):
        return None
    free = np.setdiff1d(np.arange(n), require_points(fixed, n, "row"))
    if not free.size:
        raise InvalidParameterError(f"At least one unknown must be free; all {n} are fixed.")
    return free
