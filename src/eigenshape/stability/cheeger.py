"""Estimates of the isoperimetric (Cheeger) constant of a surface: how narrow its neck is."""

import numpy as np
from jaxtyping import Bool, Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, finite_number, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.spectral.spectrum import Spectrum

# Levels of each kind (evenly spaced, and quantiles), and again between the neighbors of the best
# one. Time grows in proportion.
N_LEVELS = 128
# Eigenfunctions whose level lines are tried. More find necks between smaller parts.
N_MODES = 6
# An eigenvalue 1 below this share of the last eigenvalue, plus its residual, counts as zero: the
# mesh is disconnected.
LEAST_RELATIVE_VALUE = 1e-9


@record
class CheegerEstimate(ReadOnly):
    """Bounds for the isoperimetric constant μ of a surface.

    μ is the smallest ratio of the length of a cut to the smaller of the two areas that it
    separates.

    Attributes
    ----------
    upper : float
        Smallest ratio among the cuts that were tried, in 1/length; μ is at most this. Multiplied by
        √area it is the μ of Theorem 4.2.1, whose manifold has volume 1.
    spectral : float
        2√λ₁ ≥ μ, Cheeger's inequality, in 1/length.
    lower : float
        Lower bound of μ in 1/length: Buser's inequality λ₁ ≤ 2aμ + 10μ² solved for μ, for a
        Gaussian curvature of at least -a²; 0 if no curvature was given.
    mode : int
        Number of the eigenfunction whose level line is the best cut.
    part : (n,) bool
        Vertices on the higher side of the best cut.

    See Also
    --------
    cheeger_estimate : Compute the bounds.

    Examples
    --------
    The constant of the unit sphere is 1, by a cut along the equator:

    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 4)
    >>> estimate = es.stability.cheeger_estimate(ball, spectrum)
    >>> round(estimate.upper, 1), round(estimate.spectral, 1)
    (1.0, 2.8)
    """

    upper: float
    spectral: float
    lower: float
    mode: int
    part: Bool[np.ndarray, " n"]


def cheeger_estimate(
    mesh: MeshLike,
    spectrum: Spectrum,
    *,
    n_modes: Integer = N_MODES,
    least_curvature: float | None = None,
) -> CheegerEstimate:
    """Estimate the isoperimetric constant of a closed surface (thesis 4.1).

    Bounds are those of Cheeger (1970) and Buser (1982). Level lines of the first eigenfunctions are
    tried as cuts. Their lengths, and the areas that they separate, are exact on the flat faces, so
    `upper` bounds the constant of the polyhedral surface. On a surface with boundary, level lines
    end at the boundary, whose own edges do not count.

    Parameters
    ----------
    mesh : MeshLike
        A connected mesh.
    spectrum : Spectrum
        Spectrum of the mesh from number 0 on, for example of `cotangent_laplacian(mesh)`.
    n_modes : int
        Number of eigenfunctions to try, without the constant one; fewer if the spectrum has fewer.
    least_curvature : float, optional
        Least Gaussian curvature of the smooth surface, in 1/length², for `lower`.

    Returns
    -------
    CheegerEstimate

    Raises
    ------
    InvalidParameterError
        If the spectrum belongs to another shape, does not begin at number 0 or has fewer than two
        eigenvalues, or if the mesh is disconnected (then μ = 0).

    Examples
    --------
    The best cut of the unit sphere is the equator, of length 2π and with areas 2π, so μ = 1:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 4)
    >>> round(es.stability.cheeger_estimate(mesh, spectrum).upper, 1)
    1.0
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    values, n_vertices = spectrum.eigenvalues, len(spectrum.eigenvectors)
    if n_vertices != mesh.n_vertices:
        raise InvalidParameterError(
            "The spectrum must be that of the mesh; "
            f"it has {n_vertices} points, the mesh {mesh.n_vertices} vertices."
        )
    if spectrum.certificate.first or len(values) < 2:
        raise InvalidParameterError(
            "The spectrum must begin at number 0 and have at least two eigenvalues; it begins at "
            f"number {spectrum.certificate.first} and holds {len(values)}."
        )
    if values[1] <= spectrum.residuals[1] + LEAST_RELATIVE_VALUE * values[-1]:
        raise InvalidParameterError(
            "The mesh must be connected; eigenvalue 1 is "
            f"{values[1]:.3g}, so it falls into pieces and the constant is 0. "
            "Take one component of it."
        )
    count = min(whole_number(n_modes, "n_modes", 1), len(values) - 1)
    upper, level, mode = min(
        (*_best_cut(mesh, spectrum.eigenvectors[:, mode]), mode) for mode in range(1, count + 1)
    )
    lower = 0.0
    if least_curvature is not None:
        a = np.sqrt(max(-finite_number(least_curvature, "least_curvature"), 0.0))
        lower = (np.sqrt(a**2 + 10 * values[1]) - a) / 10
    part = spectrum.eigenvectors[:, mode] > level
    return CheegerEstimate(upper, float(2 * np.sqrt(values[1])), float(lower), mode, part)


def _best_cut(mesh: TriangleMesh, function: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Return the smallest ratio of length to smaller area among level lines, and its level."""
    corners = np.sort(function[mesh.faces], axis=1)
    areas = face_areas(mesh)
    # |∇f| on each face, in value/length.
    p, q, r = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    a, b, c = (function[mesh.faces[:, corner]][:, None] for corner in range(3))
    # f is constant along a(r - q) + b(p - r) + c(q - p), whose length is |∇f| times twice the area.
    slopes = np.linalg.norm(a * (r - q) + b * (p - r) + c * (q - p), axis=1) / (2 * areas)
    shares = np.linspace(0, 1, N_LEVELS + 2)[1:-1]
    low, high = function.min(), function.max()
    # Evenly spaced levels sample necks, which have few vertices and a steep slope; quantiles sample
    # the rest.
    levels = np.union1d(np.quantile(function, shares), low + (high - low) * shares)
    best = int(np.argmin([_ratio(corners, areas, slopes, level) for level in levels]))
    near = levels[max(best - 1, 0) : best + 2]
    levels = np.union1d(near, near[0] + (near[-1] - near[0]) * shares)
    ratios = [_ratio(corners, areas, slopes, level) for level in levels]
    best = int(np.argmin(ratios))
    return ratios[best], float(levels[best])


def _ratio(
    corners: Float[np.ndarray, "f 3"],
    areas: Float[np.ndarray, " f"],
    slopes: Float[np.ndarray, " f"],
    level: float,
) -> float:
    """Return the length of a level line divided by the smaller area; corner values ascend."""
    low, middle, high = corners.T
    lower = (low < level) & (level <= middle)
    upper = (middle < level) & (level < high)
    below = np.where(high < level, areas, 0.0)
    length = 0.0
    for chosen, end, other in ((lower, low, middle), (upper, high, middle)):
        reach, spread = np.abs(level - end[chosen]), high[chosen] - low[chosen]
        # Between its lowest and its middle corner, a level line cuts off a smaller triangle, whose
        # area is the product of the shares of the two sides that it meets.
        share = reach / np.abs(other[chosen] - end[chosen]) * (reach / spread)
        below[chosen] = areas[chosen] * (share if end is low else 1 - share)
        length += float((2 * areas[chosen] * slopes[chosen] * share / reach).sum())
    part = float(below.sum())
    smaller = min(part, float(areas.sum()) - part)
    # A level at an extremal vertex may separate nothing.
    return length / smaller if smaller > 0 else np.inf
