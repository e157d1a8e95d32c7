"""Crouzeix-Raviart elements: linear on each simplex, and equal in the mean over each facet between two.

Such functions jump across facets, so their eigenvalues are no upper bounds; with the constants here
they become lower bounds (`spectral.bounds.brackets`).
"""

from math import pi

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._corners import in_length, scaled_corners, side_lengths, triangular_sides
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facet_lists import FacetTable
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.requirements import require_sound, warn_of_seams
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators import elements
from eigenshape.operators.laplacian import Laplacian

TRIANGLE = 0.1893  # interpolation constant of triangles over their longest edge (Liu 2015)
REGULAR_TETRAHEDRON = 0.147  # that of a regular tetrahedron over its edge


def crouzeix_raviart_laplacian(mesh: MeshLike) -> Laplacian:
    """Build the Laplacian of Crouzeix-Raviart elements, whose unknowns are means over facets.

    On a simplex, the function of the facet opposite to corner a is ψ_a = 1 - m λ_a: its mean is 1
    on that facet and 0 on the others. So W sums up m² V ∇λ_a·∇λ_b, and B sums up V (m² - m + 2) /
    ((m+1)(m+2)) on the diagonal and V (2 - m) / ((m+1)(m+2)) off it: V/3 and 0 on triangles, 2V/5
    and -V/20 on tetrahedra (Crouzeix and Raviart 1973). Any number of simplices may share a facet;
    simplices that share less than a facet are not connected. On segments, whose facets are points,
    these are the linear elements.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    Laplacian
        On the facets, in the order of `es.geometry.facet_table(mesh).facets`, whose `boundary` is
        to be fixed for the Dirichlet condition. W in length^(m-2), B, the exact mass, in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, a point belongs to no simplex, or
        floats cannot hold these powers of lengths.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = es.shapes.grid(1, 1)
    >>> es.operators.crouzeix_raviart_laplacian(square).n_points  # five edges
    5
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    warn_of_seams(mesh)
    table = facet_table(mesh)
    weights = elements.stiffness(
        table.simplex_facets, mesh.dim**2 * elements.gradient_products(mesh), 1
    )
    return Laplacian(weights, facet_mass(table, simplex_volumes(mesh)))


def facet_mass(table: FacetTable, measure: Float[np.ndarray, " s"]) -> sp.csr_array:
    """Assemble ∫ ψ_a ψ_b for a measure of each simplex."""
    m = table.facets.shape[1]
    reference = (m * m * np.eye(m + 1) + 2 - m) / ((m + 1) * (m + 2))
    return elements.weighted_mass(measure, table.simplex_facets, reference)


def mass_floor(dim: int) -> float:
    """Return the largest c with B ≥ c diag(B) on one simplex: 1/2 on segments, 1 on triangles, 5/8 on tetrahedra."""
    return min(dim * dim, dim + 2) / (dim * dim - dim + 2)


def interpolation_constants(mesh: Mesh) -> Float[np.ndarray, " s"]:
    """Bound C with ‖u - Πu‖ ≤ C ‖∇(u - Πu)‖ on each simplex, in length.

    Πu is the linear function with the same mean as u on every facet. On a segment of length h, C =
    h/π. On a triangle with longest edge h, C = 0.1893 h (Liu 2015; equilateral ones need 0.1891).
    In any dimension C² = h²/π² + Σ |e|² / (m²(m+1)²(m+2)) over the edges e: w = u - Πu has the mean
    -(1/mV) ∫ (x - c)·∇w about the centroid c, and differs from it by h/π at most (Payne and
    Weinberger 1960; Bebendorf 2003), which is 0.3311 h where all edges are h (Carstensen and
    Puttkammer 2024, κ). A tetrahedron is also the image of a regular one under a linear map A, and
    C ≤ |A| times the constant of that one, 0.147 of its edge: linear maps keep facet means, and
    ∇(w∘A) is at most |A| times as long as ∇w. The smaller of both is taken.
    """
    corners, scale = scaled_corners(mesh)
    lengths = side_lengths(corners)
    longest, m = lengths.max(axis=1), mesh.dim
    if m == 1:
        bounds = longest / pi
    elif m == 2:
        bounds = TRIANGLE * longest
    else:
        bounds = np.sqrt(
            (longest / pi) ** 2 + (lengths**2).sum(axis=1) / (m**2 * (m + 1) ** 2 * (m + 2))
        )
    if m == 3:
        # |A| of the linear map to each tetrahedron from the regular one with edges of length 1
        regular = np.linalg.cholesky((np.eye(3) + 1) / 2).T
        maps = triangular_sides(corners)[1] @ np.linalg.inv(regular)
        stretch = np.linalg.norm(maps, 2, axis=(1, 2))
        bounds = np.minimum(bounds, REGULAR_TETRAHEDRON * stretch)
    return in_length(bounds, scale, 1)
