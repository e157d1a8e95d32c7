"""Spectra of functions that vanish on a set of points."""

from dataclasses import replace
from typing import SupportsIndex

import numpy as np
from jaxtyping import Int

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.solver import Progress, solve_spectrum
from eigenshape.spectral.spectrum import Spectrum


def solve_dirichlet(
    laplacian: Laplacian, k: SupportsIndex, fixed: Int[np.ndarray, " c"], *, progress: Progress | None = None
) -> Spectrum:
    """Compute the k lowest eigenpairs among functions that are zero at the fixed points.

    The pencil is cut down to the other points; its eigenvectors are 0 at the fixed ones. With the boundary of a surface
    fixed this is the Dirichlet condition, where the operator itself has the Neumann condition.

    Parameters
    ----------
    laplacian : Laplacian
    k : int
        Number of eigenpairs, 1 to the number of free points.
    fixed : (c,) int
        Points, each once or more.
    progress : callable, optional
        As in `solve_spectrum`.

    Returns
    -------
    Spectrum
        On all n points.

    Raises
    ------
    InvalidParameterError
        If a fixed point is out of range, none is free, or k is not in 1 to the number of free points.
    ConvergenceError
        If the proof of completeness fails.
    """
    bad = np.flatnonzero((fixed < 0) | (fixed >= laplacian.n_points))
    if bad.size:
        raise InvalidParameterError(
            f"fixed must hold points 0..{laplacian.n_points - 1}; entry {bad[0]} is {fixed[bad[0]]}."
        )
    free = np.setdiff1d(np.arange(laplacian.n_points), fixed)
    if not free.size:
        raise InvalidParameterError(f"Some point must be free; all {laplacian.n_points} are fixed.")
    inner = Laplacian(laplacian.stiffness[free][:, free], laplacian.mass[free][:, free])
    found = solve_spectrum(inner, k, progress=progress)
    vectors = np.zeros((laplacian.n_points, found.eigenvectors.shape[1]))
    vectors[free] = found.eigenvectors
    return replace(found, eigenvectors=frozen(vectors), mass=laplacian.mass)
