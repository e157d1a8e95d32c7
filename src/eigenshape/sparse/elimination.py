"""Factors L D Lᵀ of symmetric matrices that share a pattern, with pivots on the diagonal."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from eigenshape._threads import one_blas_thread
from eigenshape.sparse import front_loops as fronts
from eigenshape.sparse import symbolic_loops as symbolic
from eigenshape.sparse.blas_loops import addresses
from eigenshape.sparse.dense_loops import LONG, NARROW
from eigenshape.sparse.dissection import dissect
from eigenshape.sparse.lane_loops import LANES

EPS = float(np.finfo(np.float64).eps)

Indices = Int[np.ndarray, " ..."]
Scratch = tuple[Float[np.ndarray, "n 8"], Float[np.ndarray, "t 8"], Float[np.ndarray, " p"]]


@dataclass(frozen=True, eq=False)
class Elimination:
    """The symbolic analysis of a symmetric pattern: an order of elimination, and fronts (Liu 1992).

    Attributes
    ----------
    order : (n,) int
        The row that is eliminated at each step.
    first : (s+1,) int
        First column of each front, in the order of elimination.
    begins : (s+1,) int
    rows : (r,) int
        The rows of front i are rows[begins[i]:begins[i+1]], ascending; its own columns come first.
    above : (s,) int
        The parent of each front; -1 at a root.
    places : (s+1,) int
        Where the entries of each front begin in the array of all entries of L.
    room : (int, int)
        Largest size of the stack of updates, in numbers, and the rows of the largest front.
    lengths : (s,) int
        Bound for the number of roundings of a product up to each front.
    lower_ptr, lower_rows, source : int
        The lower triangle by columns, in the order of elimination, and the place of each entry in
        the data of the matrix that was analyzed.
    """

    order: Indices
    first: Indices
    begins: Indices
    rows: Indices
    above: Indices
    places: Indices
    room: tuple[int, int]
    lengths: Indices
    lower_ptr: Indices
    lower_rows: Indices
    source: Indices

    @property
    def n_entries(self) -> int:
        """Number of stored entries of L."""
        return int(self.places[-1])


@dataclass(frozen=True, eq=False)
class SymmetricFactor:
    """A = L D Lᵀ in an order of elimination: L unit lower triangular in panels, D diagonal."""

    elimination: Elimination
    panels: Float[np.ndarray, " e"]
    pivots: Float[np.ndarray, " n"]

    def solve(
        self, right: Float[np.ndarray, "n b"], scratch: Scratch | None = None
    ) -> Float[np.ndarray, "n b"]:
        """Solve A x = right, in the given scratch memory or in new memory."""
        width, scratch = right.shape[1], scratch or self.scratch()
        solution, lanes = np.empty((len(right), width)), np.zeros((len(right), LANES))
        for start in range(0, width, LANES):
            stop = min(start + LANES, width)
            lanes[:, : stop - start] = right[:, start:stop]
            self.solve_lanes(lanes, lanes, scratch)
            solution[:, start:stop] = lanes[:, : stop - start]
        return solution

    def scratch(self) -> Scratch:
        """Return new scratch memory for solves.

        It has room for right-hand sides in the order of elimination, for those of one front, and
        for a panel. Callers that solve often keep it, but share it with no other thread: a factor
        is a value and holds no scratch memory.
        """
        e = self.elimination
        return (
            np.empty((len(e.order), LANES)),
            np.empty((e.room[1], LANES)),
            np.empty(fronts.NEAR * fronts.WIDE),
        )

    def solve_lanes(
        self, right: Float[np.ndarray, "n 8"], out: Float[np.ndarray, "n 8"], scratch: Scratch
    ) -> None:
        """Solve A x = right for eight right-hand sides at once; `out` may be `right` itself.

        Arrays are in C order.
        """
        e = self.elimination
        tree = e.order, e.first, e.begins, e.rows, e.places
        lanes, gathered, near = scratch
        fronts.solve_lower(*tree, self.panels, right, lanes, gathered)
        fronts.solve_upper(*tree, self.panels, self.pivots, lanes, out, gathered, near)

    def rounding(self) -> Float[np.ndarray, " n"]:
        """Bound the rounding error E = A - L D Lᵀ by a diagonal: |xᵀEx| ≤ Σ r_i x_i². Return r.

        |E_ij| ≤ m eps (|L||D||L|ᵀ)_ij if each of the products that are summed up in an entry is
        rounded at most m times: once for every other term, in whatever order they are added, or
        fewer times since sums are split, as `_measure_fronts` counts (Higham 2002, sections 4.2
        and 10.1). Four more roundings are for forming A and for the sums formed here. For a symmetric
        E, |xᵀEx| is at most Σ r_i x_i² with the row sums r_i of |E|.
        """
        e = self.elimination
        n = len(e.order)
        weights, sizes, terms = np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.int64)
        tree = e.first, e.begins, e.rows, e.places
        fronts.add_sizes(*tree, self.panels, self.pivots, weights, sizes, terms)
        lengths = np.repeat(e.lengths, np.diff(e.first))
        bounds = np.empty_like(sizes)
        bounds[e.order] = EPS * (np.minimum(terms, lengths) + 4) * sizes
        return bounds


def analyze_pattern(pattern: sp.csc_array) -> Elimination:
    """Order the elimination of a symmetric matrix and find the fronts of its factor.

    The pattern has all entries of the matrix, above and below the diagonal.
    """
    n = pattern.shape[0]
    indptr, indices = pattern.indptr.astype(np.int64), pattern.indices.astype(np.int64)
    order = dissect(indptr, indices)
    parent = _parents(indptr, indices, order)
    # Renumber the columns by a postorder, so that supernodes are runs of columns.
    post = np.empty(n, dtype=np.int64)
    symbolic.postorder(parent, _unknown(n), _unknown(n), np.empty_like(post), post)
    order = order[post]
    parent = np.where(parent[post] >= 0, _inverse(post)[parent[post]], -1)
    place = _inverse(order)
    first, heights = _supernodes(indptr, indices, order, place, parent)
    size = len(heights)
    begins = np.concatenate([[0], np.cumsum(heights)])
    front = np.arange(size)
    above = np.repeat(front, np.diff(first))[parent[first[1:] - 1]]
    above[parent[first[1:] - 1] < 0] = -1
    rows = np.empty(begins[-1], dtype=np.int64)
    scratch = _unknown(size), _unknown(size), _unknown(n)
    symbolic.find_front_rows(indptr, indices, order, place, first, begins, above, rows, *scratch)
    rows = np.sort(np.repeat(front * n, heights) + rows) % n  # ascending in each front
    lower_ptr, lower_rows, source = _lower(indptr, indices, place)
    places = _panel_places(np.diff(first), heights)
    room, lengths = _measure_fronts(np.diff(first), heights, above)
    return Elimination(
        order, first, begins, rows, above, places, room, lengths, lower_ptr, lower_rows, source
    )


def _unknown(n: int) -> Indices:
    """Return an array of n times -1."""
    return np.full(n, -1, dtype=np.int64)


def _inverse(order: Indices) -> Indices:
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return place


def _parents(indptr: Indices, indices: Indices, order: Indices) -> Indices:
    """Return the parent of each column of the factor; -1 at a root."""
    parent = _unknown(len(order))
    symbolic.find_parents(indptr, indices, order, _inverse(order), parent, _unknown(len(order)))
    return parent


def _supernodes(
    indptr: Indices, indices: Indices, order: Indices, place: Indices, parent: Indices
) -> tuple[Indices, Indices]:
    """Return the first column of each supernode, with n at the end, and the rows of its front."""
    n = len(order)
    counts = np.ones(n, dtype=np.int64)
    symbolic.count_entries(indptr, indices, order, place, parent, _unknown(n), counts)
    # In a supernode each column is the parent of the one before, with the same entries below.
    continues = (parent[:-1] == np.arange(1, n)) & (counts[:-1] == counts[1:] + 1)
    first = np.concatenate([[0], np.flatnonzero(~continues) + 1])
    heights, widths = counts[first], np.diff(first, append=n)
    keep = np.ones(len(first), dtype=np.bool_)
    symbolic.join_runs(parent, first, heights, widths, np.zeros(len(first)), keep)
    return np.append(first[keep], n), heights[keep]


def _panel_places(widths: Indices, heights: Indices) -> Indices:
    """Return where the panels of each front begin in the array of all entries.

    A panel has at most WIDE columns. The panel that begins at column b of its front has the rows
    from b on.
    """
    full = widths // fronts.WIDE  # full panels; the last one has the remaining columns
    above = fronts.WIDE * full
    entries = above * heights - fronts.WIDE**2 * full * (full - 1) // 2
    entries += (heights - above) * (widths - above)
    return np.concatenate([[0], np.cumsum(entries)])


def _measure_fronts(
    widths: Indices, heights: Indices, above: Indices
) -> tuple[tuple[int, int], Indices]:
    """Return `room` and `lengths` of an `Elimination`.

    A front adds the updates of its children. Then blocks of its columns update others, LONG terms
    at a time.
    """
    size = len(above)
    has_parent = above >= 0
    children = np.bincount(above[has_parent], minlength=size)
    # An update waits on the stack until its parent is processed.
    updates = (heights - widths) ** 2
    waiting = np.zeros(size, dtype=np.int64)
    np.add.at(waiting, above[has_parent], updates[has_parent])
    stack = np.cumsum(updates - waiting)
    # Blocks of NARROW columns are doubled until they are as wide as the front.
    doublings = np.ceil(np.log2(np.maximum(widths / NARROW, 1))).astype(np.int64)
    own = np.where(heights > fronts.SMALL, widths // LONG + 2 + doublings, widths) + children
    longest = [LONG] * size
    for s, (parent, roundings) in enumerate(zip(above.tolist(), own.tolist(), strict=True)):
        longest[s] += roundings
        if parent >= 0:
            longest[parent] = max(longest[parent], longest[s])
    return (int(stack.max()), int(heights.max())), np.array(longest)


def _lower(indptr: Indices, indices: Indices, place: Indices) -> tuple[Indices, Indices, Indices]:
    columns, rows = np.repeat(place, np.diff(indptr)), place[indices]
    kept = np.flatnonzero(rows >= columns)
    kept = kept[np.argsort(columns[kept], kind="stable")]
    pointers = np.concatenate([[0], np.cumsum(np.bincount(columns[kept], minlength=len(place)))])
    return pointers, rows[kept], kept


def factorize_symmetric(
    elimination: Elimination, data: Float[np.ndarray, " e"], spent: SymmetricFactor | None = None
) -> SymmetricFactor | None:
    """Factor the matrix with these entries; return None if a pivot is zero or not finite.

    The memory of a spent factor, if one is given, is used again.
    """
    e = elimination
    panels = (
        np.empty(e.n_entries) if spent is None else spent.panels
    )  # new memory pages cost half as much as a factorization
    pivots = np.empty(len(e.order))
    lower = e.lower_ptr, e.lower_rows, data[e.source]
    tree = e.first, e.begins, e.rows, e.above, e.places
    waiting, tallest = e.room
    places = np.empty(len(e.order), dtype=np.int64), np.empty(len(e.above), dtype=np.int64)
    workspace = np.empty(waiting), np.empty(tallest**2), np.empty(tallest**2), *places
    children = np.bincount(e.above[e.above >= 0], minlength=len(e.above))
    sound = fronts.factor_fronts(*lower, *tree, panels, pivots, workspace, children, addresses())
    return SymmetricFactor(e, panels, pivots) if sound else None


def factor_matrix(matrix: sp.sparray) -> SymmetricFactor | None:
    """Factor one symmetric matrix; return None if a pivot is zero or not finite."""
    columns = sp.csc_array(matrix)
    columns.sort_indices()
    with one_blas_thread():
        return factorize_symmetric(analyze_pattern(columns), columns.data)
