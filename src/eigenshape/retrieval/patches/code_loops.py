"""Kernels of `distance` and `coarse`: codes of four bits, and distances of descriptions or short rows.

A description has `m` codes, for each base radius those of `n_sizes` sizes.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int8, Int16, Int64, UInt8

from eigenshape._kernels import Out, kernel


@kernel("r", "half")
def unpack_rows(
    rows: UInt8[np.ndarray, "r half"], codes: Out[Int8[np.ndarray, "r 2*half"]]
) -> None:
    """Write the codes of packed rows: the first half of a code lies in the low half bytes."""


@kernel("r", "v")
def fill_lengths(codes: Int8[np.ndarray, "r v"], found: Out[Float64[np.ndarray, " r"]]) -> None:
    """Write the length of each code; 1 for a code of zeros, whose cosines are 0."""


@kernel("m", "v", "k")
def distances_to(
    query: Int8[np.ndarray, "m v"],
    query_lengths: Float64[np.ndarray, " m"],
    others: Int8[np.ndarray, "r v"],
    other_lengths: Float64[np.ndarray, " r"],
    n_sizes: int,
    price: float,
    found: Out[Float64[np.ndarray, " k"]],
) -> None:
    """Write 1 - the mean cosine of one description and each of many, at the best relative size.

    The codes of the others lie one below the other.
    """


@kernel("u", "v", "k")
def packed_view_distances(
    query: Int8[np.ndarray, "u v"],
    query_lengths: Float64[np.ndarray, " u"],
    others: list[UInt8[np.ndarray, "_ v//2"]],
    n_rows: Int64[np.ndarray, " k"],
    codes: Out[Int8[np.ndarray, "most v"]],
    code_lengths: Out[Float64[np.ndarray, " most"]],
    m: int,
    n_sizes: int,
    price: float,
    found: Out[Float64[np.ndarray, " k"]],
) -> None:
    """Write the mean of two distances to each other shape: to it, and to the nearest of it and its views.

    Of the packed codes of a shape, which are `n_rows`, those of the whole come first. If it has no
    views, the views of the query serve in their place. `codes` and `code_lengths` are scratch for
    the largest shape.
    """


@kernel("s", "d", "n")
def scan_rows(
    query: Int16[np.ndarray, "s d"],
    rows: Int8[np.ndarray, "n s d"],
    unit: float,
    price: float,
    found: Out[Float32[np.ndarray, " n"]],
) -> None:
    """Write 1 - the best mean cosine over relative sizes, of one query with each shape.

    `unit` is the mean cosine of a product of 1.
    """
