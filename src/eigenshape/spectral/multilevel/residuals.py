"""Images and residuals of tall blocks of columns, computed in chunks of rows."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import record
from certeig.kit.threads import map_in_threads
from eigenshape.spectral.multilevel.vcycle import Tower, multiply

R = TypeVar("R")

# Rows in a chunk: two products of 32 columns then take 2 MiB, which fit into the cache.
CHUNK_ROWS = 4096
# Chunks of a group, which one thread sums up, at least; and groups at most, each of which keeps
# sums of its own.
CHUNKS_A_GROUP = 4
MOST_GROUPS = 16


def map_groups(tower: Tower, function: Callable[[list[slice]], R]) -> list[R]:
    """Return what a function returns of each group of chunks of rows, computed side by side.

    The groups depend on the number of rows alone, and so do sums over them.
    """
    n = tower.levels[0].n
    chunks = [slice(start, min(start + CHUNK_ROWS, n)) for start in range(0, n, CHUNK_ROWS)]
    n_groups = min(max(len(chunks) // CHUNKS_A_GROUP, 1), MOST_GROUPS)
    ends = [len(chunks) * number // n_groups for number in range(n_groups + 1)]
    return map_in_threads(function, [chunks[low:high] for low, high in pairwise(ends)])


def change_rows(tower: Tower, change: Callable[[slice], None]) -> None:
    """Run a function on all chunks of rows, side by side."""

    def change_group(chunks: list[slice]) -> None:
        for rows in chunks:
            change(rows)

    map_groups(tower, change_group)


def images(
    tower: Tower, columns: np.ndarray, chunks: list[slice]
) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Yield A S and M S for columns S in chunks of rows, in double precision."""
    level = tower.levels[0]
    room = [np.empty((min(CHUNK_ROWS, level.n), columns.shape[1])) for _ in range(2)]
    for rows in chunks:
        image, weighed = (part[: rows.stop - rows.start] for part in room)
        multiply(level.stiffness, columns, rows, image)
        if level.mass is None:
            np.multiply(columns[rows], level.weights[rows], out=weighed)
        else:
            multiply(level.mass, columns, rows, weighed)
        yield rows, image, weighed


def norms_of_residuals(
    tower: Tower,
    columns: np.ndarray,
    values: np.ndarray,
    block: np.ndarray | None = None,
    scales: np.ndarray | float = 1.0,
) -> Float[np.ndarray, " m"]:
    """Return the norms of the residuals A S - M S θ for the inverse of M or of its diagonal.

    The residuals times the scales are written to `block`, if one is given.
    """
    weights = tower.levels[0].weights

    def sum_squares(chunks: list[slice]) -> np.ndarray:
        squares = np.zeros(len(values))
        for rows, image, weighed in images(tower, columns, chunks):
            np.multiply(weighed, values, out=weighed)
            rest = np.subtract(image, weighed, out=image)
            if block is not None:
                block[rows] = rest * scales
            rest *= rest
            rest /= weights[rows]
            squares += rest.sum(axis=0)
        return squares

    return np.sqrt(np.sum(map_groups(tower, sum_squares), axis=0))


def pick_columns(tower: Tower, columns: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Return some of the columns as a contiguous block."""
    picked = np.empty((len(columns), len(some)), dtype=columns.dtype)

    def fill(rows: slice) -> None:
        picked[rows] = np.take(columns[rows], some, axis=1)

    change_rows(tower, fill)
    return picked


@record
class Stored:
    """Orthonormal columns on the finest level, all in memory.

    Orthonormal is meant for M or its diagonal.
    """

    tower: Tower
    columns: np.ndarray

    def rows(self, rows: slice) -> np.ndarray:
        """Return some rows of the columns."""
        return self.columns[rows]

    def pick(self, some: np.ndarray) -> np.ndarray:
        """Return some of the columns as a contiguous block."""
        return pick_columns(self.tower, self.columns, some)

    def keep_outside(self, block: np.ndarray) -> None:
        """Project the span of the columns out of a block, in place."""
        columns, weights = self.columns, self.tower.levels[0].weights

        def share_inside(chunks: list[slice]) -> np.ndarray:
            inside = np.zeros((columns.shape[1], block.shape[1]))
            for rows in chunks:
                inside += columns[rows].T @ (weights[rows] * block[rows]).astype(columns.dtype)
            return inside

        inside = np.sum(map_groups(self.tower, share_inside), axis=0).astype(columns.dtype)

        def subtract_inside(rows: slice) -> None:
            block[rows] -= columns[rows] @ inside

        change_rows(self.tower, subtract_inside)


@record
class Interpolated:
    """Orthonormal columns PV of the finest level, of which only the columns V are in memory.

    V are orthonormal columns of the second level, and P is the prolongation. PᵀMP is the M of the
    second level, so PV are orthonormal as well.
    """

    tower: Tower
    below: np.ndarray

    def rows(self, rows: slice) -> np.ndarray:
        """Return some rows of the columns."""
        return multiply(self.tower.levels[0].rough_prolong, self.below, rows)

    def pick(self, some: np.ndarray) -> np.ndarray:
        """Return some of the columns as a contiguous block."""
        return self._prolong(np.ascontiguousarray(self.below[:, some]))

    def keep_outside(self, block: np.ndarray) -> None:
        """Project the span of the columns out of a block, in place."""
        level = self.tower.levels[0]
        inside = self.below.T @ self.restrict(level.rough_scales[0] * block)
        block -= self._prolong(self.below @ inside)

    def restrict(self, block: np.ndarray) -> np.ndarray:
        """Return Pᵀ times a block."""
        return multiply(self.tower.levels[0].rough_restrict, block)

    def _prolong(self, block: np.ndarray) -> np.ndarray:
        return multiply(self.tower.levels[0].rough_prolong, block)
