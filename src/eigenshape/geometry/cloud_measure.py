"""How much of the hidden manifold each point of a cloud stands for."""

from math import factorial
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float
from scipy.spatial import Delaunay, cKDTree

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.quadrature import Quadrature
from eigenshape.geometry.simplices import in_length, size_one
from eigenshape.geometry.star_loops import star_areas

NEIGHBORS = {1: 12, 2: 30, 3: 60}  # enough to surround a random point; beyond, 20 m²
FLATTEST = 1e-7  # m-th over first singular value of a neighbourhood
ROWS = 4096  # points at once


def cloud_quadrature(cloud: PointCloud, *, n_neighbors: SupportsIndex | None = None) -> Quadrature:
    """Weigh each point of a cloud with its share of the manifold, also where the density varies.

    The neighbours of a point are laid into the tangent plane that fits them best and triangulated there (Delaunay);
    the point's weight is 1/(m+1) of the volume of its own simplices (Belkin, Sun, Wang 2009). On a curve that is half
    of the way between the points before and behind.

    Each point triangulates for itself: where four neighbours lie on a circle, as on a regular lattice, neighbours may
    choose different diagonals and the weights do not add up, however fine the sample (a torus grid: 9 % too much).

    Parameters
    ----------
    cloud : PointCloud
    n_neighbors : int, optional
        Neighbours that are looked at; by default 12, 30 or 60 in dimension 1, 2 or 3.

    Returns
    -------
    Quadrature
        Weights in length^m.

    Raises
    ------
    InvalidShapeError
        If two points are equal, there are too few, or the neighbours of a point do not span m dimensions or lie all on
        one side of it and make no simplex.
    InvalidParameterError
        If `n_neighbors` is less than m + 1 or not less than the number of points.
    """
    dim = cloud.dim
    if cloud.n_points <= dim + 1:
        raise InvalidShapeError(f"A cloud of dimension {dim} needs over {dim + 1} points; it has {cloud.n_points}.")
    usual = min(NEIGHBORS.get(dim, 20 * dim**2), cloud.n_points - 1)
    near = whole_number(usual if n_neighbors is None else n_neighbors, "n_neighbors", dim + 1, cloud.n_points - 1)
    points, scale = size_one(cloud.points)
    distances, neighbors = cKDTree(points).query(points, near + 1)
    _require_different(cloud, distances, neighbors)
    weights = np.empty(cloud.n_points)
    for first in range(0, cloud.n_points, ROWS):
        rows = slice(first, first + ROWS)
        weights[rows] = _star_volumes(_flattened(cloud, points, neighbors[rows], first)) / (dim + 1)
    alone = np.flatnonzero(weights <= 0)
    if alone.size:
        raise InvalidShapeError(
            f"Every point must have simplices; point {alone[0]} at {cloud.points[alone[0]].tolist()} has none among "
            f"its {near} neighbours ({alone.size} such). Drop such points, or look at more neighbours."
        )
    return Quadrature(cloud.points, in_length(weights, scale, dim), dim)


def _require_different(cloud: PointCloud, distances: np.ndarray, neighbors: np.ndarray) -> None:
    equal = np.flatnonzero(distances[:, 1] == 0)
    if equal.size:
        other = next(int(index) for index in neighbors[equal[0]] if index != equal[0])
        raise InvalidShapeError(
            f"Points must differ; points {equal[0]} and {other} are both {cloud.points[equal[0]].tolist()} "
            f"({equal.size} such). Drop the copies."
        )


def _flattened(
    cloud: PointCloud, points: Float[np.ndarray, "n d"], neighbors: np.ndarray, first: int
) -> Float[np.ndarray, "r k m"]:
    """Return the neighbours of some points in their tangent spaces, nearest first, the point at the origin."""
    around = points[neighbors[:, 1:]] - points[neighbors[:, :1]]
    size = np.linalg.norm(around[:, -1], axis=1)
    centred = around / size[:, None, None]
    centred = centred - centred.mean(axis=1, keepdims=True)
    _, spreads, axes = np.linalg.svd(centred, full_matrices=False)
    flat = np.flatnonzero(spreads[:, cloud.dim - 1] <= FLATTEST * spreads[:, 0])
    if flat.size:
        raise InvalidShapeError(
            f"The neighbours of a point must span {cloud.dim} dimensions; those of point {first + flat[0]} at "
            f"{cloud.points[first + flat[0]].tolist()} do not ({flat.size} such). Is dim = {cloud.dim} right?"
        )
    return around @ axes[:, : cloud.dim].transpose(0, 2, 1)


def _star_volumes(neighbors: Float[np.ndarray, "r k m"]) -> Float[np.ndarray, " r"]:
    dim = neighbors.shape[2]
    if dim == 1:
        places = neighbors[:, :, 0]
        ahead = np.min(np.where(places > 0, places, np.inf), axis=1)
        behind = np.min(np.where(places < 0, -places, np.inf), axis=1)
        return np.where(np.isfinite(ahead), ahead, 0) + np.where(np.isfinite(behind), behind, 0)
    if dim == 2:
        return star_areas(np.ascontiguousarray(neighbors))
    return np.array([_star_volume(row) for row in neighbors])


def _star_volume(neighbors: Float[np.ndarray, "k m"]) -> float:
    dim = neighbors.shape[1]
    corners = np.vstack([np.zeros(dim), neighbors])
    simplices = Delaunay(corners, qhull_options="Qbb Qc Qz Q12 QJ" if dim > 4 else "Qbb Qc Qz Q12").simplices
    star = simplices[(simplices == 0).any(axis=1)]
    sides = corners[star][:, 1:] - corners[star][:, :1]
    return float(np.abs(np.linalg.det(sides)).sum() / factorial(dim))
