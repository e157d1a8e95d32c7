"""Tasks of a factor, which several threads share: subtrees of fronts, then the fronts above them."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import record

Indices = Int[np.ndarray, " ..."]

# Numbers in the smallest factor that is divided: below, threads cost more than they save.
FEWEST_ENTRIES = 2_000_000
# A subtree is one task if it has at most this share of all entries.
LARGEST_SHARE = 1 / 24


@record
class Tasks:
    """Fronts in tasks: those of one round need nothing of each other.

    How fronts are divided depends on the factor alone, so that digits do not depend on the number
    of threads. A task adds what concerns rows of later tasks to rows of its own, n and following;
    the task that eliminates such a row begins by fetching it from all of them, in order.

    Attributes
    ----------
    first : (t+1,) int
        First front of each task.
    rounds : tuple of (r,) int
        The tasks of each round, ascending.
    rows : (r,) int
        The rows of fronts as in `Elimination.rows`, but own rows for those of later tasks.
    own_rows : (t+1,) int
        Where the own rows of each task begin; the first is n.
    fetches : (t+1,) int
        Where the fetches of each task begin.
    fetched, to : (f,) int
        The row that is fetched, and the row that it is added to.
    """

    first: Indices
    rounds: tuple[Indices, ...]
    rows: Indices
    own_rows: Indices
    fetches: Indices
    fetched: Indices
    to: Indices

    @property
    def arrays(self) -> tuple[Indices, Indices, Indices, Indices, Indices, Indices]:
        """What kernels need of the tasks."""
        return self.first, self.rows, self.own_rows, self.fetches, self.fetched, self.to

    @property
    def n(self) -> int:
        """Number of tasks."""
        return len(self.first) - 1


def divide_fronts(
    first: Indices, begins: Indices, rows: Indices, above: Indices, places: Indices
) -> Tasks:
    """Divide the fronts of an elimination into tasks; the arguments are its attributes."""
    n = int(first[-1])
    starts = _task_starts(above, np.diff(places).astype(float))
    n_tasks = len(starts) - 1
    task = np.repeat(np.arange(n_tasks), np.diff(starts))

    # Rows of later tasks become rows of the task's own, which these fetch.
    of_entry = np.repeat(task, np.diff(begins))
    later = np.flatnonzero(rows >= first[starts[1:]][of_entry])
    keys, inverse = np.unique(of_entry[later] * n + rows[later], return_inverse=True)
    own = rows.copy()
    own[later] = n + inverse
    own_rows = n + np.searchsorted(keys, n * np.arange(n_tasks + 1))
    eliminated_by = np.repeat(task, np.diff(first))[keys % n]
    order = np.argsort(eliminated_by, kind="stable")
    fetches = np.searchsorted(eliminated_by[order], np.arange(n_tasks + 1))

    # All that a task needs is done in rounds before.
    has_parent = np.flatnonzero(above >= 0)
    needed, needing = task[has_parent], task[above[has_parent]]
    edges = np.unique(np.stack([needed, needing])[:, needed != needing], axis=1)
    number = np.zeros(n_tasks, dtype=np.int64)
    for one, other in edges.T.tolist():  # sorted by the task that is needed, which comes before
        number[other] = max(number[other], number[one] + 1)
    rounds = tuple(np.flatnonzero(number == each) for each in range(number.max() + 1))
    return Tasks(starts, rounds, own, own_rows, fetches, n + order, keys[order] % n)


def _task_starts(above: Indices, entries: Float[np.ndarray, " s"]) -> Indices:
    """Return the first front of each task, and the number of fronts at the end.

    Small subtrees that follow each other are one task, as long as all of them together are small.
    Fronts above them are one task as long as each is the parent of the one before.
    """
    size, most = len(above), LARGEST_SHARE * entries.sum()
    if entries.sum() < FEWEST_ENTRIES:
        return np.array([0, size])

    # The first front of the subtree of each front, and the entries of all its fronts.
    leaf, totals = list(range(size)), entries.tolist()
    for s, parent in enumerate(above.tolist()):
        if parent >= 0:
            leaf[parent] = min(leaf[parent], leaf[s])
            totals[parent] += totals[s]
    high = np.array(totals) > most
    is_root = ~high & ((above < 0) | high[above])
    subtree = {leaf[root]: totals[root] for root in np.flatnonzero(is_root).tolist()}

    starts, weight = [0], 0.0
    for s in range(1, size):
        chain = high[s] and high[s - 1] and above[s - 1] == s
        added = subtree.get(s, 0.0)
        fits = not high[s] and not high[s - 1] and weight + added <= most
        if chain or fits:
            weight += added
        else:
            starts.append(s)
            weight = added
    return np.array([*starts, size])
