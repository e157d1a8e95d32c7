"""Spaces of eigenvectors: which belong together, and how far they are from those that they stand for."""

from itertools import pairwise

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_values
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.spectrum import Spectrum, require_lowest

EQUAL = 1e-9  # of the larger: exact eigenvalues that differ less are one
SEPARATED = 4.0
DEPENDENT = 1e-12  # least eigenvalue of the Gram matrix of unit columns: below, they span less than they should


@one_blas_thread()
def eigenspace_errors(
    spectrum: Spectrum, eigenvalues: ArrayLike, functions: Float[np.ndarray, "n j"]
) -> Float[np.ndarray, " k"]:
    """Measure how far each discrete eigenvector is from the exact eigenspace of its number (thesis 3.4, Figure 3.2b).

    ‖φ_i - P φ_i‖, P the projection on the span of all exact eigenfunctions with the eigenvalue of number i, as their
    values at the points. The thesis takes the plain inner product; this is that of the mass B, in which eigenvectors
    are orthonormal and which stands for the integral.

    Parameters
    ----------
    spectrum : Spectrum
        From the lowest eigenvalue on.
    eigenvalues : (j + 1 or more,) float
        Exact eigenvalues, ascending, each as often as its multiplicity says. One more than there are functions shows
        that the last group of these is whole.
    functions : (n, j) float
        Exact eigenfunctions at the points, a column for each of the first j eigenvalues; within a multiplicity any
        basis serves.

    Returns
    -------
    (min(k, j),) float
        Between 0 and 1: the sine of the angle between eigenvector and eigenspace.

    Raises
    ------
    InvalidParameterError
        If the spectrum does not begin with the lowest eigenvalue, eigenvalues are not ascending, functions are not
        one finite row a point, their last group is cut, or those of a group are dependent at these points.
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_lowest(spectrum, "spectrum")
    values = finite_values(eigenvalues, "eigenvalues")
    _require_functions(spectrum, values, functions)
    count = min(len(spectrum.eigenvalues), functions.shape[1])
    errors = np.empty(count)
    for group in _equal_runs(values[: functions.shape[1]]):
        found = spectrum.eigenvectors[:, group.start : min(group.stop, count)]
        if found.shape[1]:
            basis = orthonormal(
                functions[:, group], spectrum.mass, f"functions {group.start} to {group.stop - 1}"
            )
            errors[group.start : group.stop] = norms(
                outside(found, basis, spectrum.mass), spectrum.mass
            )
    return np.minimum(errors, 1.0)


def _require_functions(
    spectrum: Spectrum, values: Float[np.ndarray, " v"], functions: Float[np.ndarray, "n j"]
) -> None:
    n, shape = len(spectrum.eigenvectors), functions.shape
    if shape[0] != n or not shape[1]:
        raise InvalidParameterError(
            f"functions must have one row for each of {n} points; the shape is {shape}."
        )
    bad = np.flatnonzero(~np.isfinite(functions).all(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"functions must be finite; row {bad[0]} is not ({bad.size} such)."
        )
    falling = np.flatnonzero(np.diff(values) < 0)
    if falling.size:
        i = int(falling[0])
        raise InvalidParameterError(
            f"eigenvalues must ascend; number {i} is {values[i]:.6g} and number {i + 1} is {values[i + 1]:.6g}."
        )
    j = shape[1]
    if len(values) <= j:
        raise InvalidParameterError(
            f"eigenvalues must go on beyond the functions, to show that their last group is whole; there are "
            f"{len(values)} eigenvalues and {j} functions. Pass one more eigenvalue."
        )
    start = _equal_runs(values[: j + 1])[-1].start
    if start < j:
        raise InvalidParameterError(
            f"The last group of functions must be whole; eigenvalue {j} is {values[j]:.6g} as that of function "
            f"{j - 1} is. Pass functions for the whole group, or the first {start}."
        )


def _equal_runs(values: Float[np.ndarray, " k"]) -> list[slice]:
    cuts = np.flatnonzero(np.diff(values) > EQUAL * np.abs(values[1:])) + 1
    return _slices([0, *cuts.tolist(), len(values)])


def _slices(ends: list[int]) -> list[slice]:
    return [slice(start, stop) for start, stop in pairwise(ends)]


def separated_groups(eigenvalues: ArrayLike, *, ratio: float = SEPARATED) -> list[slice]:
    """Cut a spectrum where gaps are wide: groups of eigenvalues that only together have a stable space (thesis 3.5).

    A group is a run of eigenvalues whose distance from the rest is at least `ratio` times its own spread, last less
    first; of such runs the largest are taken, all eigenvalues together not counted. Each alone is such a run, and two
    that overlap lie one in the other: a gap at an end of each would be part of the spread of the other. So every
    eigenvalue is in one group. Nothing changes with the unit.

    Parameters
    ----------
    eigenvalues : (k,) float
        Ascending.
    ratio : float
        Above 1: the larger, the smaller the groups.

    Returns
    -------
    list of slice
        In order. What follows the last eigenvalue is not known, and is taken for far: the last group may be cut.

    Raises
    ------
    InvalidParameterError
        If eigenvalues are not finite or not ascending, or the ratio is not above 1.
    """
    values = finite_values(eigenvalues, "eigenvalues")
    if not ratio > 1:
        raise InvalidParameterError(f"ratio must be above 1; it is {ratio}.")
    if (np.diff(values) < 0).any():
        place = int(np.argmax(np.diff(values) < 0))
        raise InvalidParameterError(
            f"eigenvalues must ascend; number {place} is {values[place]:.6g} and number {place + 1} is "
            f"{values[place + 1]:.6g}."
        )
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

    Twice by Cholesky, of columns made of one length first: as orthonormal as rounding lets it be for all that pass
    (Yamamoto and others 2015).

    Raises
    ------
    InvalidParameterError
        If the columns are dependent.
    """
    basis = columns / np.abs(columns).max(axis=0).clip(np.finfo(np.float64).tiny)
    basis = basis / norms(basis, mass).clip(np.finfo(np.float64).tiny)
    least = float(np.linalg.eigvalsh(basis.T @ (mass @ basis))[0])
    if least < DEPENDENT:
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
    return np.asarray(vectors - basis @ (basis.T @ (mass @ vectors)))


def norms(vectors: Float[np.ndarray, "n q"], mass: sp.sparray) -> Float[np.ndarray, " q"]:
    """Return √(vᵀBv) of each column."""
    return np.sqrt(np.maximum(np.einsum("nq,nq->q", vectors, mass @ vectors), 0.0))
