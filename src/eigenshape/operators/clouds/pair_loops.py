"""Kernels over clouds: pairs of points within reach, and the triangles around a point.

A kernel over pairs visits the cells from `begin` to `end` and, for each point of a cell, the runs of points
that may lie within reach. `farthest` is the square of the reach. Points are in the order of cells;
`cells` are the points, the first of each cell, and the runs.
"""

from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float64, Int, Int32, Int64

from certeig.kit.kernels import Out, kernel

Numbers = Int64[np.ndarray, " n"]

Cells: TypeAlias = tuple[
    Float64[np.ndarray, "n dim"],
    Int64[np.ndarray, "n_cells+1"],
    Int64[np.ndarray, "n_cells n_runs 2"],
]


@kernel("dim", "n_runs")
def count_pairs(
    cells: Cells,
    order: Numbers,
    farthest: float,
    wanted: Bool[np.ndarray, " n"],
    counts: Out[Numbers],
    begin: int,
    end: int,
) -> None:
    """Count the partners of the wanted points, which are numbered as before they were sorted."""


@kernel("dim", "n_runs")
def fill_pairs(
    cells: Cells,
    order: Numbers,
    place: Numbers,
    farthest: float,
    rate: float,
    libm: tuple[int],
    weights: Float64[np.ndarray, " n"],
    starts: Int64[np.ndarray, " n+1"],
    columns: Out[Int32[np.ndarray, " n_entries"]],
    values: Out[Float64[np.ndarray, " n_entries"]],
    numbers: Out[Int64[np.ndarray, " most"]],
    near: Out[Float64[np.ndarray, "most dim"]],
    begin: int,
    end: int,
) -> None:
    """Fill the columns and values of the rows of some cells.

    `place` is the inverse of `order`, and `libm` the address of exp. `numbers` and
    `near` are scratch, with one entry for each point that a cell may reach.
    """


@kernel("dim", "n_runs", "n_values")
def sum_differences(
    cells: Cells,
    farthest: float,
    rate: float,
    libm: tuple[int],
    weights: Float64[np.ndarray, " n"],
    values: Float64[np.ndarray, "n n_values"],
    sums: Out[Float64[np.ndarray, "n n_values"]],
    begin: int,
    end: int,
) -> None:
    """Fill the sums of weighted differences to all partners, for the points of some cells."""


def component_labels(starts: Int[np.ndarray, " n1"], columns: Int[np.ndarray, " k"]) -> Numbers:
    """Return the connected component of each row; components are numbered by their first rows."""
    labels, stack = np.empty((2, len(starts) - 1), dtype=np.int64)
    links = np.asarray(starts, dtype=np.int64), np.asarray(columns, dtype=np.int32)
    fill_labels(*links, labels, stack)
    return labels


@kernel("n")
def fill_labels(
    starts: Int64[np.ndarray, "n+1"],
    columns: Int32[np.ndarray, " _"],
    labels: Out[Numbers],
    stack: Out[Numbers],
) -> None:
    """Fill the result of `component_labels`; `stack` is scratch."""


@kernel("n_points", "n")
def local_rings(
    x: Float64[np.ndarray, "n_points n"],
    y: Float64[np.ndarray, "n_points n"],
    rings: Out[Int64[np.ndarray, "n_points n"]],
    order: Out[Numbers],
    hull: Out[Int64[np.ndarray, " 2*n+2"]],
) -> None:
    """Write the convex hull of each row of points by Andrew's monotone chain (1979), then -1.

    The numbers of its corners are in counter-clockwise order; of equal points one is a corner.
    `order` and `hull` are scratch.
    """
