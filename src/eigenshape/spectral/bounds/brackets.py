"""Lower and upper bounds for the eigenvalues of a mesh itself, rather than of a matrix."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import ReadOnly, freeze, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import Integer
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import facet_components, facet_table, without_pinches
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import in_length
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.operators.choices import Condition
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import interpolation_constants, longest_edges
from eigenshape.spectral.bounds.nonconforming import (
    enclose,
    lower_bounds,
    partly,
    relative_rounding,
)
from eigenshape.spectral.solve import solve_spectrum

# Largest c with B ≥ c diag(B) for the consistent mass of linear elements, in any dimension.
LINEAR_FLOOR = 0.5
NO_POINTS = np.empty(0, dtype=np.int64)


@record
class Brackets(ReadOnly):
    """Guaranteed lower and upper bounds for the k lowest eigenvalues of a mesh.

    The eigenvalues are those of the Laplace operator of the shape made of flat simplices.

    Attributes
    ----------
    lower, upper : (k,) float
        lower ≤ λ ≤ upper, each ascending, in 1/length²; both exactly 0 for the first `n_zero`.
    boundary : {"neumann", "dirichlet"}
        The boundary condition.
    n_zero : int
        Number of eigenvalues that are 0 by topology: one for each part that is connected by facets;
        with the Dirichlet condition, one for each part without boundary.
    longest_edge : float
        In length.
    constant : float
        C, the largest interpolation constant of a simplex, in length. No lower bound exceeds 1/C².
    rounding : float
        Share of the last upper bound by which rounding and residuals widen it.

    See Also
    --------
    bracket_eigenvalues : Compute the bounds.

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.bracket_eigenvalues(es.icosphere(2), 5)
    >>> len(found.lower), found.n_zero
    (5, 1)
    >>> print(found.explain()[:61])
    Each of the 5 lowest eigenvalues of this shape, its simplices
    """

    lower: Float[np.ndarray, " k"]
    upper: Float[np.ndarray, " k"]
    boundary: Condition
    n_zero: int
    longest_edge: float
    constant: float
    rounding: float

    def explain(self) -> str:
        """Return a text that says what is bounded, and how tightly."""
        how = (
            f"Each of the {len(self.upper)} lowest eigenvalues of this shape, its simplices taken as flat "
            f"({self.boundary.capitalize()} condition), lies in its bracket. Linear elements bound it from above, "
            f"Crouzeix-Raviart elements from below with the interpolation constant {self.constant:.4g}, "
            f"{self.constant / self.longest_edge:.4f} of the longest edge; rounding and residuals are counted in, "
            f"{self.rounding:.1e} at the last."
        )
        zero = {0: "", 1: "The first is 0. "}.get(self.n_zero, f"The first {self.n_zero} are 0. ")
        if self.n_zero == len(self.upper):
            return f"{how} {zero.strip()}"
        if self.lower[-1] == 0:
            return (
                f"{how} {zero}Rounding in slivers leaves no lower bound above 0. Repair or remesh nearly "
                f"degenerate simplices."
            )
        widths = 1 - self.lower[self.n_zero :] / self.upper[self.n_zero :]
        return (
            f"{how} {zero}The brackets are {np.median(widths):.2g} of their upper ends wide in the median, "
            f"{widths.max():.2g} at most; edges of half the length make them a quarter."
        )


@one_blas_thread()
def bracket_eigenvalues(
    mesh: MeshLike,
    k: Integer,
    *,
    boundary: Condition = "neumann",
    progress: Progress | None = None,
) -> Brackets:
    """Compute guaranteed lower and upper bounds for the k lowest eigenvalues of a mesh.

    The mesh is taken as the shape made of its flat simplices. Upper bounds come from linear
    elements with consistent mass (Rayleigh-Ritz), lower bounds from Crouzeix-Raviart elements, as
    follows.

    Let Πu have the facet means of u, and w = u - Πu. Green's formula on each simplex gives
    |u|₁² = |Πu|₁² + |w|₁², and `interpolation_constants` gives ‖w‖_T ≤ C_T |w|_{1,T}. Both need only
    that neighboring simplices have the same facet means: the angles around a vertex may have any
    sum, a facet may have any number of simplices, and the ambient space does not matter. If
    μ C_T² < 1 on all simplices, (a + b)² ≤ a²/(1-θ) + b²/θ with θ = μ C_T² gives
    ‖u‖² ≤ Σ ‖Πu‖_T² / (1 - μ C_T²) + |w|₁²/μ. Let λ*_k be the eigenvalues of the elements with mass
    weighted by 1/(1 - μ C_T²). Min-max over the span of the first k eigenfunctions gives
    λ_k ≥ λ*_k if λ*_k ≤ μ, and otherwise λ_k ≥ λ*_k / (1 + C² (λ*_k - μ)), C the largest C_T. With
    μ = 0 this is Liu (2015), after Carstensen and Gedicke (2014). Larger μ are tried if C_T varies,
    so that a single long edge does not weaken all bounds, as in the stabilized elements of
    Carstensen and Puttkammer (2024). On curves both bounds use linear elements.

    The bounds include residuals and the rounding of matrix entries (`spectral.bounds.rounding`).
    They do not include the last few roundings in their own computation, or errors in the
    coordinates.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension. Triangles that share only a point are not connected.
    k : int
        Number of eigenvalues, 1 to the number of free points.
    boundary : {"neumann", "dirichlet"}
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    Brackets
        In 1/length². Their width is proportional to the square of the edge length.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, a point belongs to no simplex, or
        floats cannot hold 1/length².
    InvalidParameterError
        If `boundary` is unknown, or "dirichlet" on a mesh without boundary or without inner points;
        or k is out of range.
    ConvergenceError
        If the proof of completeness fails.

    See Also
    --------
    solve_spectrum : Certified eigenvalues of the matrices.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = es.shapes.grid(8, 8)
    >>> found = es.bracket_eigenvalues(square, 4)
    >>> exact = es.shapes.box_eigenvalues(4, (1, 1), "neumann")
    >>> bool((found.lower <= exact).all() and (exact <= found.upper).all())
    True
    """
    mesh = as_simplicial(mesh)
    require_choice(boundary, Condition, "boundary")
    require_sound(mesh)
    points, scale = size_one(mesh.points)
    unit = SimplicialMesh(points, mesh.simplices)
    table = facet_table(unit)
    fixed = table.boundary if boundary == "dirichlet" else NO_POINTS
    # Functions of linear elements are functions on the shape, so their eigenvalues are upper ends.
    conforming = without_pinches(unit)
    held = boundary_vertices(conforming) if boundary == "dirichlet" else NO_POINTS
    n_free = conforming.n_points - len(held)
    if boundary == "dirichlet" and not (len(held) and n_free):
        fact = f"{unit!r} has {len(held)} points on its boundary and {n_free} inside"
        raise InvalidParameterError(
            f"boundary='dirichlet' needs a boundary and points inside; {fact}."
        )
    count = whole_number(k, "k", 1, n_free)
    laplacian = cotangent_laplacian(conforming, "consistent")
    found = solve_spectrum(laplacian, count, fixed=held, progress=partly(progress, 0.0, 0.3))
    upper = enclose(found, laplacian, LINEAR_FLOOR, relative_rounding(unit))[1]
    rounding = float(1 - found.eigenvalues[-1] / upper[-1]) if upper[-1] else 0.0
    lower = lower_bounds(unit, table, len(upper), fixed, progress)

    # A part without fixed facets has the constants of eigenvalue 0.
    n_parts, labels = facet_components(table)
    with_fixed = np.isin(table.simplex_facets, fixed).any(axis=1)
    n_zero = min(n_parts - len(np.unique(labels[with_fixed])), len(upper))
    lower[:n_zero] = upper[:n_zero] = 0.0
    if progress:
        progress(1.0, "bracketed")
    return Brackets(
        lower=freeze(in_length(lower, scale, -2)),
        upper=freeze(in_length(upper, scale, -2)),
        boundary=boundary,
        n_zero=n_zero,
        longest_edge=scale * float(longest_edges(unit).max()),
        constant=scale * float(interpolation_constants(unit).max()),
        rounding=rounding,
    )
