"""Local Delaunay triangulations of point clouds, and their tufted cover."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_type
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.samples.quadrature import require_different_points
from eigenshape.geometry.simplices import require_span
from eigenshape.operators.clouds.pair_loops import local_rings
from eigenshape.operators.tufted import (
    MOLLIFY,
    Triangulation,
    edge_keys,
    flip_to_delaunay,
    mollify_lengths,
    tufted_cover,
)

# Neighbors of a point among which its triangles are sought, as in Sharp and Crane 2020.
N_NEIGHBORS = 30


def local_triangles(
    cloud: PointCloud, *, n_neighbors: Integer | None = None
) -> Int[np.ndarray, "f 3"]:
    """List the triangles around each point of a cloud that samples a surface.

    The nearest neighbors of a point are projected to their best plane through it; its triangles
    are those at it in the Delaunay triangulation of the projections. Triangulations of different
    points need not agree: three points may form up to three triangles of the list, or fewer.

    Parameters
    ----------
    cloud : PointCloud
        Of dimension 2 in R³.
    n_neighbors : int, optional
        Neighbors of each point, 3 to n - 1; 30 by default, or all others of fewer points.

    Returns
    -------
    (f, 3) int
        First the point to which each triangle belongs, ascending; then its two neighbors.

    Raises
    ------
    InvalidShapeError
        If the cloud has another dimension, two points are at one place, or a point has no
        triangle, as on a line.
    InvalidParameterError
        If `n_neighbors` is out of range, or `cloud` is no PointCloud.

    See Also
    --------
    robust_laplacian : The operator of these triangles.

    Examples
    --------
    A point in the middle of a regular hexagon has six triangles.

    >>> import eigenshape as es
    >>> import numpy as np
    >>> angles = np.arange(6) * np.pi / 3
    >>> rim = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    >>> cloud = es.PointCloud(np.vstack([[0, 0, 0], rim]), dim=2)
    >>> triangles = es.operators.local_triangles(cloud, n_neighbors=6)
    >>> int((triangles[:, 0] == 0).sum())
    6
    """
    neighbors, offsets, axes = _neighborhoods(cloud, n_neighbors)
    normals = axes[:, :, 0]
    first = axes[:, :, 2]
    frames = np.stack([first, np.cross(normals, first)], axis=1)
    coordinates = np.einsum("nkd,nad->nka", offsets, frames)
    rings = _rings(coordinates)
    # Join each two that follow each other in a ring with the middle, but across its opening.
    n, k = neighbors.shape
    lengths = (rings >= 0).sum(axis=1)
    following = np.roll(rings, -1, axis=1)
    following[np.arange(n), lengths - 1] = rings[:, 0]
    is_side = (rings >= 0) & (rings < k) & (following < k)
    point, place = np.nonzero(is_side)
    second, third = rings[point, place], following[point, place]
    one, two = coordinates[point, second], coordinates[point, third]
    # Where all neighbors lie on a line through the point, the ring has no inside.
    spans = one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0]
    triangles = np.column_stack([point, neighbors[point, second], neighbors[point, third]])
    triangles = triangles[spans]
    bare = np.setdiff1d(np.arange(cloud.n_points), triangles)
    if bare.size:
        require_span(cloud.points, 2, "The points of a cloud")
        raise InvalidShapeError(
            f"Every point must have a triangle; point {bare[0]} at "
            f"{cloud.points[bare[0]].tolist()} has none, as its {neighbors.shape[1]} neighbors lie on a line "
            f"({bare.size} such). Try more n_neighbors."
        )
    return triangles


def cloud_normals(cloud: PointCloud) -> Float[np.ndarray, "n 3"]:
    """Return the normal of the best plane at each point, its largest coordinate positive.

    Errors are those of `local_triangles`.
    """
    normals = _neighborhoods(cloud, None)[2][:, :, 0]
    largest = np.abs(normals).argmax(axis=1)[:, None]
    return normals * np.sign(np.take_along_axis(normals, largest, axis=1))


def _neighborhoods(
    cloud: PointCloud, n_neighbors: Integer | None
) -> tuple[Int[np.ndarray, "n k"], Float[np.ndarray, "n k 3"], Float[np.ndarray, "n 3 3"]]:
    """Return the neighbors of each point, where they lie from it, and principal axes as columns."""
    require_type(cloud, PointCloud, "cloud")
    if cloud.dim != 2 or cloud.points.shape[1] != 3:
        raise InvalidShapeError(
            f"Triangles need points of a surface in R^3; this is a {cloud!r}. "
            "Use point_cloud_laplacian(cloud) for other dimensions."
        )
    if cloud.n_points < 4:
        raise InvalidShapeError(
            f"Triangles need at least 4 points; the cloud has {cloud.n_points}."
        )
    most = cloud.n_points - 1
    wanted = min(N_NEIGHBORS, most) if n_neighbors is None else n_neighbors
    count = whole_number(wanted, "n_neighbors", 3, most)
    points, _ = size_one(cloud.points)
    distances, found = cKDTree(points).query(points, count + 1)
    require_different_points(cloud, distances, found)
    neighbors = found[:, 1:]
    offsets = points[neighbors] - points[:, None]
    # Lengths relative to the farthest neighbor: squares neither overflow nor underflow.
    offsets /= distances[:, -1, None, None]
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    return neighbors, offsets, axes


def _rings(coordinates: Float[np.ndarray, "n k 2"]) -> Int[np.ndarray, "n k1"]:
    """Find the neighbors of the origin in the Delaunay triangulation of it and points around it.

    The inversion p -> p / |p|² takes circles through the origin to lines. So a circle through the
    origin and two points is empty if and only if all inverted points lie on one side of a line:
    the ring is the convex hull of the inverted points and the origin.

    Each row is the ring of k points, in counter-clockwise order, then -1. A position k stands for
    the origin itself: it is on the hull, and so the ring is open there.
    """
    n, k, _ = coordinates.shape
    u, v = (coordinates / np.abs(coordinates).max(axis=(1, 2), keepdims=True)).transpose(2, 0, 1)
    squares = np.maximum(u * u + v * v, 1e-300)
    x, y = np.zeros((2, n, k + 1))
    x[:, :k], y[:, :k] = u / squares, v / squares
    rings = np.empty((n, k + 1), dtype=np.int64)
    scratch = np.empty(k + 1, dtype=np.int64), np.empty(2 * k + 4, dtype=np.int64)
    local_rings(x, y, rings, *scratch)
    return rings


def cloud_cover(
    cloud: PointCloud, mollify: float = MOLLIFY, n_neighbors: Integer | None = None
) -> tuple[Triangulation, float]:
    """Return the Delaunay triangles of the tufted cover of all local triangles, and their unit.

    Most triangles are there three times, once for each corner.

    Errors are those of `local_triangles`; `mollify` must be positive and finite.
    """
    if not 0 < mollify < np.inf:
        raise InvalidParameterError(
            f"mollify must be positive and finite for a point cloud; it is {mollify}."
        )
    triangles = local_triangles(cloud, n_neighbors=n_neighbors)
    points, scale = size_one(cloud.points)
    sides = points[triangles] - points[np.roll(triangles, -1, axis=1)]
    lengths = np.linalg.norm(sides, axis=2).ravel()
    lengths = mollify_lengths(lengths, edge_keys(triangles, cloud.n_points), mollify)
    return flip_to_delaunay(tufted_cover(points, triangles, lengths)), scale
