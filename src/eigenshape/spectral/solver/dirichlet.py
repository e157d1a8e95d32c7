"""Spectra of functions that vanish on a set of points."""

from dataclasses import replace
from typing import SupportsIndex

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen
from eigenshape._progress import Progress
from eigenshape.operators.boundary import dirichlet_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.solver.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum


def solve_dirichlet(
    laplacian: Laplacian,
    k: SupportsIndex | None,
    fixed: Int[np.ndarray, " c"],
    *,
    above: float | None = None,
    below: float | None = None,
    progress: Progress | None = None,
) -> Spectrum:
    """Compute the k lowest eigenpairs, or all below a value, among functions that are zero at the fixed points.

    The pencil is cut down to the other points; its eigenvectors are 0 at the fixed ones. With the boundary of a surface
    fixed this is the Dirichlet condition, where the operator itself has the Neumann condition.

    Parameters
    ----------
    laplacian : Laplacian
    k : int or None
        Number of eigenpairs, 1 to the number of free points.
    fixed : (c,) int
        Points, each once or more.
    above, below, progress : optional
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
    require_type(laplacian, Laplacian, "laplacian")
    inner, free = dirichlet_laplacian(laplacian, fixed)
    found = solve_spectrum(inner, k, above=above, below=below, progress=progress)
    vectors = np.zeros((laplacian.n_points, found.eigenvectors.shape[1]))
    vectors[free] = found.eigenvectors
    return replace(found, eigenvectors=frozen(vectors), mass=laplacian.mass)


def solve_free(
    laplacian: Laplacian,
    k: SupportsIndex,
    held: Int[np.ndarray, " h"],
    progress: Progress | None = None,
) -> Spectrum:
    """Compute the k lowest eigenpairs with some points held at zero, or none."""
    if not held.size:
        return solve_spectrum(laplacian, k, progress=progress)
    return solve_dirichlet(laplacian, k, held, progress=progress)
