"""Kernels of products with tall blocks whose columns are packed by eight."""

import numpy as np
from jaxtyping import Float64, Int32, Int64

from certeig.kit.kernels import Out, kernel

LANES = 8  # numbers of a row that are adjacent
CHUNK = 4096  # rows of a block that take a quarter of the second-level cache

Slots = Float64[np.ndarray, "slots n 8"]
Block = Float64[np.ndarray, "groups n 8"]
Parts = Float64[np.ndarray, "groups slots*8 8"]
Rows = Float64[np.ndarray, "n 8"]


@kernel("slots", "groups", "n")
def add_products(
    space: Slots,
    columns: Block,
    parts: Out[Parts],
    begin: int,
    end: int,
) -> None:
    """Add the rows of the product spaceᵀ columns that belong to slots begin to end - 1 to `parts`.

    The shapes are (s, n, LANES), (g, n, LANES) and (g, s LANES, LANES).
    """


@kernel("slots", "groups", "n")
def subtract_combination(
    space: Slots,
    parts: Parts,
    columns: Out[Block],
    begin: int,
    end: int,
) -> None:
    """Subtract the product of `space` and `parts` from rows begin to end - 1 of the columns.

    The shapes are as in `add_products`.
    """


@kernel()
def multiply_lanes(
    matrix: tuple[Int64[np.ndarray, "n+1"], Int32[np.ndarray, " e"], Float64[np.ndarray, " e"]],
    given: Rows,
    before: Rows,
    factor: float,
    share: float,
    begin: int,
    end: int,
    out: Out[Rows],
) -> None:
    """Fill rows begin to end - 1 of `out` with factor A given - share before.

    The matrix A is given by int64 pointers, int32 indices and entries. The columns have shape (n,
    LANES); `out` may be `before`.
    """
