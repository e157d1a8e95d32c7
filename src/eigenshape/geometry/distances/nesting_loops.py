"""Kernel of `nesting`: which points lie inside a closed piece."""

import numpy as np
from jaxtyping import Bool, Float64

from certeig.kit.kernels import Out, kernel


def are_inside(
    points: Float64[np.ndarray, "_ 3"],
    boxes: Float64[np.ndarray, "f 6"],
    levels: int,
    nodes: Float64[np.ndarray, "_ 6"],
) -> Bool[np.ndarray, " p"]:
    """Return whether each point lies inside: whether a ray from it crosses an odd number of faces.

    The ray goes up, along the last axis. The corners of face i are `points[3 i : 3 i + 3]`. Faces
    are in the order of the leaves of a `box_tree`, and the points in question follow after all
    corners. No point may lie on a face.
    """
    inside = np.empty(len(points) - 3 * len(boxes), dtype=np.bool_)
    fill_inside(len(boxes), levels, nodes, inside, points)
    return inside


@kernel("n_points")
def fill_inside(
    n_faces: int,
    levels: int,
    nodes: Float64[np.ndarray, "(2<<levels)-1 6"],
    inside: Out[Bool[np.ndarray, " n_points"]],
    points: Float64[np.ndarray, "3*n_faces+n_points 3"],
) -> None:
    """Fill what `are_inside` returns."""
