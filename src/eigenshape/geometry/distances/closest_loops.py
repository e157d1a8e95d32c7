"""Kernels of `closest` and of `carrying`: nearest faces of points, and how faces wind around them.

The corners of face i are `corners[i]`. Faces are in the order of the leaves of a `box_tree`.
"""

import math

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel

Points = Float64[np.ndarray, "n_points 3"]
Corners = Float64[np.ndarray, "n_faces 3 3"]
Values = Float64[np.ndarray, " n_points"]
Numbers = Int64[np.ndarray, " n_points"]


def nearest_faces(
    points: Points,
    corners: Corners,
    levels: int,
    nodes: Float64[np.ndarray, "_ 6"],
) -> tuple[
    Numbers,
    Points,
    Values,
]:
    """Return, for each point, its nearest face, the weights of the corners there, and distance²."""
    n = len(points)
    found = np.zeros(n, dtype=np.int64), np.zeros((n, 3)), np.empty(n)
    fill_nearest_faces(points, corners, levels, nodes, *found)
    return found


@kernel("n_points", "n_faces")
def fill_nearest_faces(
    points: Points,
    corners: Corners,
    levels: int,
    nodes: Float64[np.ndarray, "(2<<levels)-1 6"],
    faces: Out[Numbers],
    weights: Out[Points],
    squares: Out[Values],
) -> None:
    """Fill what `nearest_faces` returns."""


def nearest_around(
    points: Float64[np.ndarray, "n_points 3 3"],
    middles: Points,
    starts: Numbers,
    reach: Values,
    corners: Corners,
    neighbors: Int64[np.ndarray, "n_faces 3"],
) -> tuple[Int64[np.ndarray, "n_points 3"], Float64[np.ndarray, "n_points 3 3"]]:
    """Return, for three points each, the nearest of the faces around a start, and weights there.

    Faces are visited from neighbor to neighbor, as long as their squared distance to the middle
    is at most the reach.
    """
    found = np.zeros((len(points), 3), dtype=np.int64), np.zeros((len(points), 3, 3))
    visits, waiting = np.full((2, len(corners)), -1)
    around = middles, starts, reach, corners, neighbors
    fill_nearest_around(points, *around, visits, waiting, *found)
    return found


@kernel("n_points")
def fill_nearest_around(
    points: Float64[np.ndarray, "n_points 3 3"],
    middles: Points,
    starts: Numbers,
    reach: Values,
    corners: Corners,
    neighbors: Int64[np.ndarray, "n_faces 3"],
    visits: Out[Int64[np.ndarray, " n_faces"]],
    waiting: Out[Int64[np.ndarray, " n_faces"]],
    faces: Out[Int64[np.ndarray, "n_points 3"]],
    weights: Out[Float64[np.ndarray, "n_points 3 3"]],
) -> None:
    """Fill what `nearest_around` returns; `visits` comes as -1, and `waiting` is scratch."""


def windings(points: Points, corners: Corners) -> Values:
    """Return how often faces wind around each point: the sum of their solid angles over 4π."""
    products, turns = np.empty((len(points), 2)), np.empty(len(points), dtype=np.int64)
    multiply_angles(points, corners, products, turns)
    angles = [math.atan2(imaginary, real) for real, imaginary in products.tolist()]
    return turns + np.array(angles) / (2 * np.pi)


@kernel("n_points", "n_faces")
def multiply_angles(
    points: Points,
    corners: Corners,
    products: Out[Float64[np.ndarray, "n_points 2"]],
    turns: Out[Numbers],
) -> None:
    """Fill complex numbers of which the arguments, plus full turns, are half the solid angles."""
