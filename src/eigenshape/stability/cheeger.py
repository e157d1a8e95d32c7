"""How narrow the narrowest neck of a surface is: estimates of its isoperimetric constant."""

from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from jaxtyping import Bool, Float

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.spectral.spectrum import Spectrum

N_LEVELS = 128  # of each kind, and again between the best one's neighbours
N_MODES = 6


@dataclass(frozen=True, eq=False)
class CheegerEstimate:
    """What is known of μ, the least ratio of a cut's length to the smaller of the two areas that it parts.

    Attributes
    ----------
    upper : float
        The least ratio among the cuts that were tried: μ is at most this, in 1/length. Times √area it is the μ of
        Theorem 4.2.1, whose manifold has volume 1.
    spectral : float
        2√λ₁ ≥ μ, Cheeger's inequality, in 1/length.
    lower : float
        Buser's inequality λ₁ ≤ 2aμ + 10μ² solved for μ, with the Gaussian curvature ≥ -a²; 0 where that is not told.
    mode : int
        Number of the eigenfunction whose level line is the best cut.
    part : (n,) bool
        Vertices on its higher side.
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
    n_modes: SupportsIndex = N_MODES,
    least_curvature: float | None = None,
) -> CheegerEstimate:
    """Estimate the isoperimetric constant of a closed surface (thesis 4.1; Cheeger 1970, Buser 1982).

    Level lines of the first eigenfunctions are tried as cuts: their lengths and the areas that they part are exact on
    the flat faces, so `upper` bounds the constant of the polyhedral surface. On a surface with boundary, lines end
    there, and what lies along the boundary is no cut.

    Parameters
    ----------
    mesh : MeshLike
        In one piece.
    spectrum : Spectrum
        Of the mesh, from number 0 on, e.g. of `cotangent_laplacian(mesh)`.
    n_modes : int
        Eigenfunctions above the constant to try; fewer where the spectrum has fewer.
    least_curvature : float, optional
        Of the smooth surface, in 1/length²; for `lower`.

    Raises
    ------
    InvalidParameterError
        If the spectrum is that of another shape, begins higher up, holds the constant alone, or tells that the mesh
        is in several pieces (then μ = 0).
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    values = _first_values(mesh, spectrum)
    count = min(whole_number(n_modes, "n_modes", 1), len(values) - 1)
    cuts = [
        (*_best_cut(mesh, spectrum.eigenvectors[:, mode]), mode) for mode in range(1, count + 1)
    ]
    upper, level, mode = min(cuts)
    a = np.sqrt(max(-least_curvature, 0.0)) if least_curvature is not None else np.inf
    lower = (np.sqrt(a**2 + 10 * values[1]) - a) / 10 if np.isfinite(a) else 0.0
    part = frozen(spectrum.eigenvectors[:, mode] > level)
    return CheegerEstimate(upper, float(2 * np.sqrt(values[1])), float(lower), mode, part)


def _first_values(mesh: TriangleMesh, spectrum: Spectrum) -> Float[np.ndarray, " k"]:
    values, n_vertices = spectrum.eigenvalues, len(spectrum.eigenvectors)
    if n_vertices != mesh.n_vertices:
        raise InvalidParameterError(
            f"The spectrum must be that of the mesh; it has {n_vertices} points, the mesh {mesh.n_vertices} vertices."
        )
    if spectrum.certificate.first or len(values) < 2:
        raise InvalidParameterError(
            f"Cuts need the spectrum from number 0 on, with two eigenvalues at least; it begins at number "
            f"{spectrum.certificate.first} and holds {len(values)}."
        )
    if values[1] <= spectrum.residuals[1] + 1e-9 * values[-1]:
        raise InvalidParameterError(
            f"The isoperimetric constant is 0 where a mesh falls into pieces; eigenvalue 1 is {values[1]:.3g}."
        )
    return values


def _best_cut(mesh: TriangleMesh, function: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Return the least ratio of length to smaller area among level lines, and its level."""
    corners = np.sort(function[mesh.faces], axis=1)
    areas = face_areas(mesh)
    slopes = _slopes(mesh, function, areas)
    shares = np.linspace(0, 1, N_LEVELS + 2)[1:-1]
    low, high = function.min(), function.max()
    # Evenly spaced levels meet necks, which have few vertices and much slope; quantiles meet the rest.
    levels = np.union1d(np.quantile(function, shares), low + (high - low) * shares)
    best = int(np.argmin([_ratio(corners, areas, slopes, level) for level in levels]))
    near = levels[max(best - 1, 0) : best + 2]
    levels = np.union1d(near, near[0] + (near[-1] - near[0]) * shares)
    ratios = [_ratio(corners, areas, slopes, level) for level in levels]
    best = int(np.argmin(ratios))
    return ratios[best], float(levels[best])


def _slopes(
    mesh: TriangleMesh, function: Float[np.ndarray, " n"], areas: Float[np.ndarray, " f"]
) -> Float[np.ndarray, " f"]:
    """Return |∇f| on each face, in value/length."""
    p, q, r = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    a, b, c = (function[mesh.faces[:, corner]][:, None] for corner in range(3))
    # f is constant along a(r - q) + b(p - r) + c(q - p), which is as long as the gradient times twice the area.
    return np.linalg.norm(a * (r - q) + b * (p - r) + c * (q - p), axis=1) / (2 * areas)


def _ratio(
    corners: Float[np.ndarray, "f 3"],
    areas: Float[np.ndarray, " f"],
    slopes: Float[np.ndarray, " f"],
    level: float,
) -> float:
    """Return length over smaller area of the line at a level; corners hold ascending values."""
    low, middle, high = corners.T
    lower = (low < level) & (level <= middle)
    upper = (middle < level) & (level < high)
    below = np.where(high < level, areas, 0.0)
    length = 0.0
    for chosen, end, other in ((lower, low, middle), (upper, high, middle)):
        reach, spread = np.abs(level - end[chosen]), high[chosen] - low[chosen]
        # Between its lowest corner and the middle one, the part of a triangle below a level is similar to that corner.
        share = reach / np.abs(other[chosen] - end[chosen]) * (reach / spread)
        below[chosen] = areas[chosen] * (share if end is low else 1 - share)
        length += float((2 * areas[chosen] * slopes[chosen] * share / reach).sum())
    part = float(below.sum())
    smaller = min(part, float(areas.sum()) - part)
    return (
        length / smaller if smaller > 0 else np.inf
    )  # a level at a vertex of few faces may part nothing
