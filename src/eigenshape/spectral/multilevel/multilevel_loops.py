"""Kernels of `aggregation` and `vcycle`: aggregates, sparse products, and smoothing."""

from typing import Any

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64

from certeig.kit.kernels import Out, kernel

Starts = Int32[np.ndarray, " _"]
Columns = Int32[np.ndarray, " n_values"]
Values = Float64[np.ndarray, " n_values"]
SingleValues = Float32[np.ndarray, " n_values"]
Matrix = tuple[Int32[np.ndarray, " _"], Int32[np.ndarray, " _"], Float64[np.ndarray, " _"]]
Block = Float64[np.ndarray, "_ width"]
SingleBlock = Float32[np.ndarray, "_ width"]
Rows = Float32[np.ndarray, "n width"]
Diagonal = Float32[np.ndarray, "n 1"]


def grow_aggregates(
    starts: Int32[np.ndarray, " n1"],
    columns: Int32[np.ndarray, " e"],
    values: Float64[np.ndarray, " e"],
    size: int,
) -> tuple[Int32[np.ndarray, " n"], int]:
    """Label points by aggregates of about `size` points; return the labels and their number.

    Aggregates grow along strong negative couplings. Points of those that stay small are moved to
    the aggregate that they are most strongly coupled to.
    """
    n = len(starts) - 1
    labels, strongest = np.empty(n, dtype=np.int32), np.empty(n)
    counts, members = np.empty(n, dtype=np.int64), np.empty(size, dtype=np.int64)
    return labels, fill_aggregates(starts, columns, values, labels, strongest, counts, members)


@kernel("n_starts", "size")
def fill_aggregates(
    starts: Int32[np.ndarray, " n_starts"],
    columns: Columns,
    values: Values,
    labels: Out[Int32[np.ndarray, " n_starts-1"]],
    strongest: Out[Float64[np.ndarray, " n_starts-1"]],
    counts: Out[Int64[np.ndarray, " n_starts-1"]],
    members: Out[Int64[np.ndarray, " size"]],
) -> int:
    """Fill the labels that `grow_aggregates` returns, and return their number; the rest is scratch."""


def multiply_sparse(
    left: Matrix, right: Matrix, n_columns: int, begin: int, end: int
) -> tuple[Int32[np.ndarray, " r"], Int32[np.ndarray, " e"], Float64[np.ndarray, " e"]]:
    """Return rows begin to end - 1 of the product of two matrices by rows: their lengths, columns and values.

    Columns of a row come in any order, and in a row of `left` several times if need be.
    """
    # In runs of as many rows as there is room for, since their lengths are not known before
    runs = []
    room = max(n_columns, 2 * len(right[2]) * (end - begin) // (len(left[0]) - 1))
    while begin < end:
        lengths = np.empty(end - begin, dtype=np.int32)
        columns, values = np.empty(room, dtype=np.int32), np.empty(room)
        places = np.full(n_columns, -1)
        done = fill_products(left, right, begin, end, lengths, columns, values, places)
        total = lengths[:done].sum()
        runs.append((lengths[:done], columns[:total], values[:total]))
        begin += done
    lengths, columns, values = (np.concatenate(parts) for parts in zip(*runs, strict=True))
    return lengths, columns, values


@kernel("room", "n_columns")
def fill_products(
    left: Matrix,
    right: Matrix,
    begin: int,
    end: int,
    lengths: Out[Int32[np.ndarray, " end-begin"]],
    columns: Out[Int32[np.ndarray, " room"]],
    values: Out[Float64[np.ndarray, " room"]],
    places: Out[Int64[np.ndarray, " n_columns"]],
) -> int:
    """Fill rows of a product, and return for how many there was room.

    There is always room for one row if there is room for all columns. `places` comes as -1.
    """


def multiply_rows(
    starts: Int32[np.ndarray, " n1"],
    columns: Int32[np.ndarray, " e"],
    values: np.ndarray,
    block: np.ndarray,
    product: np.ndarray,
    begin: int,
    end: int,
    first: int,
) -> None:
    """Write rows begin to end - 1 of a sparse matrix times columns to `product`, from row `first` on.

    Columns in single precision are multiplied by values in single or double precision.
    """
    multiply: Any = multiply_single if values.dtype == np.float32 else multiply_double
    if block.dtype != values.dtype:
        multiply = multiply_mixed
    multiply(starts, columns, values, block, product, begin, end, first)


@kernel("width")
def multiply_single(
    starts: Starts,
    columns: Columns,
    values: SingleValues,
    block: SingleBlock,
    product: Out[SingleBlock],
    begin: int,
    end: int,
    first: int,
) -> None:
    """Multiply as `multiply_rows` does, all in single precision."""


@kernel("width")
def multiply_mixed(
    starts: Starts,
    columns: Columns,
    values: Values,
    block: SingleBlock,
    product: Out[Block],
    begin: int,
    end: int,
    first: int,
) -> None:
    """Multiply as `multiply_rows` does, columns in single precision with values in double."""


@kernel("width")
def multiply_double(
    starts: Starts,
    columns: Columns,
    values: Values,
    block: Block,
    product: Out[Block],
    begin: int,
    end: int,
    first: int,
) -> None:
    """Multiply as `multiply_rows` does, all in double precision."""


@kernel("width")
def smoothing_step(
    matrix: tuple[Starts, Columns, SingleValues],
    scales: tuple[Diagonal, Diagonal],
    terms: tuple[Rows, Float32[np.ndarray, " width"]],
    block: Rows,
    step: Out[Rows],
    moved: Out[Rows],
    old: float,
    new: float,
    begin: int,
    end: int,
) -> None:
    """Compute rows begin to end - 1 of one Chebyshev step in place, and of the block after it.

    step = old step + new D⁻¹ (r - (A - θ M) block), and moved = block + step. The diagonals M and
    D⁻¹ are in `scales`. All is in single precision.
    """
