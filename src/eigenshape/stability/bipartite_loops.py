"""Kernel of a maximum matching (Hopcroft and Karp 1973)."""

import numpy as np
from jaxtyping import Int, Int64

from certeig.kit.kernels import Out, kernel

Indices = Int64[np.ndarray, " _"]
Rows = Int64[np.ndarray, " n"]


def match_rows(
    starts: Int[np.ndarray, " _"], columns: Int[np.ndarray, " _"], n_columns: int, first: Rows
) -> tuple[Rows, Rows]:
    """Match as many rows as possible with a column each.

    The columns of row i are columns[starts[i]:starts[i + 1]]. `first` is a matching to start from:
    the column of each row, or -1. Returns the column of each row in a largest matching, and a depth
    for each row. If a row has no column, depths ≥ 0 mark the rows that alternating paths reach from
    such rows. These rows are more than the columns in their entries, which proves that no matching
    is larger (Hall 1935).
    """
    n = len(starts) - 1
    row_of, column_of = np.full(n_columns, -1), first.copy()
    depth = np.full(n, -1)
    scratch = np.empty((3, n), dtype=np.int64)
    graph = starts.astype(np.int64, copy=False), columns.astype(np.int64, copy=False)
    complete_matching(*graph, row_of, column_of, depth, *scratch)
    return column_of, depth


@kernel("n")
def complete_matching(
    starts: Int64[np.ndarray, "n+1"],
    columns: Indices,
    row_of: Out[Indices],
    column_of: Out[Rows],
    depth: Out[Rows],
    following: Out[Rows],
    queue: Out[Rows],
    path: Out[Rows],
) -> None:
    """Complete a matching, the column of each row, to a largest one; fill depths as in `match_rows`.

    `row_of` comes filled with -1; it and the last three are scratch.
    """
