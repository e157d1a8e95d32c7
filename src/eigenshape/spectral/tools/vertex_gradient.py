"""Gradients at points, in tangent planes: a linear fit to the differences to all neighbors."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import TINY
from eigenshape._corners import mean_normals
from eigenshape._vectors import row_dots, size_one, unit_vectors
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.clouds.neighbors import nearest_others
from eigenshape.operators.graph import edge_graph

# Neighbors of a point of a cloud, for its normal and its gradient, as in DiffusionNet.
CLOUD_NEIGHBORS = 30
# The first tangent is the x axis, projected, or the y axis where the cosine of x and the normal
# exceeds this; as in DiffusionNet.
STEEP = 0.9
# Edges of a point lie on one line if the determinant of their normal equations is at most this
# share of the squared trace: they are within 1e-6 rad of the line. Then there is no derivative
# across.
COLLINEAR = 1e-12

Shape3 = TriangleMesh | PointCloud


def neighbor_edges(shape: Shape3) -> Int[np.ndarray, "2 e"]:
    """Return the directed edges from each point to its neighbors.

    Those of a mesh are its edges in both directions; those of a cloud lead to the nearest points.
    """
    if isinstance(shape, TriangleMesh):
        return np.stack(edge_graph(shape).nonzero()).astype(np.int64)
    n = shape.n_points
    near = nearest_others(size_one(shape.points)[0], min(CLOUD_NEIGHBORS, n - 1))
    return np.stack([np.repeat(np.arange(n), near.shape[1]), near.ravel()])


def point_frames(shape: Shape3, edges: Int[np.ndarray, "2 e"]) -> Float[np.ndarray, "n 3 3"]:
    """Return two tangents and the normal of each point, an orthonormal right-handed frame.

    Where the normals of the faces at a vertex cancel, as at the waist of an hourglass or on the rim of
    a sheet that is there twice, its neighbors give the tangent plane, as on a cloud.
    """
    points, _ = size_one(shape.points)
    normals = np.zeros_like(points)
    if isinstance(shape, TriangleMesh):
        normals = mean_normals(shape).copy()
    without = np.equal(normals, 0.0).all(axis=1)
    if without.any():
        # The direction in which the neighbors of a point spread least; its sign is free.
        has_none = np.take(without, edges[0])
        tails, heads = edges[0][has_none], edges[1][has_none]
        near = points[heads] - points[tails]
        starts = np.unique(tails, return_index=True)[1]
        covariances = np.add.reduceat(near[:, :, None] * near[:, None], starts)
        normals[without] = np.linalg.eigh(covariances)[1][:, :, 0]
    steep = np.abs(normals[:, :1]) >= STEEP
    axis = np.where(steep, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    first = unit_vectors(axis - (axis * normals).sum(axis=1, keepdims=True) * normals)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def fit_gradient(
    points: Float[np.ndarray, "n 3"],
    frames: Float[np.ndarray, "n 3 3"],
    edges: Int[np.ndarray, "2 e"],
) -> tuple[sp.csr_array, sp.csr_array]:
    """Return the matrices of the two components of the gradient, in 1/length.

    The gradient g at point i minimizes Σ_j (g · e_ij - (f_j - f_i))² over its neighbors j, with
    e_ij the edge in the frame of i. Of several minimizers, where all edges lie on one line, it is
    the shortest.
    """
    scaled, scale = size_one(points)
    tails, heads = edges
    vectors = np.take(scaled, heads, axis=0) - np.take(scaled, tails, axis=0)
    x, y = (row_dots(vectors, np.take(frames[:, axis], tails, axis=0)) for axis in (0, 1))

    # The inverse of each 2 x 2 matrix of normal equations, or its pseudoinverse if its rank is 1.
    n = len(points)
    xx, xy, yy = (np.bincount(tails, weights=w, minlength=n) for w in (x * x, x * y, y * y))
    determinant, trace = xx * yy - xy * xy, xx + yy
    regular = determinant > COLLINEAR * trace**2
    divisor = np.where(regular, determinant, np.maximum(trace, TINY) ** 2)
    divisor = np.maximum(divisor, TINY)
    a = np.where(regular, yy, xx) / divisor
    b = np.where(regular, -xy, xy) / divisor
    c = np.where(regular, xx, yy) / divisor

    # Both matrices have one pattern, which is sorted once.
    rows = np.concatenate([tails, np.arange(n)])
    columns = np.concatenate([heads, np.arange(n)])
    numbers = sp.csr_array((np.arange(len(rows)), (rows, columns)), shape=(n, n))
    gradients = []
    for weights in (a[tails] * x + b[tails] * y, b[tails] * x + c[tails] * y):
        own = -np.bincount(tails, weights=weights, minlength=n)
        entries = np.concatenate([weights, own]) / scale
        pattern = entries[numbers.data], numbers.indices, numbers.indptr
        gradients.append(sp.csr_array(pattern, shape=(n, n)))
    return gradients[0], gradients[1]
