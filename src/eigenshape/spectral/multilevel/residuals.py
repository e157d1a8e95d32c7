"""Images and residuals of tall blocks of columns, computed in chunks of rows."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from eigenshape.spectral.multilevel.vcycle import Tower, multiply

# Rows in a chunk: two products of 32 columns then take 2 MiB, which fit into the cache.
ROWS = 4096


def row_chunks(tower: Tower) -> list[slice]:
    """Return the rows of the finest level in chunks that fit into the cache."""
    n = tower.levels[0].n
    return [slice(start, min(start + ROWS, n)) for start in range(0, n, ROWS)]


def images(tower: Tower, columns: np.ndarray) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Yield A S and M S for columns S in chunks of rows, in double precision."""
    level = tower.levels[0]
    room = [np.empty((min(ROWS, level.n), columns.shape[1])) for _ in range(2)]
    for rows in row_chunks(tower):
        image, weighed = (part[: rows.stop - rows.start] for part in room)
        multiply(level.stiffness, columns, image, rows)
        if level.mass is None:
            np.multiply(columns[rows], level.weights[rows], out=weighed)
        else:
            multiply(level.mass, columns, weighed, rows)
        yield rows, image, weighed


def _residual_rows(
    tower: Tower, columns: np.ndarray, values: np.ndarray
) -> Iterator[tuple[slice, np.ndarray]]:
    """Yield the residuals A S - M S θ in chunks of rows."""
    for rows, image, weighed in images(tower, columns):
        np.multiply(weighed, values, out=weighed)
        yield rows, np.subtract(image, weighed, out=image)


def norms_of_residuals(
    tower: Tower, columns: np.ndarray, values: np.ndarray
) -> Float[np.ndarray, " m"]:
    """Return the norms of the columns' residuals for the inverse of M or of its diagonal."""
    squares = np.zeros(len(values))
    for rows, rest in _residual_rows(tower, columns, values):
        squares += _squares(tower, rows, rest)
    return np.sqrt(squares)


def _squares(tower: Tower, rows: slice, rest: np.ndarray) -> np.ndarray:
    rest *= rest
    rest /= tower.levels[0].weights[rows]
    return rest.sum(axis=0)


def pick_columns(tower: Tower, columns: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Return some of the columns as a contiguous block."""
    picked = np.empty((len(columns), len(some)), dtype=columns.dtype)
    for rows in row_chunks(tower):
        picked[rows] = np.take(columns[rows], some, axis=1)
    return picked


def residual_block(
    tower: Tower, columns: np.ndarray, values: np.ndarray, scales: np.ndarray
) -> tuple[np.ndarray, Float[np.ndarray, " b"]]:
    """Return residuals, scaled and in single precision, and their norms."""
    squares = np.zeros(len(values))
    block = np.empty(columns.shape, dtype=np.float32)
    for rows, rest in _residual_rows(tower, columns, values):
        block[rows] = rest * scales
        squares += _squares(tower, rows, rest)
    return block, np.sqrt(squares)


def keep_outside(tower: Tower, columns: np.ndarray, block: np.ndarray) -> None:
    """Project the span of orthonormal columns out of a block, in place.

    Orthonormal is meant for M or its diagonal.
    """
    weights = tower.levels[0].weights
    inside = np.zeros((columns.shape[1], block.shape[1]))
    for rows in row_chunks(tower):
        inside += columns[rows].T @ (weights[rows] * block[rows]).astype(columns.dtype)
    for rows in row_chunks(tower):
        block[rows] -= columns[rows] @ inside.astype(columns.dtype)
