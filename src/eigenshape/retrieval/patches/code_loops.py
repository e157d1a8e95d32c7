"""Kernels of `distance` and `coarse`: codes of four bits, and distances of descriptions or short rows.

A description has `n_codes` codes: for each base radius those of `n_sizes` sizes.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int8, Int16, Int64, UInt8

from certeig.kit.kernels import Out, kernel


@kernel("n_rows", "half")
def unpack(
    rows: UInt8[np.ndarray, "n_rows half"], codes: Out[Int8[np.ndarray, "n_rows 2*half"]]
) -> None:
    """Write the codes of packed rows: the first half of a code lies in the low half bytes."""


@kernel("n_rows", "width")
def lengths(
    codes: Int8[np.ndarray, "n_rows width"], found: Out[Float64[np.ndarray, " n_rows"]]
) -> None:
    """Write the length of each code; 1 for a code of zeros, whose cosines are 0."""


@kernel("n_codes", "width", "n_others")
def distances_to(
    query: Int8[np.ndarray, "n_codes width"],
    query_lengths: Float64[np.ndarray, " n_codes"],
    others: Int8[np.ndarray, "n_others*n_codes width"],
    other_lengths: Float64[np.ndarray, " n_others*n_codes"],
    n_sizes: int,
    price: float,
    found: Out[Float64[np.ndarray, " n_others"]],
) -> None:
    """Write 1 - the mean cosine of one description and each of many, at the best relative size.

    The codes of the others lie one below the other.
    """


@kernel("n_query_codes", "width", "n_others")
def packed_view_distances(
    query: Int8[np.ndarray, "n_query_codes width"],
    query_lengths: Float64[np.ndarray, " n_query_codes"],
    others: list[UInt8[np.ndarray, "_ width//2"]],
    n_rows: Int64[np.ndarray, " n_others"],
    codes: Out[Int8[np.ndarray, "most width"]],
    code_lengths: Out[Float64[np.ndarray, " most"]],
    n_codes: int,
    n_sizes: int,
    price: float,
    found: Out[Float64[np.ndarray, " n_others"]],
) -> None:
    """Write the mean of two distances to each other shape: to it, and to the nearest of it and its views.

    Of the packed codes of a shape, which are `n_rows`, those of the whole come first. If it has no
    views, the views of the query serve in their place. `codes` and `code_lengths` are scratch for
    the largest shape.
    """


@kernel("n_sizes", "width", "n_rows")
def scan(
    query: Int16[np.ndarray, "n_sizes width"],
    rows: Int8[np.ndarray, "n_rows n_sizes width"],
    unit: float,
    price: float,
    found: Out[Float32[np.ndarray, " n_rows"]],
) -> None:
    """Write 1 - the best mean cosine over relative sizes, of one query with each shape.

    `unit` is the mean cosine of a product of 1.
    """
