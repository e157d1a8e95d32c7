"""Eigenspaces: which eigenvectors belong together, and how accurate they are."""

from itertools import pairwise

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import TINY, finite_values, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import require_finite_rows
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum

# Exact eigenvalues that differ by less than this share of the larger one are copies of one
# eigenvalue: formulas evaluate them to about 1e-15.
EQUAL_EIGENVALUES = 1e-9
# Least ratio of the gap around a group to its spread. A larger ratio gives smaller groups.
SEPARATED = 4.0
# Least eigenvalue of the Gram matrix of unit columns that count as independent. Cholesky loses
# about 1e-16 / DEPENDENT_FUNCTIONS of orthonormality at once, so two steps still reach rounding.
DEPENDENT_FUNCTIONS = 1e-12


@one_blas_thread()
def eigenspace_errors(
    spectrum: Spectrum, eigenvalues: ArrayLike, functions: Float[np.ndarray, "n j"]
) -> Float[np.ndarray, " k"]:
    """Measure the distance of each eigenvector from the exact eigenspace (thesis 3.4, Figure 3.2b).

    The distance is ‖φ_i - P φ_i‖, with P the projection on the span of all exact eigenfunctions of
    eigenvalue number i, sampled at the points. The thesis uses the plain inner product; this
    function uses that of the mass B, in which eigenvectors are orthonormal and which approximates
    the integral.

    Parameters
    ----------
    spectrum : Spectrum
        From the lowest eigenvalue on.
    eigenvalues : (j + 1 or more,) float
        Exact eigenvalues, ascending, repeated by multiplicity. There must be more eigenvalues than
        functions, to show that the last group of functions is complete.
    functions : (n, j) float
        Exact eigenfunctions at the points, one column for each of the first j eigenvalues. For a
        multiple eigenvalue any basis of the eigenspace is suitable.

    Returns
    -------
    (min(k, j),) float
        Between 0 and 1: the sine of the angle between eigenvector and eigenspace.

    Raises
    ------
    InvalidParameterError
        If the spectrum does not begin with the lowest eigenvalue, eigenvalues are not ascending,
        `functions` does not have one finite row for each point, their last group is incomplete, or
        the functions of a group are linearly dependent at these points.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 9)
    >>> exact = es.shapes.sphere_eigenvalues(10)
    >>> functions = es.shapes.sphere_harmonics(ball.vertices, 9)
    >>> bool(es.spectral.eigenspace_errors(spectrum, exact, functions).max() < 0.01)
    True
    """
    require_lowest(spectrum, "spectrum")
    values = finite_values(eigenvalues, "eigenvalues")
    n, j = len(spectrum.eigenvectors), functions.shape[1]
    if len(functions) != n or not j:
        raise InvalidParameterError(
            f"functions must have one row for each of {n} points; the shape is {functions.shape}."
        )
    require_finite_rows(functions, "functions", "point")
    _require_ascending(values)
    if len(values) <= j:
        raise InvalidParameterError(
            f"There must be more eigenvalues than functions, to show that the last group is complete; there are "
            f"{len(values)} eigenvalues and {j} functions. Pass one more eigenvalue."
        )
    start = _equal_runs(values[: j + 1])[-1].start
    if start < j:
        raise InvalidParameterError(
            f"The last group of functions must be complete; eigenvalue {j} is {values[j]:.6g} as that of function "
            f"{j - 1} is. Pass functions for the whole group, or the first {start}."
        )
    count = min(len(spectrum.eigenvalues), j)
    errors = np.empty(count)
    for group in _equal_runs(values[:j]):
        found = spectrum.eigenvectors[:, group.start : min(group.stop, count)]
        if found.shape[1]:
            basis = orthonormal(
                functions[:, group], spectrum.mass, f"functions {group.start} to {group.stop - 1}"
            )
            errors[group.start : group.stop] = norms(
                outside(found, basis, spectrum.mass), spectrum.mass
            )
    return np.minimum(errors, 1.0)


def _require_ascending(values: Float[np.ndarray, " v"]) -> None:
    falling = np.flatnonzero(np.diff(values) < 0)
    if falling.size:
        i = int(falling[0])
        raise InvalidParameterError(
            f"eigenvalues must ascend; number {i} is {values[i]:.6g} and number {i + 1} is {values[i + 1]:.6g}."
        )


def _equal_runs(values: Float[np.ndarray, " k"]) -> list[slice]:
    cuts = np.flatnonzero(np.diff(values) > EQUAL_EIGENVALUES * np.abs(values[1:])) + 1
    return _slices([0, *cuts.tolist(), len(values)])


def _slices(ends: list[int]) -> list[slice]:
    return [slice(start, stop) for start, stop in pairwise(ends)]


def separated_groups(eigenvalues: ArrayLike, *, ratio: float = SEPARATED) -> list[slice]:
    """Divide eigenvalues into groups that are separated by wide gaps (thesis 3.5).

    Only the space of a whole group is stable under perturbations. A group is a run of eigenvalues
    whose distance from the rest is at least `ratio` times its own spread, last minus first. The
    largest such runs are returned, the run of all eigenvalues excluded. Each single eigenvalue is
    such a run, and of two runs that overlap one contains the other: otherwise a gap at an end of
    each would be part of the spread of the other. So every eigenvalue is in exactly one group. The
    result does not depend on units.

    Parameters
    ----------
    eigenvalues : (k,) float
        Ascending.
    ratio : float
        Above 1. A larger ratio gives smaller groups.

    Returns
    -------
    list of slice
        In ascending order. The eigenvalue after the last is unknown and assumed to be far away, so
        the last group may be incomplete.

    Raises
    ------
    InvalidParameterError
        If eigenvalues are not finite or not ascending, or the ratio is not above 1 and finite.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.spectral.separated_groups([0.0, 2.0, 2.01, 2.02, 6.0])
    [slice(0, 1, None), slice(1, 4, None), slice(4, 5, None)]
    """
    values = finite_values(eigenvalues, "eigenvalues")
    if not 1 < ratio < np.inf:
        raise InvalidParameterError(f"ratio must be above 1, and finite; it is {ratio}.")
    _require_ascending(values)
    gaps = np.concatenate([[np.inf], np.diff(values), [np.inf]])
    ends = [0]
    while ends[-1] < len(values):
        start = ends[-1]
        nearest = np.minimum(gaps[start], gaps[start + 1 :])
        whole = nearest >= ratio * (values[start:] - values[start])
        if start == 0 and values[-1] > values[0]:
            whole[-1] = False
        ends.append(start + 1 + int(np.flatnonzero(whole)[-1]))
    return _slices(ends)


def orthonormal(
    columns: Float[np.ndarray, "n p"], mass: sp.sparray, name: str
) -> Float[np.ndarray, "n p"]:
    """Return a basis of the span of these columns that is orthonormal in B.

    Twice by Cholesky, of columns made of one length first: as orthonormal as rounding lets it be
    for all that pass (Yamamoto and others 2015).

    Raises an InvalidParameterError if the columns are dependent.
    """
    basis = columns / np.abs(columns).max(axis=0).clip(TINY)
    basis = basis / norms(basis, mass).clip(TINY)
    least = float(np.linalg.eigvalsh(basis.T @ (mass @ basis))[0])
    if least < DEPENDENT_FUNCTIONS:
        raise InvalidParameterError(
            f"{name} must be independent at the points; the least eigenvalue of their Gram matrix is {least:.1e}."
        )
    for _ in range(2):
        triangle = sl.cholesky(basis.T @ (mass @ basis))
        basis = np.ascontiguousarray(sl.solve_triangular(triangle, basis.T, trans="T").T)
    return basis


def outside(
    vectors: Float[np.ndarray, "n q"], basis: Float[np.ndarray, "n p"], mass: sp.sparray
) -> Float[np.ndarray, "n q"]:
    """Return what the span of a B-orthonormal basis does not hold of some vectors."""
    return vectors - basis @ (basis.T @ (mass @ vectors))


def principal_angles(
    vectors: Float[np.ndarray, "n p"], basis: Float[np.ndarray, "n p"], mass: sp.sparray
) -> Float[np.ndarray, " p"]:
    """Return the angles between the spans of two B-orthonormal bases, ascending (Björck and Golub 1973)."""
    cosines = np.linalg.svd(vectors.T @ (mass @ basis), compute_uv=False)
    # A small angle is known by its sine, a large one by its cosine.
    rest = outside(basis, vectors, mass)
    squares = np.linalg.eigvalsh(rest.T @ (mass @ rest))
    return np.arctan2(np.sqrt(np.maximum(squares, 0.0)), cosines)


def corresponding_points(
    points: ArrayLike | None, one: Spectrum, two: Spectrum, names: tuple[str, str]
) -> Int[np.ndarray, " n"]:
    """Return the point of `two` for each point of `one`: by default that of the same number.

    Raise InvalidParameterError if there is not one for each.
    """
    n_one, n_two = len(one.eigenvectors), len(two.eigenvectors)
    first, second = names
    if points is None and n_one != n_two:
        raise InvalidParameterError(
            f"Spectra on different numbers of points need corresponding points; {first} has {n_one} points and "
            f"{second} has {n_two}. Pass points, the point of {second} that corresponds to each point of {first}."
        )
    given = np.arange(n_one) if points is None else points
    partners = whole_numbers(given, f"a point of {second}", 0, n_two - 1)
    if len(partners) != n_one:
        raise InvalidParameterError(
            f"points must hold one point of {second} for each of {n_one} points of {first}; there are "
            f"{len(partners)}."
        )
    return partners


def norms(vectors: Float[np.ndarray, "n q"], mass: sp.sparray) -> Float[np.ndarray, " q"]:
    """Return √(vᵀBv) of each column."""
    return np.sqrt(np.maximum(np.einsum("nq,nq->q", vectors, mass @ vectors), 0.0))
