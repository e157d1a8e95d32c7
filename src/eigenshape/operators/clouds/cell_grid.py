"""Sums over all pairs of points that a Gaussian reaches: a grid of cells, walked by kernels in C.

Points are sorted by cell. A point's partners lie in runs of that order, one run for each
neighboring column of cells, so that no list of pairs is ever stored. Each row is computed by
itself, in an order of its own: the entries (i, j) and (j, i) come out equal to the last digit, and
nothing depends on the number of threads.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from certeig.kit.kernels import math_functions
from certeig.kit.threads import map_in_threads
from eigenshape.operators.clouds.pair_loops import count_pairs, fill_pairs, sum_differences

AXES = 3  # axes that are cut into cells, those along which the points spread most
# Cells along an axis at most: 2^60 cells have numbers that fit 64 bits.
CELLS_PER_AXIS = 2**20
CHUNK = 64  # cells a task
LIBM = (math_functions("exp")[0],)


@record
class CellGrid:
    """Points sorted into cells no smaller than the reach.

    Attributes
    ----------
    points : (n, d) float
        In the order of the cells.
    order : (n,) int
        Where each stood before.
    cells : (c + 1,) int
        First point of each cell that has any; n at the end.
    runs : (c, 9, 2) int
        For each cell the ranges of points, in ascending order, that hold all partners of its
        points.
    reach : float
        Farthest distance at which two points are partners.
    """

    points: Float[np.ndarray, "n d"]
    order: Int[np.ndarray, " n"]
    cells: Int[np.ndarray, " c1"]
    runs: Int[np.ndarray, "c 9 2"]
    reach: float


def cell_grid(points: Float[np.ndarray, "n d"], reach: float) -> CellGrid:
    """Sort points into cells of a grid on which partners are neighbors."""
    spread = np.ptp(points, axis=0)
    axes = np.sort(np.argsort(-spread, kind="stable")[:AXES])
    side = max(reach, float(spread.max()) / CELLS_PER_AXIS)
    places = np.zeros((len(points), AXES), dtype=np.int64)
    offsets = points[:, axes] - points[:, axes].min(axis=0)
    places[:, : len(axes)] = np.floor(offsets / side).astype(np.int64) + 1  # a margin
    # The number of the cell of each point; neighbors along the last axis follow each other.
    sizes = places.max(axis=0) + 2
    keys = (places[:, 0] * sizes[1] + places[:, 1]) * sizes[2] + places[:, 2]
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    firsts = np.flatnonzero(np.diff(keys, prepend=-1))
    # So partners lie in nine runs of three cells each.
    steps = np.array([(a * sizes[1] + b) * sizes[2] for a in (-1, 0, 1) for b in (-1, 0, 1)])
    middle = keys[firsts][:, None] + steps
    first, last = np.searchsorted(keys, middle - 1), np.searchsorted(keys, middle + 1, "right")
    return CellGrid(
        np.ascontiguousarray(points[order]),
        order,
        np.append(firsts, len(keys)),
        np.stack([first, last], axis=-1),
        reach,
    )


def count_partners(
    grid: CellGrid, chosen: Int[np.ndarray, " k"] | None = None
) -> Int[np.ndarray, " n"]:
    """Count for each point, in the order before sorting, itself and those within reach; 0 for points not chosen."""
    counts = np.zeros(len(grid.order), dtype=np.int64)
    wanted = np.ones(len(grid.order), dtype=np.bool_)
    if chosen is not None:
        wanted[:] = False
        wanted[chosen] = True
    known = (grid.points, grid.cells, grid.runs), grid.order, grid.reach**2
    _each_cell(grid, partial(count_pairs, *known, wanted, counts))
    return counts


def gaussian_rows(
    grid: CellGrid, weights: Float[np.ndarray, " n"], t: float, starts: Int[np.ndarray, " n1"]
) -> tuple[Int[np.ndarray, " z"], Float[np.ndarray, " z"]]:
    """Return the columns, ascending in each row, and the values w_i w_j exp(-|x_i - x_j|²/4t) of the kernel matrix.

    `weights` are in the order before sorting, and so are the rows; row i fills starts[i] to
    starts[i + 1].
    """
    columns, values = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1])
    place = np.empty_like(grid.order)
    place[grid.order] = np.arange(len(place))
    most = int(np.diff(grid.runs, axis=2).sum(axis=(1, 2)).max())  # points that one cell may reach
    known = (grid.points, grid.cells, grid.runs), grid.order, place, grid.reach**2
    rows, rate = (weights, starts, columns, values), 1 / (4 * t)

    def fill(first: int, last: int) -> None:
        scratch = np.empty(most, dtype=np.int64), np.empty((most, grid.points.shape[1]))
        fill_pairs(*known, rate, LIBM, *rows, *scratch, first, last)

    _each_cell(grid, fill)
    return columns, values


def gaussian_differences(
    grid: CellGrid, weights: Float[np.ndarray, " n"], t: float, values: Float[np.ndarray, "n b"]
) -> Float[np.ndarray, "n b"]:
    """Return w_i Σ_j w_j exp(-|x_i - x_j|²/4t) (f_i - f_j) for each column f, storing nothing between pairs."""
    sorted_values = np.ascontiguousarray(values[grid.order])
    sums = np.empty_like(sorted_values)
    arrays = weights[grid.order], sorted_values, sums
    cells = grid.points, grid.cells, grid.runs
    work = partial(sum_differences, cells, grid.reach**2, 1 / (4 * t), LIBM, *arrays)
    _each_cell(grid, work)
    result = np.empty_like(sums)
    result[grid.order] = sums
    return result


def _each_cell(grid: CellGrid, work: Callable[[int, int], Any]) -> None:
    """Share the cells among threads; the kernels hold no lock, and no two write to one place."""
    n_cells = len(grid.cells) - 1
    chunks = range(0, n_cells, CHUNK)
    map_in_threads(lambda first: work(first, min(first + CHUNK, n_cells)), chunks)
