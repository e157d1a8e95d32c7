"""How much of the hidden manifold each point of a cloud stands for."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError, cKDTree

from eigenshape._arguments import require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.cell_loops import cell_areas
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.quadrature import Quadrature
from eigenshape.geometry.simplices import in_length, size_one

NEIGHBORS = {1: 20, 2: 30, 3: 60}  # enough to surround a random point; beyond, 20 m²
FLATTEST = 1e-7  # m-th over first singular value of a neighbourhood
ROWS = 4096  # points at once


def cloud_quadrature(cloud: PointCloud, *, n_neighbors: SupportsIndex | None = None) -> Quadrature:
    """Weigh each point of a cloud with its share of the manifold, also where the density varies.

    The neighbours of a point are laid into the tangent plane that fits them best, each at its true distance. The
    point's weight is the volume of its Voronoi cell there, the dual of the Delaunay simplices of Belkin, Sun and Wang
    (2009); at a boundary the cell ends at the convex hull of the neighbours. On a curve that is half of the way
    between the points before and behind. Cells, unlike simplices, do not jump where neighbours lie on a circle, so
    regular lattices are weighed right, too.

    Parameters
    ----------
    cloud : PointCloud
    n_neighbors : int, optional
        Neighbours that are looked at; by default 20, 30 or 60 in dimension 1, 2 or 3.

    Returns
    -------
    Quadrature
        Weights in length^m.

    Raises
    ------
    InvalidShapeError
        If two points are equal, there are too few, or the neighbours of a point do not span m dimensions.
    InvalidParameterError
        If `n_neighbors` is less than m + 1 or not less than the number of points.
    """
    require_type(cloud, PointCloud, "cloud")
    dim = cloud.dim
    if cloud.n_points <= dim + 1:
        raise InvalidShapeError(
            f"A cloud of dimension {dim} needs over {dim + 1} points; it has {cloud.n_points}."
        )
    usual = min(NEIGHBORS.get(dim, 20 * dim**2), cloud.n_points - 1)
    near = whole_number(
        usual if n_neighbors is None else n_neighbors, "n_neighbors", dim + 1, cloud.n_points - 1
    )
    points, scale = size_one(cloud.points)
    distances, neighbors = cKDTree(points).query(points, near + 1)
    _require_different(cloud, distances, neighbors)
    weights = np.empty(cloud.n_points)
    for first in range(0, cloud.n_points, ROWS):
        rows = slice(first, first + ROWS)
        weights[rows] = _cell_volumes(_flattened(points, neighbors[rows], distances[rows], dim))
    flat = np.flatnonzero(~(weights > 0))
    if flat.size:
        raise InvalidShapeError(
            f"The neighbours of a point must span {dim} dimensions; those of point {flat[0]} at "
            f"{cloud.points[flat[0]].tolist()} do not ({flat.size} such). Is dim = {dim} right?"
        )
    return Quadrature(cloud.points, in_length(weights, scale, dim), dim)


def _require_different(cloud: PointCloud, distances: np.ndarray, neighbors: np.ndarray) -> None:
    equal = np.flatnonzero(distances[:, 1] == 0)
    if equal.size:
        other = next(int(index) for index in neighbors[equal[0]] if index != equal[0])
        raise InvalidShapeError(
            f"Points must differ; points {equal[0]} and {other} are both {cloud.points[equal[0]].tolist()} "
            f"({equal.size} such). {try_auto('cloud')}"
        )


def _flattened(
    points: Float[np.ndarray, "n d"], neighbors: np.ndarray, distances: np.ndarray, dim: int
) -> Float[np.ndarray, "r k m"]:
    """Return the neighbours of some points in their tangent spaces, nearest first; zeros where they span too little.

    They keep their distances: the shadow of a curved neighbourhood is too small.
    """
    around = (points[neighbors[:, 1:]] - points[neighbors[:, :1]]) / distances[:, -1:, None]
    centred = around - around.mean(axis=1, keepdims=True)
    _, spreads, axes = np.linalg.svd(centred, full_matrices=False)
    shadows = around @ axes[:, :dim].transpose(0, 2, 1)
    lengths = np.linalg.norm(shadows, axis=2)
    shadows[lengths == 0, 0] = lengths[lengths == 0] = (
        1  # right above the point: any direction serves
    )
    shadows[spreads[:, dim - 1] <= FLATTEST * spreads[:, 0]] = 0
    return shadows * (distances[:, 1:] / lengths)[..., None]


def _cell_volumes(neighbors: Float[np.ndarray, "r k m"]) -> Float[np.ndarray, " r"]:
    dim = neighbors.shape[2]
    if dim == 1:
        places = neighbors[:, :, 0]
        ahead = np.min(np.where(places > 0, places, np.inf), axis=1)
        behind = np.min(np.where(places < 0, -places, np.inf), axis=1)
        return (
            np.where(np.isfinite(ahead), ahead, 0) + np.where(np.isfinite(behind), behind, 0)
        ) / 2
    if dim == 2:
        places = np.concatenate([neighbors, np.zeros_like(neighbors[:, :1])], axis=1)
        by_x = np.lexsort((places[:, :, 1], places[:, :, 0]))
        return cell_areas(np.take_along_axis(places, by_x[:, :, None], axis=1))
    return np.array([_cell_volume(row) for row in neighbors])


def _cell_volume(neighbors: Float[np.ndarray, "k m"]) -> float:
    """Return the volume of the origin's Voronoi cell inside the convex hull; zero where there is none to be had."""
    distances = np.linalg.norm(neighbors, axis=1)
    bisectors = np.column_stack([neighbors, -(distances**2) / 2])
    middle = neighbors.mean(axis=0)
    away = np.linalg.norm(middle)
    inside = (
        middle * min(1, distances.min() / 4 / away) if away else middle
    )  # the origin may lie on the hull
    try:
        hull = ConvexHull(np.vstack([neighbors, np.zeros_like(middle)]))
        cell = HalfspaceIntersection(np.vstack([bisectors, hull.equations]), inside)
        joggled = "QJ" if len(middle) > 4 else None  # beyond, merging facets fails now and then
        return float(ConvexHull(cell.intersections, qhull_options=joggled).volume)
    except QhullError:
        return 0.0
