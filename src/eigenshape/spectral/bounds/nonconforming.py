"""Lower bounds of eigenvalues by Crouzeix-Raviart elements."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import ConvergenceError
from eigenshape._progress import Progress
from eigenshape.geometry.facet_lists import FacetTable
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.crouzeix_raviart import (
    crouzeix_raviart_laplacian,
    facet_mass,
    interpolation_constants,
    mass_floor,
)
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.bounds.rounding import enclose, relative_rounding
from eigenshape.spectral.solve import solve_spectrum

# Largest over mean C² up to which one constant serves all simplices.
EVEN_CONSTANTS = 1.5
# Factor between the weights μ that are tried,
WEIGHT_STEP = 2.0
# and how many are tried at most: each takes a solve.
MOST_WEIGHTS = 10
# Largest weight, relative to the pole at μ C_T² = 1.
NEAREST_POLE = 0.9

Values = Float[np.ndarray, " k"]


def lower_bounds(
    mesh: Mesh, table: FacetTable, k: int, fixed: Int[np.ndarray, " h"], progress: Progress | None
) -> Values:
    """Return lower bounds for the k lowest eigenvalues with some facets fixed at zero, in 1/length².

    The proof is in `bracket_eigenvalues`. If the interpolation constants are even, the weight μ = 0
    is enough. Otherwise weights near the last eigenvalue and in steps below it improve the bounds
    of the eigenvalues up to each of them, so that later solves are cheaper.
    """
    squares, measure = interpolation_constants(mesh) ** 2, simplex_volumes(mesh)
    mean, largest = float((squares * measure).sum() / measure.sum()), float(squares.max())
    stiffness, rounding = crouzeix_raviart_laplacian(mesh).stiffness, relative_rounding(mesh)

    def solve(measure: Float[np.ndarray, " s"], k: int, progress: Progress | None) -> Values:
        """Return lower bounds of Crouzeix-Raviart eigenvalues for given measures."""
        laplacian = Laplacian(stiffness, facet_mass(table, measure))
        found = solve_spectrum(laplacian, k, fixed=fixed, progress=progress)
        return enclose(found, laplacian, mass_floor(mesh.dim), rounding)[0]

    values = solve(measure, k, partly(progress, 0.3, 0.6))
    best = values / (1 + largest * values)
    done = 0.6
    for weight in _weights(values, mean, largest):
        n_served = min(int(np.count_nonzero(best <= weight)) + 1, k)
        after = min(done + 0.4 / WEIGHT_STEP * (n_served / k), 1.0)
        report, done = partly(progress, done, after), after
        try:
            found = solve(measure / (1 - weight * squares), n_served, report)
        except ConvergenceError:
            continue  # weights only improve the bounds, which hold without them
        bounds = found / (1 + largest * np.maximum(found - weight, 0.0))
        best[:n_served] = np.maximum(best[:n_served], bounds)
    return np.maximum.accumulate(best)


def _weights(values: Values, mean: float, largest: float) -> list[float]:
    """Return the weights μ to try: near the last eigenvalue, and in steps down to the first above 0."""
    positive = values[values > 0]
    if not positive.size or largest <= EVEN_CONSTANTS * mean:
        return []
    last = float(positive[-1])
    top = min(last / (1 + mean * last), NEAREST_POLE / largest)
    n_steps = int(np.ceil(np.log(max(top / float(positive[0]), 1.0)) / np.log(WEIGHT_STEP)))
    return [top / WEIGHT_STEP**step for step in range(min(n_steps + 1, MOST_WEIGHTS))]


def partly(progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return a progress function for a part of the work."""
    return progress and (lambda done, message: progress(start + done * (end - start), message))
