"""Quadrature: points with weights, so that ∫ f over a shape is about Σ w_i f(x_i), and how shapes get them."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError, cKDTree

from certeig.kit.arrays import ReadOnly, freeze, positive_values, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape._corners import in_length
from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape._vectors import size_one
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.samples.cell_loops import cell_areas
from eigenshape.geometry.simplices import dual_volumes


@record
class Quadrature(ReadOnly):
    """Points of an m-dimensional shape in R^d with positive weights.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit. They are copied, and the copy is read-only.
    weights : (n,) float or None
        Weight of each point, positive: in length^m, or without unit if the weights sum to 1. They
        are copied, and the copy is read-only. None stands for 1/n each, as for a uniform random
        sample (thesis 2.2).
    dim : int
        Dimension m of the shape, 1 to d.

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    InvalidParameterError
        If a weight is not positive and finite, the number of weights is not the number of points,
        or `dim` is not in 1..d.

    See Also
    --------
    shape_quadrature : That of a mesh or of a point cloud.

    Examples
    --------
    Simpson's rule on the interval from 0 to 1.

    >>> import eigenshape as es
    >>> es.geometry.Quadrature([[0], [0.5], [1]], [1 / 6, 4 / 6, 1 / 6], dim=1)
    Quadrature(3 points in R^1, dim=1)
    """

    points: Float[np.ndarray, "n d"]
    weights: Float[np.ndarray, " n"]
    dim: int

    def __init__(self, points: ArrayLike, weights: ArrayLike | None, dim: Integer) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A quadrature must have points; it has none.")
        share = np.full(len(coordinates), 1 / len(coordinates))
        measure = positive_values(share if weights is None else weights, "weights")
        if len(measure) != len(coordinates):
            raise InvalidParameterError(
                "weights must hold one number per point; "
                f"there are {len(measure)} for {len(coordinates)} points."
            )
        vars(self).update(
            dim=whole_number(dim, "dim", 1, coordinates.shape[1]),
            points=freeze(coordinates),
            weights=freeze(measure),
        )

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)

    def __repr__(self) -> str:
        return f"Quadrature({self.n_points} points in R^{self.points.shape[1]}, dim={self.dim})"


# Neighbors of a point by dimension m, and 20 m² for larger m: enough to surround a random point on
# all sides. More neighbors cost time and reach farther along a curved manifold.
NEIGHBORS = {1: 20, 2: 30, 3: 60}
# A neighborhood has m dimensions if the m-th of its singular values is more than this share of the
# first. Below, its m-th direction is mostly rounding.
FLATTEST = 1e-7
# Points whose neighborhoods are in memory at a time.
POINTS_AT_ONCE = 4096


def shape_quadrature(shape: ShapeLike, *, n_neighbors: Integer | None = None) -> Quadrature:
    """Compute the share of a shape that each of its points represents.

    A point of a mesh has 1/(m+1) of the volume of its simplices, which is exact for functions that
    are linear on each simplex.

    The neighbors of a point of a cloud are placed in the tangent plane that fits them best, each at
    its true distance. The weight of the point is the volume of its Voronoi cell in that plane. At a
    boundary the cell ends at the convex hull of the neighbors. On a curve the weight is half the
    distance between the previous point and the next one. The density of the points may vary.

    Parameters
    ----------
    shape : ShapeLike
        A mesh of any dimension m, or a point cloud of at least m + 2 different points.
    n_neighbors : int, optional
        Number of neighbors of each point of a cloud; by default 20, 30 or 60 in dimension 1, 2
        or 3.

    Returns
    -------
    Quadrature
        The points with their weights, in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume, two simplices have the same corners, or a point has no simplex.
        Of a cloud: if two points are equal, there are too few points, or the neighbors of a point
        do not span m dimensions.
    InvalidParameterError
        If `n_neighbors` is less than m + 1 or not less than the number of points.

    See Also
    --------
    dual_volumes : The weights of a mesh alone.

    Notes
    -----
    Belkin, Sun and Wang ("Constructing Laplace operator from point clouds in R^d", 2009) take the
    Delaunay simplices at the point, which are dual to this cell. The volume of the cell is
    continuous where neighbors lie on a common circle, so regular lattices get correct weights.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> es.geometry.shape_quadrature(es.shapes.interval(4)).weights.tolist()
    [0.125, 0.25, 0.25, 0.25, 0.125]
    >>> angles = 2 * np.pi * np.arange(100) / 100
    >>> circle = es.PointCloud(np.column_stack([np.cos(angles), np.sin(angles)]), dim=1)
    >>> weights = es.geometry.shape_quadrature(circle).weights
    >>> bool(np.allclose(weights.sum(), 2 * np.pi, rtol=0.001))
    True
    """
    cloud = as_shape(shape)
    if not isinstance(cloud, PointCloud):
        require_sound(cloud)
        return Quadrature(cloud.points, dual_volumes(cloud), cloud.dim)
    dim = cloud.dim
    if cloud.n_points <= dim + 1:
        raise InvalidShapeError(
            f"A cloud of dimension {dim} must have at least {dim + 2} points; "
            f"this one has {cloud.n_points}."
        )
    usual = min(NEIGHBORS.get(dim, 20 * dim**2), cloud.n_points - 1)
    near = whole_number(
        usual if n_neighbors is None else n_neighbors, "n_neighbors", dim + 1, cloud.n_points - 1
    )
    points, scale = size_one(cloud.points)
    distances, neighbors = cKDTree(points).query(points, near + 1)
    require_different_points(cloud, distances, neighbors)
    weights = np.empty(cloud.n_points)
    for first in range(0, cloud.n_points, POINTS_AT_ONCE):
        rows = slice(first, first + POINTS_AT_ONCE)
        # Project the neighbors of each point onto its tangent space, nearest neighbor first.
        near_ones, reach = neighbors[rows], distances[rows]
        around = (points[near_ones[:, 1:]] - points[near_ones[:, :1]]) / reach[:, -1:, None]
        centered = around - around.mean(axis=1, keepdims=True)
        _, spreads, axes = np.linalg.svd(centered, full_matrices=False)
        projected = around @ axes[:, :dim].transpose(0, 2, 1)
        lengths = np.linalg.norm(projected, axis=2)
        # A neighbor on the normal of its point has no direction in the plane; any direction is as good.
        projected[lengths == 0, 0] = lengths[lengths == 0] = 1
        projected[spreads[:, dim - 1] <= FLATTEST * spreads[:, 0]] = 0
        # Projecting a curved neighborhood shrinks it, so each neighbor is put back at its distance.
        tangent = projected * (reach[:, 1:] / lengths)[..., None]
        weights[rows] = _cell_volumes(tangent)
    flat = np.flatnonzero(~(weights > 0))
    if flat.size:
        raise InvalidShapeError(
            f"The neighbors of each point must span {dim} dimensions; those of point {flat[0]} at "
            f"{cloud.points[flat[0]].tolist()} do not ({flat.size} such). "
            f"Check dim, which is {dim}, and that all axes have one unit (degrees and meters do not), or "
            "pass a larger n_neighbors."
        )
    return Quadrature(cloud.points, in_length(weights, scale, dim), dim)


def require_different_points(
    cloud: PointCloud, distances: Float[np.ndarray, "n k"], neighbors: Int[np.ndarray, "n k"]
) -> None:
    """Raise an error if two points are equal, given the nearest of each, itself among them."""
    equal = np.flatnonzero(distances[:, 1] == 0)
    if equal.size:
        other = next(int(index) for index in neighbors[equal[0]] if index != equal[0])
        raise InvalidShapeError(
            f"Points must differ; points {equal[0]} and {other} are both "
            f"{cloud.points[equal[0]].tolist()} ({equal.size} such). {try_auto('cloud')}"
        )


def _cell_volumes(neighbors: Float[np.ndarray, "r k m"]) -> Float[np.ndarray, " r"]:
    """Return for each set of neighbors the volume of the origin's Voronoi cell in their hull."""
    dim = neighbors.shape[2]
    if dim == 1:
        places = neighbors[:, :, 0]
        # On a side without a neighbor, such as behind the end of a curve, the cell ends at 0.
        gaps = [np.min(np.where(way > 0, way, np.inf), axis=1) for way in (places, -places)]
        ahead, behind = (np.where(np.isfinite(gap), gap, 0) for gap in gaps)
        return (ahead + behind) / 2
    if dim == 2:
        places = np.concatenate([neighbors, np.zeros_like(neighbors[:, :1])], axis=1)
        by_x = np.lexsort((places[:, :, 1], places[:, :, 0]))
        areas, polygons = np.empty(len(places)), np.empty((2, 2 * places.shape[1] + 4, 2))
        cell_areas(np.take_along_axis(places, by_x[:, :, None], axis=1), areas, polygons)
        return areas
    return np.array([_cell_volume(row) for row in neighbors])


def _cell_volume(neighbors: Float[np.ndarray, "k m"]) -> float:
    """Return the volume of the origin's Voronoi cell in the hull; zero if Qhull finds no cell."""
    distances = np.linalg.norm(neighbors, axis=1)
    bisectors = np.column_stack([neighbors, -(distances**2) / 2])
    middle = neighbors.mean(axis=0)
    away = np.linalg.norm(middle)
    # Qhull needs a point inside the cell. The origin itself may lie on the hull, so step from it
    # towards the middle of the neighbors, by at most a quarter of the nearest distance.
    inside = middle * min(1, distances.min() / 4 / away) if away else middle
    try:
        hull = ConvexHull(np.vstack([neighbors, np.zeros_like(middle)]))
        cell = HalfspaceIntersection(np.vstack([bisectors, hull.equations]), inside)
        # Above dimension 4 the merging of facets fails now and then; joggled input avoids it.
        options = "QJ" if len(middle) > 4 else None
        return float(ConvexHull(cell.intersections, qhull_options=options).volume)
    except QhullError:
        return 0.0
