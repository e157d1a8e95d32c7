"""Kernels of `elimination`: L D Lᵀ front by front, and solves with it."""

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel

WIDE = 64  # columns in a panel of L
SMALL = 40  # rows of a front up to which plain loops are faster (measured)
LONG = 256  # terms of a sum in one product

Some = Int64[np.ndarray, " _"]
Points = Int64[np.ndarray, " n"]
Fronts = Int64[np.ndarray, " size"]
FrontPointers = Int64[np.ndarray, "size+1"]
Tasks = Int64[np.ndarray, "t+1"]
Numbers = Float64[np.ndarray, " _"]
Values = Float64[np.ndarray, " n"]
Rows = Float64[np.ndarray, "n 8"]
SomeRows = Float64[np.ndarray, "_ 8"]


@kernel()
def factor_fronts(
    tree: tuple[FrontPointers, FrontPointers, Some, Fronts, Fronts, FrontPointers],
    lower: tuple[Int64[np.ndarray, "n+1"], Int64[np.ndarray, " e"], Float64[np.ndarray, " e"]],
    panels: Out[Numbers],
    pivots: Out[Values],
    updates: tuple[Out[Numbers], Out[Fronts]],
    room: tuple[Out[Numbers], Out[Numbers], Out[Points], Out[Some]],
    begin: int,
    end: int,
    top: int,
    blas: tuple[int],
) -> bool:
    """Fill panels and pivots with L and D of the fronts begin to end - 1, which are one task.

    This is the multifrontal method (Duff and Reid 1983) without pivoting: a front gathers the
    entries of its columns and the updates of its children, eliminates its columns, and passes the
    rest to its parent as an update.

    `tree` is the elimination, `lower` the matrix by the columns of its lower triangle, `updates`
    memory for updates and the place of each. `room` is memory for a front, for LONG numbers of each
    of its rows and a panel of eight rows, and for a number of each row of the matrix and of the
    front. The updates of a task are a stack of lower triangles, row by row, from `top` on. Returns
    whether all pivots are finite and not zero.
    """


@kernel()
def solve_lower(
    tree: tuple[Points, FrontPointers, FrontPointers, FrontPointers],
    tasks: tuple[Tasks, Some, Tasks, Tasks, Int64[np.ndarray, " f"], Int64[np.ndarray, " f"]],
    panels: Numbers,
    right: Rows,
    lanes: Out[SomeRows],
    gathered: Out[SomeRows],
    begin: int,
    end: int,
) -> None:
    """Fill rows of `lanes` with L⁻¹ times the right-hand sides, in the order of elimination.

    The rows of tasks begin to end - 1; `tree` and `tasks` are the elimination and its tasks.
    """


@kernel()
def solve_upper(
    tree: tuple[Points, FrontPointers, FrontPointers, FrontPointers],
    rows: Some,
    fronts: Some,
    panels: Numbers,
    pivots: Values,
    lanes: Out[SomeRows],
    solution: Out[Rows],
    gathered: Out[SomeRows],
    begin: int,
    end: int,
) -> None:
    """Fill rows of `solution` with L⁻ᵀ D⁻¹ times the result of `solve_lower` in `lanes`.

    The rows of tasks begin to end - 1, in the order of the matrix. `gathered` is
    scratch.
    """


@kernel("size")
def add_sizes(
    first: FrontPointers,
    begins: FrontPointers,
    rows: Some,
    places: FrontPointers,
    panels: Numbers,
    pivots: Values,
    weights: Out[Values],
    sizes: Out[Values],
    terms: Out[Points],
) -> None:
    """Add the row sums of |L||D||L|ᵀ to `sizes`, and the number of entries per row of L to `terms`.

    All entries of a column are in one panel, so its sum |D||L|ᵀ 1 is complete before the rows of
    the panel are weighted by it. `weights` is scratch, filled with 0.
    """
