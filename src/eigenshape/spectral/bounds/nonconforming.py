"""Lower bounds of eigenvalues by Crouzeix-Raviart elements, and the effect of rounding on bounds."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS
from certeig.kit.errors import ConvergenceError
from certeig.kit.progress import Progress
from eigenshape.geometry.facet_lists import FacetTable
from eigenshape.geometry.simplices import scaled_corners, simplex_volumes, triangular_sides
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.crouzeix_raviart import (
    crouzeix_raviart_laplacian,
    facet_mass,
    interpolation_constants,
    mass_floor,
)
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

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


def enclose(
    spectrum: Spectrum, laplacian: Laplacian, floor: float, relative: float
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return lower and upper bounds for the eigenvalues of the pencil in exact arithmetic, in 1/length².

    The errors of all eigenvalues, matched one to one, are at most √2 times the norm of the
    residuals (Kahan 1967; Parlett 1998, theorem 11.5.1), plus the lack of orthonormality of the
    vectors. The absolute rounding errors, in sums over rows and in the residuals, are at most (row
    length + 4) eps times the largest row of |W| over B.

    Parameters
    ----------
    spectrum : Spectrum
    laplacian : Laplacian
        The operator of the spectrum, without boundary conditions.
    floor : float
        c with B ≥ c diag(B).
    relative : float
        `relative_rounding` of the mesh.
    """
    values = spectrum.eigenvalues
    askew = 2 * len(values) * spectrum.certificate.orthonormality * values[-1]
    stray = np.sqrt(2) * float(np.linalg.norm(spectrum.residuals)) + askew
    rows = abs(laplacian.stiffness).sum(axis=1) / laplacian.mass.diagonal()
    longest_row = int(np.diff(laplacian.stiffness.indptr).max())
    stray += (longest_row + 4) * EPS * float(rows.max()) / floor
    # With slivers rounding may exceed the eigenvalue: then the lower bound is 0.
    lower = np.maximum(values - stray, 0.0) * max(1 - relative, 0.0)
    return lower, (values + stray) * (1 + relative)


def relative_rounding(mesh: Mesh) -> float:
    """Bound the relative error that the rounded entries of linear elements cause in every eigenvalue.

    An error ε |∇λ_a| |∇λ_b| V in each product V ∇λ_a·∇λ_b changes Σ w_ab (u_a - u_b)², which is V
    |∇u|², by at most ε q of itself, q = Σ |e_ab|² |∇λ_a| |∇λ_b| over the edges: 4 on an equilateral
    triangle, the square of the aspect ratio on a flat one. Sides, their triangle and its inverse
    err like linear maps that are within eps q of the identity. Counted together that is below 4
    (m+1)² (d + t) eps q, with t simplices at most around an edge. The coordinates as stored are
    taken for exact.
    """
    corners, _ = scaled_corners(mesh)
    edges = mesh.simplices[:, np.column_stack(np.triu_indices(mesh.dim + 1, 1))].reshape(-1, 2)
    _, n_around = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    terms = corners.shape[2] + int(n_around.max())
    inner = np.linalg.inv(triangular_sides(corners)[1])
    gradients = np.linalg.norm(
        np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1), axis=2
    )
    first, second = np.triu_indices(corners.shape[1], 1)
    squares = ((corners[:, first] - corners[:, second]) ** 2).sum(axis=2)
    flatness = (squares * gradients[:, first] * gradients[:, second]).sum(axis=1)
    return float(4 * (mesh.dim + 1) ** 2 * terms * EPS * flatness.max())
