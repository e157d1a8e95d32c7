"""Tall blocks of columns on a device, some rows at a time: their images and residuals."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from eigenshape.spectral.multilevel.device import Array, fetch, multiply, put
from eigenshape.spectral.multilevel.vcycle import Tower


def row_chunks(tower: Tower) -> list[slice]:
    """Return the rows of the first level, as many at a time as the device likes."""
    n, rows = tower.levels[0].n, tower.device.rows
    return [slice(start, min(start + rows, n)) for start in range(0, n, rows)]


def images(tower: Tower, columns: Array) -> Iterator[tuple[slice, Array, Array]]:
    """Give A and M times columns some rows at a time, in double precision."""
    level, device = tower.levels[0], tower.device
    width, arrays = columns.shape[1], device.arrays
    room = [arrays.empty((min(device.rows, level.n), width)) for _ in range(2)]
    for rows in row_chunks(tower):
        image, weighed = (part[: rows.stop - rows.start] for part in room)
        multiply(device, level.stiffness, columns, image, rows)
        if level.mass is None:
            arrays.multiply(columns[rows], level.weights[rows], out=weighed)
        else:
            multiply(device, level.mass, columns, weighed, rows)
        yield rows, image, weighed


def _residual_rows(
    tower: Tower, columns: Array, values: np.ndarray
) -> Iterator[tuple[slice, Array]]:
    """Give A S - M S θ some rows at a time."""
    known = put(tower.device, values)
    for rows, image, weighed in images(tower, columns):
        tower.device.arrays.multiply(weighed, known, out=weighed)
        yield rows, tower.device.arrays.subtract(image, weighed, out=image)


def norms_of_residuals(tower: Tower, columns: Array, values: np.ndarray) -> Float[np.ndarray, " m"]:
    """Return the norms of the columns' residuals, in the inverse of M or of its diagonal."""
    squares = tower.device.arrays.zeros(len(values))
    for rows, rest in _residual_rows(tower, columns, values):
        squares += _squares(tower, rows, rest)
    return np.sqrt(fetch(tower.device, squares))


def _squares(tower: Tower, rows: slice, rest: Array) -> Array:
    rest *= rest
    rest /= tower.levels[0].weights[rows]
    return rest.sum(axis=0)


def chosen(tower: Tower, columns: Array, some: np.ndarray) -> Array:
    """Return some of the columns, beside each other."""
    arrays = tower.device.arrays
    picked, places = (
        arrays.empty((len(columns), len(some)), dtype=columns.dtype),
        put(tower.device, some),
    )
    for rows in row_chunks(tower):
        picked[rows] = arrays.take(columns[rows], places, axis=1)
    return picked


def residual_block(
    tower: Tower, columns: Array, values: np.ndarray, scales: np.ndarray
) -> tuple[Array, Float[np.ndarray, " b"]]:
    """Return scaled residuals in single precision, and their norms."""
    arrays, device = tower.device.arrays, tower.device
    factors, squares = put(device, scales), arrays.zeros(len(values))
    block = arrays.empty(columns.shape, dtype=np.float32)
    for rows, rest in _residual_rows(tower, columns, values):
        block[rows] = rest * factors
        squares += _squares(tower, rows, rest)
    return block, np.sqrt(fetch(device, squares))


def keep_outside(tower: Tower, columns: Array, block: Array) -> None:
    """Take from a block in place what lies in the span of columns that are orthonormal in M, or in its diagonal."""
    arrays, weights = tower.device.arrays, tower.levels[0].weights
    inside = arrays.zeros((columns.shape[1], block.shape[1]))
    for rows in row_chunks(tower):
        inside += columns[rows].T @ (weights[rows] * block[rows]).astype(columns.dtype)
    for rows in row_chunks(tower):
        block[rows] -= columns[rows] @ inside.astype(columns.dtype)
