"""Kernel of a maximum matching (Hopcroft and Karp 1973)."""

import numpy as np
from jaxtyping import Int, Int32, Int64

from eigenshape._kernels import Out, kernel


def match_rows(
    starts: Int[np.ndarray, " n1"],
    columns: Int[np.ndarray, " k"],
    n_columns: int,
    first: Int64[np.ndarray, " n"],
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, " n"]]:
    """Match as many rows as possible with a column each.

    The columns of row i are columns[starts[i]:starts[i + 1]]. `first` is a matching to start from:
    the column of each row, or -1. Returns the column of each row in a largest matching, and a depth
    for each row. If a row has no column, depths ≥ 0 mark the rows that alternating paths reach from
    such rows. These rows are more than the columns in their entries, which proves that no matching
    is larger (Hall 1935).
    """
    column_of, row_of = first.copy(), np.full(n_columns, -1)
    depth, following, path = np.empty((3, len(first)), dtype=np.int64)
    graph = np.asarray(starts, dtype=np.int64), np.asarray(columns, dtype=np.int32)
    improve_matching(*graph, column_of, row_of, depth, following, path)
    return column_of, depth


@kernel("n")
def improve_matching(
    starts: Int64[np.ndarray, " n_starts"],
    columns: Int32[np.ndarray, " k"],
    column_of: Out[Int64[np.ndarray, " n_starts-1"]],
    row_of: Out[Int64[np.ndarray, " n_columns"]],
    depth: Out[Int64[np.ndarray, " n"]],
    following: Out[Int64[np.ndarray, " n"]],
    path: Out[Int64[np.ndarray, " n"]],
) -> None:
    """Fill the results of `match_rows`.

    On entry `column_of` is the matching to start from, and `row_of` is -1; it becomes the row of
    each column. `following` and `path` are scratch.
    """
