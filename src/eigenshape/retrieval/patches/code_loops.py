"""Kernels of `distance` and `coarse`: codes of four bits, and distances of two descriptions or of short rows."""

import numpy as np
from jaxtyping import Float32, Float64, Int8, Int16, UInt8

from eigenshape._kernels import Out, kernel


@kernel("n", "half")
def unpack(rows: UInt8[np.ndarray, "n half"], codes: Out[Int8[np.ndarray, "n half*2"]]) -> None:
    """Write the codes of packed rows: the first half of a code lies in the low half bytes."""


@kernel("m", "v")
def lengths(codes: Int8[np.ndarray, "m v"], found: Out[Float64[np.ndarray, " m"]]) -> None:
    """Write the length of each code; 1 for a code of zeros, whose cosines are 0."""


@kernel("m", "k", "v")
def distances_to(
    query: Int8[np.ndarray, "m v"],
    query_lengths: Float64[np.ndarray, " m"],
    others: Int8[np.ndarray, "k*m v"],
    other_lengths: Float64[np.ndarray, " k*m"],
    n_sizes: int,
    price: float,
    found: Out[Float64[np.ndarray, " k"]],
) -> None:
    """Write the distance from one description to each of many, whose rows lie one after another.

    A distance is 1 - the mean cosine of two descriptions at the best relative size.
    """


@kernel("n_query", "n_rows", "half")
def packed_view_distance(
    query: Int8[np.ndarray, "n_query half*2"],
    query_lengths: Float64[np.ndarray, " n_query"],
    packed: UInt8[np.ndarray, "n_rows half"],
    codes: Out[Int8[np.ndarray, "most half*2"]],
    code_lengths: Out[Float64[np.ndarray, " most"]],
    m: int,
    n_sizes: int,
    price: float,
) -> float:
    """Return the mean of two distances: to a whole, and to the nearest of it and its views.

    A description has `m` rows; those of the whole come first. If the other has no views, the views
    of the query serve in their place. `codes` and `code_lengths` are scratch memory.
    """


@kernel("n", "s", "d")
def scan(
    query: Int16[np.ndarray, "s d"],
    rows: Int8[np.ndarray, "n s d"],
    unit: float,
    price: float,
    found: Out[Float32[np.ndarray, " n"]],
) -> None:
    """Write 1 - the best mean cosine over relative sizes, of one query with each shape.

    `query` is (s, d) int16 and `rows` (n, s, d) int8; `unit` is the mean cosine of a product of 1.
    """
