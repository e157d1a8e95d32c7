"""Kernels of `thinning`: edges that collapse into one of their ends.

A corner is a number 3f + i, for corner i of face f. The corners at a vertex v form a list: `heads[v]`,
`links` of that, and so on to -1. A face that has collapsed has `alive` False; its corners stay in
the lists until these are joined.
"""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel

RIM, FIXED = 1, 2  # kinds of vertices beside free ones, which are 0; FIXED ones never move


@kernel("n_vertices")
def collapse_short_edges(
    points: Float64[np.ndarray, "n_vertices 3"],
    faces: Out[Int64[np.ndarray, "n_faces 3"]],
    alive: Out[Bool[np.ndarray, " n_faces"]],
    heads: Out[Int64[np.ndarray, " n_vertices"]],
    links: Out[Int64[np.ndarray, " 3*n_faces"]],
    kinds: Int64[np.ndarray, " n_vertices"],
    marks: Out[Int64[np.ndarray, "n_vertices+1 2"]],
    length: float,
    most_neighbors: int,
    least_cosine: float,
) -> int:
    """Collapse edges shorter than a length, vertex by vertex, and return how many did.

    Each vertex moves into the nearest neighbor into which it may: where no vertex gets more than
    `most_neighbors`, and no cosine between the normals of a face before and after falls below
    `least_cosine`. `heads` of a vertex that is gone is -1. `marks` is scratch, two numbers for each
    vertex; `marks[-1, 0]` is the last number that was used as a mark.
    """


@kernel("n_faces")
def link_corners(
    faces: Int64[np.ndarray, "n_faces 3"],
    heads: Out[Int64[np.ndarray, " n_vertices"]],
    links: Out[Int64[np.ndarray, " 3*n_faces"]],
) -> None:
    """Fill the lists of corners; `heads` is -1 on entry."""
