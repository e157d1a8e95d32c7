"""The symbolic analysis of symmetric matrices that share a pattern: an order, and fronts."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from certeig.kit.arrays import record
from certeig.sparse import front_loops as fronts
from certeig.sparse import symbolic_loops as symbolic
from certeig.sparse.dissection import DENSE, dissect
from certeig.sparse.dissection_loops import LEAF
from certeig.sparse.tasks import Tasks, divide_fronts

Indices = Int[np.ndarray, " ..."]
# Largest share of points that are not dominated by others with which they alone are dissected.
LARGEST_CORE = 0.5


@record
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
    last_child, older : (s,) int
        The last child of each front, and its brother before it; -1 where there is none.
    places : (s+1,) int
        Where the entries of each front begin in the array of all entries of L.
    tasks : Tasks
        How threads share the fronts.
    stacks : (t,) int
        Numbers in the stack of updates of each task.
    taken : (t,) int
        The last task that takes updates from that stack.
    tallest : int
        The rows of the largest front.
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
    last_child: Indices
    older: Indices
    places: Indices
    tasks: Tasks
    stacks: Indices
    taken: Indices
    tallest: int
    lengths: Indices
    lower_ptr: Indices
    lower_rows: Indices
    source: Indices

    @property
    def n_entries(self) -> int:
        """Number of stored entries of L."""
        return int(self.places[-1])


def analyze_pattern(pattern: sp.csc_array) -> Elimination:
    """Order the elimination of a symmetric matrix and find the fronts of its factor.

    The pattern has all entries of the matrix, above and below the diagonal.
    """
    n = pattern.shape[0]
    indptr, indices = pattern.indptr.astype(np.int64), pattern.indices.astype(np.int64)
    order = _order_points(indptr, indices)
    parent = _unknown(n)  # of each column of the factor; -1 at a root
    symbolic.find_parents(indptr, indices, order, np.argsort(order), parent, _unknown(n))

    # Renumber the columns by a postorder, so that supernodes are runs of columns.
    post = np.empty(n, dtype=np.int64)
    symbolic.postorder(parent, _unknown(n), _unknown(n), np.empty_like(post), post)
    order = order[post]
    parent = np.where(parent[post] >= 0, np.argsort(post)[parent[post]], -1)
    place = np.argsort(order)

    # In a supernode each column is the parent of the one before, with the same entries below. Each
    # is a front, or several are joined to one.
    counts = np.ones(n, dtype=np.int64)
    symbolic.count_entries(indptr, indices, order, place, parent, _unknown(n), counts)
    continues = (parent[:-1] == np.arange(1, n)) & (counts[:-1] == counts[1:] + 1)
    first = np.concatenate([[0], np.flatnonzero(~continues) + 1])
    heights, widths = counts[first], np.diff(first, append=n)
    keep = np.ones(len(first), dtype=np.bool_)
    symbolic.join_runs(parent, first, heights, widths, np.zeros(len(first)), keep)
    first, heights = np.append(first[keep], n), heights[keep]
    widths, size = np.diff(first), len(heights)

    # The tree of the fronts, and their rows.
    front = np.arange(size)
    above = np.repeat(front, widths)[parent[first[1:] - 1]]
    above[parent[first[1:] - 1] < 0] = -1
    begins = np.concatenate([[0], np.cumsum(heights)])
    rows = np.empty(begins[-1], dtype=np.int64)
    scratch = _unknown(size), _unknown(size), _unknown(n)
    symbolic.find_front_rows(indptr, indices, order, place, first, begins, above, rows, *scratch)
    rows = np.sort(np.repeat(front * n, heights) + rows) % n  # ascending in each front

    last_child, older = _unknown(size), _unknown(size)
    by_parent = np.argsort(above, kind="stable")
    parents = above[by_parent]
    brothers = (parents[1:] == parents[:-1]) & (parents[1:] >= 0)
    older[by_parent[1:][brothers]] = by_parent[:-1][brothers]
    last_child[parents[parents >= 0]] = by_parent[parents >= 0]  # the last of several stays

    # The lower triangle by columns, in the order of elimination.
    sizes = np.diff(indptr)[order]
    ends = np.cumsum(sizes)
    source = np.arange(len(indices)) + np.repeat(indptr[order] - ends + sizes, sizes)
    columns, lower_rows = np.repeat(np.arange(n), sizes), place[indices[source]]
    lower = np.flatnonzero(lower_rows >= columns)
    lower_ptr = np.searchsorted(columns[lower], np.arange(n + 1))

    places = _panel_places(widths, heights)
    tasks = divide_fronts(first, begins, rows, above, places)
    stacks, taken = _stacks(heights - widths, above, tasks)
    return Elimination(
        order=order,
        first=first,
        begins=begins,
        rows=rows,
        above=above,
        last_child=last_child,
        older=older,
        places=places,
        tasks=tasks,
        stacks=stacks,
        taken=taken,
        tallest=int(heights.max()),
        lengths=_count_roundings(widths, heights, above),
        lower_ptr=lower_ptr,
        lower_rows=lower_rows[lower],
        source=source[lower],
    )


def _order_points(indptr: Indices, indices: Indices) -> Indices:
    """Return an order of elimination with few entries in the factor.

    A point is dominated by a neighbor that has all of its neighbors, as a node on an edge or in a
    triangle of quadratic or cubic elements is by a corner. If most points are, the others are
    dissected, a smaller graph whose separators are those of the mesh, and each dominated point is
    eliminated just before the first that dominates it. That joins no points that would not have
    been joined without it.
    """
    n = len(indptr) - 1
    if len(indices) < DENSE * n:
        return dissect(indptr, indices)
    degrees = np.diff(indptr)
    leader, mark = _unknown(n), _unknown(n)
    symbolic.find_dominated(indptr, indices, np.argsort(-degrees, kind="stable"), leader, mark)
    core = np.flatnonzero(leader < 0)
    if len(core) > LARGEST_CORE * n:
        return dissect(indptr, indices)
    graph = sp.csr_array((np.ones(len(indices)), indices, indptr), shape=(n, n))[core][:, core]
    # A leaf is to have as many points with those that are dominated.
    leaf = max(LEAF * len(core) // n, 1)
    order = core[dissect(graph.indptr.astype(np.int64), graph.indices.astype(np.int64), leaf)]
    leader[:], mark[:] = -1, -1
    symbolic.find_dominated(indptr, indices, order, leader, mark)
    leader[order] = np.arange(len(order))
    return np.lexsort((degrees, leader))


def _unknown(n: int) -> Indices:
    """Return an array of n times -1."""
    return np.full(n, -1, dtype=np.int64)


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


def _stacks(counts: Indices, above: Indices, tasks: Tasks) -> tuple[Indices, Indices]:
    """Return `stacks` and `taken` of an `Elimination`, given the rows of the update of each front.

    An update waits on the stack of its task until its parent is processed.
    """
    task = np.repeat(np.arange(tasks.n), np.diff(tasks.first))
    triangles = counts * (counts + 1) // 2
    change = triangles.copy()
    inside = np.flatnonzero((above >= 0) & (task[above] == task))
    np.subtract.at(change, above[inside], triangles[inside])
    sizes = np.cumsum(change)
    before = np.concatenate([[0], sizes])[tasks.first[:-1]]
    largest = np.maximum.reduceat(sizes, tasks.first[:-1]) - before

    taken, has_parent = np.arange(tasks.n), np.flatnonzero(above >= 0)
    np.maximum.at(taken, task[has_parent], task[above[has_parent]])
    return largest, taken


def _count_roundings(widths: Indices, heights: Indices, above: Indices) -> Indices:
    """Return `lengths` of an `Elimination`.

    A front adds the updates of its children. Then blocks of LONG columns update others in one product
    each. In the front that eliminates an entry, so do panels of its block, and columns of its panel
    one by one.
    """
    size = len(above)
    children = np.bincount(above[above >= 0], minlength=size)
    own = np.where(heights > fronts.SMALL, widths // fronts.LONG + 1, widths) + children
    longest = [fronts.LONG + fronts.LONG // fronts.WIDE + fronts.WIDE] * size
    for s, (parent, roundings) in enumerate(zip(above.tolist(), own.tolist(), strict=True)):
        longest[s] += roundings
        if parent >= 0:
            longest[parent] = max(longest[parent], longest[s])
    return np.array(longest)
