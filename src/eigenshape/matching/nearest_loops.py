"""Kernels of `nearest`: a tree of rows, and searches in it.

A tree has 2^levels leaves; the children of node k are 2 k + 1 and 2 k + 2. Rows are in the order of its leaves.
"""

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel


@kernel("n_rows")
def order_rows(
    rows: Float64[np.ndarray, "n_rows 6"], levels: int, order: Out[Int64[np.ndarray, " n_rows"]]
) -> None:
    """Write the order in which rows of a leaf follow each other: each node is halved where it is longest."""


@kernel("n_rows")
def fill_row_boxes(
    rows: Float64[np.ndarray, "n_rows 6"],
    levels: int,
    nodes: Out[Float64[np.ndarray, "(2<<levels)-1 2 6"]],
) -> None:
    """Fill the least and the largest coordinates of each node."""


@kernel("n_points", "n_rows")
def find_nearest_rows(
    points: Float64[np.ndarray, "n_points 6"],
    rows: Float64[np.ndarray, "n_rows 6"],
    levels: int,
    nodes: Float64[np.ndarray, "(2<<levels)-1 2 6"],
    found: Out[Int64[np.ndarray, " n_points"]],
    squares: Out[Float64[np.ndarray, " n_points"]],
) -> None:
    """Fill the nearest row of each point and its squared distance; `found` comes with a guess."""
