"""Kernels of `elimination`: symbolic analysis, which finds the entries of a factor."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel

Columns = Int64[np.ndarray, " n"]
Pointers = Int64[np.ndarray, "n+1"]
Some = Int64[np.ndarray, " _"]
Runs = Int64[np.ndarray, " size"]


@kernel("count")
def find_dominated(
    indptr: Pointers,
    indices: Some,
    order: Int64[np.ndarray, " count"],
    leader: Out[Columns],
    mark: Out[Columns],
) -> None:
    """Fill the place, in an order of points, of the first that dominates each other point.

    Point v dominates its neighbor u if it is joined to all neighbors of u; of two points that
    dominate each other, the first in the order does. A point that is dominated itself is passed
    over: what dominates it dominates all that it does. `leader` and `mark` come filled with -1;
    `mark` is scratch.
    """


@kernel("n")
def find_parents(
    indptr: Pointers,
    indices: Some,
    order: Columns,
    place: Columns,
    parent: Out[Columns],
    ancestor: Out[Columns],
) -> None:
    """Fill the elimination tree: the parent of each column, -1 at a root (Liu 1990).

    Columns are numbered in the given order; `place` is its inverse. `parent` and `ancestor` come
    filled with -1; `ancestor` is scratch.
    """


@kernel("n")
def postorder(
    parent: Columns,
    first_child: Out[Columns],
    sibling: Out[Columns],
    stack: Out[Columns],
    order: Out[Columns],
) -> None:
    """Fill `order` with a postorder of the columns: children first, each subtree contiguous.

    `first_child` and `sibling` come filled with -1; both and `stack` are scratch.
    """


@kernel("n")
def count_entries(
    indptr: Pointers,
    indices: Some,
    order: Columns,
    place: Columns,
    parent: Columns,
    mark: Out[Columns],
    counts: Out[Columns],
) -> None:
    """Count the entries of each column of the factor, with the diagonal.

    `mark` comes filled with -1 and is scratch; `counts` comes filled with 1.
    """


@kernel("size")
def join_runs(
    parent: Some,
    first: Runs,
    heights: Out[Runs],
    widths: Out[Runs],
    zeros: Out[Float64[np.ndarray, " size"]],
    keep: Out[Bool[np.ndarray, " size"]],
) -> None:
    """Merge supernodes with nearly the same entries; `keep` tells which ones remain.

    Each supernode is a run of columns. It begins at column `first` and has `heights` rows and
    `widths` columns, which grow when it absorbs the next one. `keep` becomes False for a supernode
    that is absorbed. `zeros` is scratch, filled with 0; `keep` comes filled with True.
    """


@kernel("size")
def find_front_rows(
    indptr: Pointers,
    indices: Some,
    order: Columns,
    place: Columns,
    first: Int64[np.ndarray, "size+1"],
    begins: Int64[np.ndarray, "size+1"],
    above: Runs,
    rows: Out[Some],
    first_child: Out[Runs],
    sibling: Out[Runs],
    mark: Out[Columns],
) -> None:
    """Fill the rows of the front of each supernode s, from rows[begins[s]] on.

    Its own columns come first. Then follow, in any order, the rows of its columns' entries and
    those that its children pass on. `first_child`, `sibling` and `mark` are scratch, filled with
    -1.
    """
