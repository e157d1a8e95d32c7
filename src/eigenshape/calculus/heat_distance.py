"""Geodesic distances by heat, on meshes of any dimension and on point clouds."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import TINY, ReadOnly, positive_number, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike
from certeig.sparse.symmetric_factor import SymmetricFactor
from eigenshape._arrays import NO_SOURCE, source_sets
from eigenshape._corners import edges_of, in_length
from eigenshape._vectors import size_one
from eigenshape.calculus.linear_solver import (
    GroundedFactor,
    factorize_definite,
    factorize_grounded,
)
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators import elements, flip_loops
from eigenshape.operators.clouds.cloud_triangles import cloud_cover
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.robust import delaunay_cover

# Sources that are solved for together: the lanes of a factor, and few enough that the gradients of
# all simplices fit in the cache.
SOURCES_AT_ONCE = 8


@record
class HeatGeodesics(ReadOnly):
    """A shape that is ready for geodesic distances by heat: two factors, used for all sources.

    `prepare_heat_geodesics` makes it. All lengths inside are divided by `scale`.

    Attributes
    ----------
    time : float
        Time t of the heat, in length².
    scale : float
        A power of two, the size of the coordinates, in length.
    nodes : (s, m+1) int
        Points at the corners of each simplex, or of each intrinsic triangle.
    products : (s, m+1, m+1) float
        V ∇λ_a·∇λ_b for the barycentric coordinates of each simplex of volume V.
    volumes : (s,) float
        Volumes V.
    components : (n,) int
        Connected component of each point.
    heat : SymmetricFactor
        Factor of B + tW.
    poisson : GroundedFactor
        Factor of W with one point of each component fixed.

    Examples
    --------
    Prepare a shape once, then ask for distances from many sources:

    >>> import eigenshape as es
    >>> solver = es.calculus.prepare_heat_geodesics(es.icosphere(3))
    >>> solver.n_points
    642
    >>> for source in (0, 100):
    ...     distances = es.calculus.heat_distances(solver, [source])[0]
    ...     print(f"{distances.max():.1f}")  # to the opposite point: π
    3.1
    3.1
    """

    time: float
    scale: float
    nodes: Int[np.ndarray, "s corners"]
    products: Float[np.ndarray, "s corners corners"]
    volumes: Float[np.ndarray, " s"]
    components: Int[np.ndarray, " n"]
    heat: SymmetricFactor
    poisson: GroundedFactor

    @property
    def n_points(self) -> int:
        """Number of points n."""
        return len(self.components)

    def __repr__(self) -> str:
        return f"HeatGeodesics({self.n_points} points, time={self.time:.4g})"


def prepare_heat_geodesics(
    shape: ShapeLike, *, time_factor: float = 1.0, robust: bool = False
) -> HeatGeodesics:
    """Factor the two equations of geodesic distances by heat, to be used for any number of sources.

    Parameters
    ----------
    shape : ShapeLike
        Triangles, tetrahedra, segments or m-simplices in R^d, or a point cloud of dimension 2
        in R³.
    time_factor : float
        The heat flows for the time t = time_factor × h², with the mean edge length h. More smooths
        the distance; less lets it depend more on single triangles.
    robust : bool
        Whether to use the triangles of `robust_laplacian`, mollified and flipped to intrinsic
        Delaunay ones, instead of those of the mesh. This helps with slivers, allows triangles of
        any quality and orientation, and costs about twice the time. Point clouds always use them.

    Returns
    -------
    HeatGeodesics

    Raises
    ------
    InvalidShapeError
        As in `cotangent_laplacian`, or as in `robust_laplacian` if `robust`, or if simplices are so
        thin that the equations cannot be factored.
    InvalidParameterError
        If `time_factor` is not positive and finite, or `robust` is set for another shape than
        triangles in R³ or a point cloud.

    See Also
    --------
    heat_distances : Distances from sources.

    Examples
    --------
    >>> import eigenshape as es
    >>> solver = es.calculus.prepare_heat_geodesics(es.icosphere(3))
    >>> es.calculus.heat_distances(solver, [0, 5]).shape
    (2, 642)
    """
    shape = as_shape(shape)
    factor = positive_number(time_factor, "time_factor")
    if isinstance(shape, PointCloud) or robust:
        if isinstance(shape, PointCloud):
            cover, scale = cloud_cover(shape)
        elif shape.dim != 2 or shape.points.shape[1] != 3:
            raise InvalidParameterError(
                f"robust must be False unless the shape is a triangle mesh in R^3; it is {shape!r}."
            )
        else:
            cover, scale = delaunay_cover(shape)
        nodes, volumes = cover.tails.reshape(-1, 3), flip_loops.areas(cover.lengths)
        # A ∇λ_a·∇λ_b in each intrinsic triangle: -cot(angle opposite to the side) / 2.
        weights = flip_loops.cotangents(cover.lengths).reshape(-1, 3) / 2
        products = np.zeros((len(weights), 3, 3))
        for corner in range(3):
            following = (corner + 1) % 3
            products[:, corner, following] = products[:, following, corner] = -weights[:, corner]
        diagonal = np.arange(3)
        products[:, diagonal, diagonal] = -products.sum(axis=2)
        once = np.arange(len(cover.twins)) < cover.twins
        length = float(cover.lengths[once].mean())
        mass = np.bincount(cover.tails, np.repeat(volumes / 3, 3), minlength=shape.n_points)
        stiffness = elements.stiffness(nodes, products, 1)
    else:
        require_sound(shape)
        points, scale = size_one(shape.points)
        unit = SimplicialMesh(points, shape.simplices)
        laplacian = cotangent_laplacian(unit, "lumped")
        stiffness, mass = laplacian.stiffness, laplacian.mass.diagonal()
        tails, heads = edges_of(shape).T
        length = float(np.linalg.norm(points[tails] - points[heads], axis=1).mean())
        nodes, volumes = shape.simplices, simplex_volumes(unit)
        products = elements.gradient_products(unit)
    time = factor * length**2
    poisson = factorize_grounded(stiffness)
    return HeatGeodesics(
        float(in_length(np.array([time]), scale, 2)[0]),
        scale,
        nodes,
        products,
        volumes,
        poisson.components,
        factorize_definite(sp.diags_array(mass) + time * stiffness),
        poisson,
    )


def heat_distances(
    shape: ShapeLike | HeatGeodesics, sources: ArrayLike, *, progress: Progress | None = None
) -> Float[np.ndarray, "k n"]:
    """Compute geodesic distances from some points, or sets of points, to all points by the heat method.

    Heat u of a short time t, (B + tW) u = e_source, falls off along shortest paths. So the field
    X = -∇u / |∇u| is close to the gradient of the distance, which follows from the Poisson equation
    Δφ = div X (Crane, Weischedel, Wardetzky 2013). Boundaries are free: no heat leaves there.

    One source costs two solves by factors. The error is of the order of the edge length.
    `geometry.geodesic_distances` is exact on flat regions, more accurate on coarse meshes, and
    faster for distances within a small radius; heat is smooth, works in any dimension and on point
    clouds, and is faster for whole shapes and many sources.

    Parameters
    ----------
    shape : ShapeLike or HeatGeodesics
        `prepare_heat_geodesics(shape)` keeps the factors for further calls, and has the options.
    sources : (k,) int, or k lists of int
        Points. The distance from a list of points is that to the nearest of them, with heat from
        all at once.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    (k, n) float
        Distance from each source to each point, in length; infinite on other components. It is 0 at
        the source, and 0 in the mean over the points of a list in a component. Near the source the
        values may be slightly negative.

    Raises
    ------
    InvalidParameterError
        If there is no source, a source is not a point, or heat is too small for a float somewhere:
        the shape is too long for the time.
    InvalidShapeError
        As in `prepare_heat_geodesics`.

    See Also
    --------
    eigenshape.geometry.geodesic_distances : The same by waves that cross triangles.

    Examples
    --------
    On the unit sphere, the distance from pole to pole is π.

    >>> import eigenshape as es
    >>> ball = es.icosphere(4)
    >>> distances = es.calculus.heat_distances(ball, [0])
    >>> bool(abs(distances.max() - 3.1416) < 0.03)
    True

    The distance of the vertices of a square from its left side.

    >>> square = es.shapes.grid(20, 20)
    >>> left = (square.vertices[:, 0] == 0).nonzero()[0]
    >>> distance = es.calculus.heat_distances(square, [left])[0]
    >>> bool(abs(distance - square.vertices[:, 0]).max() < 0.025)  # half an edge
    True
    """
    solver = shape if isinstance(shape, HeatGeodesics) else prepare_heat_geodesics(shape)
    wanted = source_sets(sources, solver.n_points)
    if not sum(len(points) for points in wanted):
        raise InvalidParameterError(NO_SOURCE)
    rows = np.empty((len(wanted), solver.n_points))
    n_components = int(solver.components.max()) + 1
    corners = solver.nodes.ravel()
    gather = sp.csr_array(
        (np.ones(len(corners)), corners, np.arange(len(corners) + 1)),
        shape=(len(corners), solver.n_points),
    )
    report_progress = progress or silent
    for first in range(0, len(wanted), SOURCES_AT_ONCE):
        report_progress(first / len(wanted), f"source {first + 1} of {len(wanted)}")
        chosen = wanted[first : first + SOURCES_AT_ONCE]
        impulses = np.zeros((solver.n_points, len(chosen)))
        for column, points in enumerate(chosen):
            impulses[points, column] = 1.0
        at_points = solver.heat.solve(impulses)
        has_source = np.zeros((n_components, len(chosen)), dtype=bool)
        points, columns = np.nonzero(impulses)
        has_source[solver.components[points], columns] = True
        require_heat(at_points, has_source[solver.components])
        # Far away heat is as small as 1e-300, so each simplex gets a unit of its own.
        heat = at_points[solver.nodes]
        heat = heat - heat[:, :1]
        largest = np.abs(heat).max(axis=1, keepdims=True)
        heat /= np.where(largest > 0, largest, 1.0)
        flow = np.einsum("sab,sbk->sak", solver.products, heat)
        # |∇u|² V = Σ u_a V ∇λ_a·∇λ_b u_b; so gradients are never formed.
        squares = np.einsum("sak,sak->sk", heat, flow)
        slopes = np.sqrt(np.maximum(squares, 0.0) / solver.volumes[:, None])
        flow /= np.where(slopes > 0, slopes, np.inf)[:, None]
        divergence = gather.T @ flow.reshape(len(corners), -1)
        found = solver.poisson.solve(-divergence)  # up to a constant on each component
        for column, points in enumerate(chosen):
            # The constant of each component makes the mean over its sources 0.
            at_sources = solver.components[points]
            counts = np.bincount(at_sources, minlength=n_components)
            sums = np.bincount(at_sources, found[points, column], minlength=n_components)
            with np.errstate(divide="ignore", invalid="ignore"):
                shifts = np.where(counts > 0, -sums / counts, np.inf)
            rows[first + column] = found[:, column] + shifts[solver.components]
    return in_length(rows, solver.scale, 1)


def require_heat(
    heat: Float[np.ndarray, "n b"], reached: Bool[np.ndarray, "n b"] | bool = True
) -> None:
    """Raise an error if heat of a source is too small for a float at a point of its component.

    Each edge takes a factor from it, of about 0.4 with the usual time; so 750 edges are too many.
    """
    # Below the normal floats digits are lost, and with them directions.
    cold = np.argwhere(reached & (np.abs(heat) < TINY))
    if len(cold):
        raise InvalidParameterError(
            f"Heat from the sources must reach every point; at point {cold[0, 0]} it is too small "
            f"for a float ({len(np.unique(cold[:, 0]))} such). Choose a larger time_factor; four "
            "times as much reaches about twice as far."
        )
