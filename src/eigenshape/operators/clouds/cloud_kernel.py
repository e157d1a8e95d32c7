"""The Gaussian kernel on points without triangles, and how wide it must be on irregular ones."""

import warnings
from dataclasses import replace
from math import gamma, pi

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_type
from eigenshape._vectors import size_one
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.samples.quadrature import Quadrature, shape_quadrature
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.operators.choices import Correction, Form
from eigenshape.operators.clouds.kernel import (
    EDGE_FACTOR,
    NARROW,
    OR_ROBUST,
    KernelOptions,
    choose_kernel,
    kernel_laplacian,
    require_whole,
    warn_of_few,
    warn_of_narrow,
)
from eigenshape.operators.clouds.neighbors import neighbor_graph
from eigenshape.operators.laplacian import Laplacian

# Scatter of the cells of random points in the plane, standard deviation over mean: the unit in
# which the scatter of other points is measured. (Voronoi cells of a Poisson process have 0.53.)
RANDOM_SCATTER = 0.53
# Dimension m times the share of the volume on points where over half of the heat stays, at most.
# Chosen on 413 clouds of spheres, squares and cubes, of which a half, a tenth, a band or a gradient
# was thinned 1:1 to 1:200. There it is below 0.01 up to 1:2, and higher at one of 39 clouds of 1:3
# and 3 of 39 of 1:5. Of 205 clouds whose second eigenvalue was over 15 % too low for it, 168 are
# found; of the others, 28 have a gap or a hole with hardly a point in it. On tori, ellipsoids and
# creatures, 48 of 52 are found. Random points of a circle are 15 % off at 0.05, too.
MOST_STUCK = 0.05
# Points that the widened kernel may reach, on average. On surfaces it is then at most 4.1 e wide,
# from about 60,000 random points on; a row of the matrix has as many entries.
MOST_REACHED = 1000


def point_cloud_laplacian(  # noqa: PLR0913 - as mesh_laplacian
    cloud: PointCloud,
    *,
    t: float | None = None,
    h: float | None = None,
    edge_factor: float | None = None,
    correct: Correction | None = "log",
    form: Form = "random-walk",
    cutoff: float = 4.0,
) -> Laplacian:
    """Build the Laplacian of points that sample a manifold, at densities that vary up to about 1:5.

    This is the operator of `mesh_laplacian`, with the volume around each point taken from its
    Voronoi cell in the tangent plane (`es.geometry.shape_quadrature`; after Belkin, Sun, Wang
    2009).

    The defaults are those that were measured to be most accurate, not those of the thesis: on 4,000
    even points of the unit sphere 35 eigenvalues have a median error of 0.4 % instead of 3.4 %, and
    on random ones 0.5 % instead of 4.1 % (docs/operators.md). The operator of the thesis is
    `point_cloud_laplacian(cloud, edge_factor=2, correct=None, form="literal")`.

    Parameters
    ----------
    cloud : PointCloud
    t, h, edge_factor : float, optional
        As in `mesh_laplacian`; e is the mean distance of a point to its m(m+1) nearest neighbors.
        The default is h = 2e on even points. On irregular ones it is wider (`cloud_width`).
    correct : {"log", None}
        "log": solvers report λ = -log(1 - t μ)/t for an eigenvalue μ of the pencil, which removes
        the bias. None: the matrices are all of the operator, for equations with them.
    form : {"random-walk", "literal"}
        As in `mesh_laplacian`. The first form is as accurate on even points of closed surfaces as
        the second one, and more accurate under noise and at a boundary.
    cutoff : float
        As in `mesh_laplacian`.

    Returns
    -------
    Laplacian
        W in length^(m-2), B in length^m.

    Raises
    ------
    InvalidParameterError
        If more than one scale is given, one is not positive, or h < e.
    InvalidShapeError
        If two points are equal, the neighbors of a point do not span m dimensions, the kernel graph
        has more components than the graph of nearest neighbors, or the matrix needs more than half
        of the memory.

    Warns
    -----
    UserWarning
        If h < 1.5 e; if t is so large that fewer than ten eigenvalues can be distinguished; or if the
        points are so uneven that the kernel does not reach the neighbors of many: then low
        eigenvalues are too low by 15 % or more, and down to 0.

    See Also
    --------
    mesh_laplacian : The same kernel on meshes.
    cloud_width : The default width.

    Examples
    --------
    >>> import eigenshape as es
    >>> cloud = es.PointCloud(es.shapes.fibonacci_sphere(1000).vertices, dim=2)
    >>> laplacian = es.point_cloud_laplacian(cloud)
    >>> es.solve_spectrum(laplacian, 4).eigenvalues.round(1).tolist()
    [0.0, 2.0, 2.0, 2.0]
    >>> round(laplacian.kernel.edge_factor, 6)
    2.0
    """
    require_type(cloud, PointCloud, "cloud")
    options = KernelOptions(t, h, edge_factor, correct, form, cutoff)
    laplacian, fault = checked_laplacian(cloud, options)
    if fault:
        warnings.warn(f"{fault} {OR_ROBUST}", stacklevel=2)
    return laplacian


def checked_laplacian(cloud: PointCloud, options: KernelOptions) -> tuple[Laplacian, str]:
    """Return the operator, and a sentence if points lie too far apart for it, or "".

    Warn of a kernel that is too narrow or too wide in the name of the caller's caller.
    """
    measure = shape_quadrature(cloud)
    edge, m = neighbor_distance(cloud.points, cloud.dim), cloud.dim
    if options.t is None and options.h is None and options.edge_factor is None:
        options = replace(options, edge_factor=_width_factor(measure, edge))
    kernel = choose_kernel(options, edge)
    laplacian = kernel_laplacian(measure, kernel)
    joined = neighbor_graph(cloud.points, min(_near(m), cloud.n_points - 1))
    require_whole(laplacian, connected_components(joined, directed=False)[1], kernel)
    # Of the heat at a point, own/(own + away) is there after the time t. On even points that is
    # 0.28, 0.07 and 0.02 in dimensions 1, 2 and 3; near 1, the neighbors are out of reach.
    widths = measure.weights ** (1 / m) / kernel.width
    own = (widths / pi**0.5) ** m
    away = kernel.t * laplacian.stiffness.diagonal() / measure.weights
    stuck = own > away
    share = measure.weights[stuck].sum() / measure.weights.sum()
    if kernel.edge_factor < NARROW or share * m <= MOST_STUCK:
        warn_of_narrow(kernel, stacklevel=4)
        warn_of_few(measure, kernel, stacklevel=4)
        return laplacian, ""
    widest = int(np.argmax(widths))
    return laplacian, (
        f"A kernel must reach the neighbors of all points; over half of the heat stays at "
        f"{np.count_nonzero(stuck)} points, which hold {share:.1%} of the volume, so low eigenvalues "
        f"are too low. The cell of point {widest} is {widths[widest]:.3g} times as wide as the "
        f"kernel, h = {kernel.width:.4g}. Choose a larger t than {kernel.t:.4g}."
    )


def cloud_width(cloud: PointCloud) -> float:
    """Return the width h of the kernel that `point_cloud_laplacian` takes by default.

    h = e max(2, (σ/0.53 · R/e)^{2/(m+4)})

    with e the mean distance to the m(m+1) nearest neighbors, R the radius of the m-sphere of the
    same volume as all components together, and σ the scatter of the cells: the standard deviation
    of the volume of a cell over the mean volume of the cells around it. Even points have σ < 0.02,
    random ones of a surface 0.5.

    The rule balances two relative errors of an eigenvalue. The bias of the kernel is proportional
    to h²/R². The sum over the cells under the kernel differs from the integral by
    σ (e/h)^{1 + m/2}, because a point is not the centroid of its cell, and an eigenvalue changes by
    the square of that. Both are equal at the stated power of e. The error is then proportional to
    e^{(2m + 4)/(m + 4)}, which is e^{4/3} on a surface, whereas with h = 2e the second error does
    not decrease at all. The kernel is widened until it reaches 1,000 points, and no further.

    Parameters
    ----------
    cloud : PointCloud

    Returns
    -------
    float
        In length.

    Raises
    ------
    InvalidShapeError
        As `shape_quadrature`.

    See Also
    --------
    point_cloud_laplacian : The operator with this kernel.
    pointwise_time : The heat time at which the mesh Laplacian is best applied to functions.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.shapes.random_sphere(4000, rng=np.random.default_rng(1))
    >>> cloud = es.PointCloud(ball.vertices, dim=2)
    >>> h = es.operators.cloud_width(cloud)
    >>> round(h / es.point_cloud_laplacian(cloud, edge_factor=2).kernel.width, 1)
    1.3
    """
    require_type(cloud, PointCloud, "cloud")
    edge = neighbor_distance(cloud.points, cloud.dim)
    return edge * _width_factor(shape_quadrature(cloud), edge)


def _width_factor(measure: Quadrature, edge: float) -> float:
    """Return h / e of `cloud_width`."""
    m = measure.dim
    sphere = 2 * pi ** ((m + 1) / 2) / gamma((m + 1) / 2)  # volume of the unit m-sphere
    radius = (float(measure.weights.sum()) / sphere) ** (1 / m)
    # The scatter of cells is the standard deviation of weights over the mean weight of the points
    # around: where the density varies smoothly, a weight and those around it vary alike.
    points, _ = size_one(measure.points)
    weights = measure.weights / measure.weights.max()
    around = min(2 * _near(m), len(points) - 1)
    neighbors = cKDTree(points).query(points, around + 1)[1][:, 1:]
    scatter = float(np.std(weights / weights[neighbors].mean(axis=1)))
    share = scatter / RANDOM_SCATTER
    wide = (share * radius / edge) ** (2 / (m + 4))
    # The kernel is cut off at 4h; a ball of that radius holds its volume over the mean cell.
    cell = float(measure.weights.mean())
    ball = pi ** (m / 2) / gamma(m / 2 + 1)
    widest = (MOST_REACHED * cell / ball) ** (1 / m) / (4 * edge)
    return max(EDGE_FACTOR, min(wide, widest))


def _near(dim: int) -> int:
    """Return how many points touch one of the lattice A_m."""
    return dim * (dim + 1)
