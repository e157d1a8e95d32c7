"""Factors L D Lᵀ of symmetric matrices that share a pattern, with pivots on the diagonal."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS, record
from certeig.kit.blas import blas_routine
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import (
    SpareMemory,
    free_threads,
    map_in_threads,
    one_blas_thread,
)
from certeig.kit.typing import ArrayLike
from certeig.sparse import front_loops as fronts
from certeig.sparse.basis_loops import LANES
from certeig.sparse.elimination import Elimination, analyze_pattern

Indices = Int[np.ndarray, " ..."]
# A front, its latest columns, and a number for each row of the matrix and of the front.
Room = tuple[Float[np.ndarray, " f"], Float[np.ndarray, " g"], Indices, Indices]
# The stacks of all tasks, and the place of each front in its stack.
Updates = tuple[Float[np.ndarray, " u"], Indices]


@record
class Scratch:
    """Memory for solves: the rows of all tasks, and for each thread those of a front."""

    lanes: Float[np.ndarray, "m 8"]
    rooms: SpareMemory[Float[np.ndarray, "t 8"]]


@record
class SymmetricFactor:
    """A = L D Lᵀ in an order of elimination: L unit lower triangular in panels, D diagonal."""

    elimination: Elimination
    panels: Float[np.ndarray, " e"]
    pivots: Float[np.ndarray, " n"]

    @classmethod
    def of_entries(
        cls,
        elimination: Elimination,
        data: Float[np.ndarray, " e"],
        memory: "FactorMemory | None" = None,
        spent: "SymmetricFactor | None" = None,
    ) -> "SymmetricFactor | None":
        """Factor the matrix with these entries; return None if a pivot is zero or not finite.

        The panels of a spent factor, if one is given, are filled anew.
        """
        e = elimination
        memory = memory or factor_memory(e)
        tree = e.first, e.begins, e.rows, e.last_child, e.older, e.places
        lower = e.lower_ptr, e.lower_rows, data[e.source]
        panels = np.empty(e.n_entries) if spent is None else spent.panels
        pivots = np.empty(len(e.order))
        blas = (blas_routine("dgemm"),)

        def factor_task(task: int) -> bool:
            """Factor the fronts of a task; return whether all pivots are usable."""
            begin, end = int(e.tasks.first[task]), int(e.tasks.first[task + 1])
            with memory.rooms.lend() as room:
                given = tree, lower, panels, pivots, updates, room
                return bool(fronts.factor_fronts(*given, begin, end, memory.stacks[task], blas))

        with memory.updates.lend() as updates:
            for tasks in memory.rounds:
                if not all(map_in_threads(factor_task, tasks)):
                    return None
        return cls(e, panels, pivots)

    @classmethod
    def of(
        cls, matrix: sp.sparray, similar: "SymmetricFactor | None" = None
    ) -> "SymmetricFactor | None":
        """Factor one symmetric matrix; return None if a pivot is zero or not finite.

        The order of elimination is that of a factor of a matrix with the same pattern, if one is given.
        """
        columns = sp.csc_array(matrix)
        columns.sort_indices()
        with one_blas_thread():
            elimination = analyze_pattern(columns) if similar is None else similar.elimination
            return cls.of_entries(elimination, columns.data)

    @property
    def n_negative(self) -> int:
        """Number of negative pivots, which is that of the negative eigenvalues of L D Lᵀ."""
        return int(np.count_nonzero(self.pivots < 0))

    def solve(self, right: ArrayLike, scratch: Scratch | None = None) -> Float[np.ndarray, "n *b"]:
        """Solve A x = right for one right-hand side or for columns, in given scratch memory or in new memory.

        Threads share eight right-hand sides; if there are more, each takes eight at a time.

        Raises an InvalidParameterError if `right` does not have n rows of real numbers.
        """
        right, n = np.asarray(right), len(self.pivots)
        if right.dtype.kind not in "biuf":
            raise InvalidParameterError(f"right must be real numbers; the type is {right.dtype}.")
        if right.ndim not in (1, 2) or len(right) != n:
            raise InvalidParameterError(
                f"right must have shape ({n},) or ({n}, b); its shape is {right.shape}."
            )
        if right.ndim == 1:
            return self.solve(right[:, None], scratch)[:, 0]
        solution = np.empty(right.shape)

        def solve_part(start: int, memory: Scratch) -> None:
            part = right[:, start : start + LANES]
            lanes = np.zeros((len(right), LANES))
            lanes[:, : part.shape[1]] = part
            self.solve_lanes(lanes, lanes, memory)
            solution[:, start : start + LANES] = lanes[:, : part.shape[1]]

        starts = range(0, right.shape[1], LANES)
        if len(starts) == 1:
            solve_part(0, scratch or self.scratch())
            return solution
        spare = SpareMemory(self.scratch)

        def solve_in_spare(start: int) -> None:
            with spare.lend() as memory:
                solve_part(start, memory)

        map_in_threads(solve_in_spare, starts)
        return solution

    def scratch(self) -> Scratch:
        """Return new scratch memory for solves.

        Callers that solve often keep it, but share it with no other caller: a factor is a value and
        holds no scratch memory.
        """
        tallest, n_rows = self.elimination.tallest, int(self.elimination.tasks.own_rows[-1])
        rooms = SpareMemory(lambda: np.empty((tallest, LANES)))
        return Scratch(np.empty((n_rows, LANES)), rooms)

    def solve_lanes(
        self, right: Float[np.ndarray, "n 8"], out: Float[np.ndarray, "n 8"], scratch: Scratch
    ) -> None:
        """Solve A x = right for eight right-hand sides at once; `out` may be `right` itself.

        Arrays are in C order.
        """
        e, lanes = self.elimination, scratch.lanes
        tree, tasks = (e.order, e.first, e.begins, e.places), e.tasks

        def solve_lower(*task: int) -> None:
            with scratch.rooms.lend() as gathered:
                given = tree, tasks.arrays, self.panels, right, lanes, gathered
                fronts.solve_lower(*given, *task)

        def solve_upper(*task: int) -> None:
            with scratch.rooms.lend() as gathered:
                given = tree, e.rows, tasks.first, self.panels, self.pivots, lanes, out, gathered
                fronts.solve_upper(*given, *task)

        if tasks.n == 1 or free_threads() == 1:
            solve_lower(0, tasks.n)
            solve_upper(0, tasks.n)
            return
        for each in tasks.rounds:
            map_in_threads(lambda task: solve_lower(task, task + 1), each.tolist())
        for each in reversed(tasks.rounds):
            map_in_threads(lambda task: solve_upper(task, task + 1), each.tolist())

    def rounding(self) -> Float[np.ndarray, " n"]:
        """Bound the rounding error E = A - L D Lᵀ by a diagonal: |xᵀEx| ≤ Σ r_i x_i². Return r.

        |E_ij| ≤ m eps (|L||D||L|ᵀ)_ij if each of the products that are summed up in an entry is
        rounded at most m times: once for every other term, in whatever order they are added, or
        fewer times since sums are split, as `Elimination.lengths` counts (Higham 2002, sections 4.2
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


@record
class FactorMemory:
    """Memory that is needed while a matrix is factored; factors of one pattern use it in turn.

    New memory pages cost half as much as a factorization.

    Attributes
    ----------
    rounds : list of list of int
        The tasks of a factor; those of one round may be done side by side.
    stacks : list of int
        Where the stack of updates of each task begins, in numbers.
    updates, rooms : SpareMemory
        All stacks, and what each thread needs.
    """

    rounds: list[list[int]]
    stacks: list[int]
    updates: SpareMemory[Updates]
    rooms: SpareMemory[Room]

    def release(self) -> None:
        """Give the memory back to the system; the next factor makes it anew."""
        self.updates.release()
        self.rooms.release()


def factor_memory(elimination: Elimination) -> FactorMemory:
    """Return memory for factors of a pattern; nothing is allocated before the first."""
    e = elimination
    n, tallest = len(e.order), e.tallest
    # One thread takes tasks in order, so that more of them can use the same memory in turn.
    serial = free_threads() == 1
    rounds = (
        [[task] for task in range(e.tasks.n)] if serial else [r.tolist() for r in e.tasks.rounds]
    )
    stacks, n_numbers = _place_stacks(e, rounds)
    latest = tallest * fronts.LONG + fronts.WIDE * LANES
    return FactorMemory(
        rounds=rounds,
        stacks=stacks,
        updates=SpareMemory(lambda: (np.empty(n_numbers), np.empty(len(e.above), dtype=np.int64))),
        rooms=SpareMemory(
            lambda: (
                np.empty(tallest**2),
                np.empty(latest),
                np.empty(n, dtype=np.int64),
                np.empty(tallest, dtype=np.int64),
            )
        ),
    )


def _place_stacks(e: Elimination, rounds: list[list[int]]) -> tuple[list[int], int]:
    """Return where the stacks of all tasks begin, each at the first free place, and where the last ends.

    A place is free again after the round in which the last update is taken from it.
    """
    sizes, begins, taken = e.stacks.tolist(), [0] * e.tasks.n, e.taken.tolist()
    round_of = {task: number for number, tasks in enumerate(rounds) for task in tasks}
    placed: list[int] = []
    for number, tasks in enumerate(rounds):
        placed = [task for task in placed if round_of[taken[task]] >= number]
        for task in tasks:
            for other in sorted(placed, key=begins.__getitem__):
                if begins[other] - begins[task] >= sizes[task]:
                    break
                begins[task] = max(begins[task], begins[other] + sizes[other])
            placed.append(task)
    return begins, max(begin + size for begin, size in zip(begins, sizes, strict=True))
