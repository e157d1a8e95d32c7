"""Disconnected operators: each part is solved separately, small parts of equal size together."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from certeig.kit.progress import Progress, silent
from certeig.solver.eigenpairs import Pairs
from certeig.solver.pencil import Pencil, part_pencil
from certeig.solver.shift import expected_values, factor_below
from certeig.spectrum import ZERO_RESIDUALS

# Numbers in the blocks of small parts that are solved together: 32 MiB.
BLOCK_NUMBERS = 2**22
# Relative difference of eigenvalues of congruent parts whose coordinates are rounded.
CONGRUENT = 1e-12
# A large part is solved for this many times the pairs that Weyl's law expects of it,
MORE_THAN_EXPECTED = 1.1
# plus these: a few pairs too many are cheaper than a second solve.
EXTRA_PAIRS = 2

SolvePart = Callable[[Pencil, int, Progress], Pairs]


@record
class Parts:
    """The connected parts of a pencil, small ones first; parts of one size in the order of their first points.

    Attributes
    ----------
    pencil : Pencil
        The whole pencil.
    order : (n,) int
        The points, part by part, ascending within each part.
    starts : (c + 1,) int
        Where the points of each part begin in `order`, with n at the end.
    """

    pencil: Pencil
    order: Int[np.ndarray, " n"]
    starts: Int[np.ndarray, " c1"]

    @property
    def sizes(self) -> Int[np.ndarray, " c"]:
        """Number of points of each part, ascending."""
        return np.diff(self.starts)

    @cached_property
    def block_diagonal(self) -> tuple[sp.csc_array, sp.csc_array]:
        """W and B with the points in the order of `order`: each part is one diagonal block."""
        stiffness, mass = (
            sp.csc_array(matrix[self.order][:, self.order])
            for matrix in (self.pencil.stiffness, self.pencil.mass)
        )
        return stiffness, mass

    def points(self, part: int) -> Int[np.ndarray, " s"]:
        """Return the points of a part."""
        return self.order[self.starts[part] : self.starts[part + 1]]

    def only(self, part: int) -> Pencil:
        """Return the pencil of one part."""
        inside = slice(int(self.starts[part]), int(self.starts[part + 1]))
        stiffness, mass = self.block_diagonal
        return part_pencil(self.pencil, stiffness[inside, inside], mass[inside, inside])

    def exponent(self, part: Pencil) -> int:
        """Return the power of two that converts eigenvalues of a part to units of the whole."""
        return part.value_exponent - self.pencil.value_exponent


def solve_parts(
    pencil: Pencil, k: int, largest_small: int, solve: SolvePart, report: Progress
) -> Pairs:
    """Return the k lowest pairs of a disconnected pencil, each connected part solved separately.

    A Krylov space of all parts finds few copies of an eigenvalue at a time, and 0 has as many
    copies as there are parts. Small parts are solved densely. From a large part as many pairs are
    requested as Weyl's law expects, and more until its last eigenvalue is not below the k-th of all
    parts: then none of its other eigenvalues is among the k lowest.
    """
    parts = connected_parts(pencil)
    n_parts = len(parts.sizes)
    report(0.02, f"solving {n_parts} parts")
    found = dict(enumerate(solve_small(parts, largest_small, k)))
    large = {number: parts.only(number) for number in range(len(found), n_parts)}
    # How many of the k lowest pairs each large part is expected to have, with a margin
    expected = {}
    for number, part in large.items():
        values = expected_values(part, np.arange(min(k, part.n), dtype=float))
        expected[number] = np.ldexp(values, parts.exponent(part))
    known = np.concatenate([*expected.values(), *(pairs.values for pairs in found.values())])
    last = np.partition(known, k - 1)[k - 1]
    wanted = {}
    for number, values in expected.items():
        count = int(MORE_THAN_EXPECTED * int(np.count_nonzero(values <= last))) + EXTRA_PAIRS
        wanted[number] = min(count, k, large[number].n)
    while wanted:
        for number, count in wanted.items():
            part = large[number]
            pairs = solve(part, count, _share(report, parts, number))
            values, residuals = np.ldexp([pairs.values, pairs.residuals], parts.exponent(part))
            up = part.vector_exponent - pencil.vector_exponent
            found[number] = Pairs(values, np.ldexp(pairs.vectors, up), residuals)
        wanted = _missing_counts(parts, large, found, k)
        report = silent  # the fraction done has reached its end once
    return merge_pairs(parts, [found[number] for number in range(n_parts)], k)


def connected_parts(pencil: Pencil) -> Parts:
    """Find the connected parts of W and B together."""
    sizes = np.bincount(pencil.labels)
    order = np.lexsort((pencil.labels, sizes[pencil.labels]))
    return Parts(pencil, order, np.concatenate([[0], np.cumsum(np.sort(sizes))]))


def solve_small(parts: Parts, largest: int, k: int) -> list[Pairs]:
    """Solve the small parts densely, all of one size at once.

    Returns the pairs of each part that may be among the k lowest of all. Vectors are on the points
    of the part.
    """
    found: list[Pairs] = []
    known = np.empty(0)
    sizes, counts = np.unique(parts.sizes[parts.sizes <= largest], return_counts=True)
    for size, count in zip(sizes.tolist(), counts.tolist(), strict=True):
        n_chunks = -(-count * size**2 // BLOCK_NUMBERS)
        for chunk in np.array_split(np.arange(count) + len(found), n_chunks):
            values, vectors, residuals = _solve_blocks(parts, int(chunk[0]), len(chunk))
            known = np.concatenate([known, values.ravel()])
            if len(known) > k:
                known = np.partition(known, k - 1)[:k]
            ceiling = known.max() if len(known) == k else np.inf
            n_kept = np.count_nonzero(values - widths(values, residuals) <= ceiling, axis=1)
            for i, n in enumerate(n_kept.tolist()):
                found.append(
                    Pairs(values[i, :n].copy(), vectors[i, :, :n].copy(), residuals[i, :n].copy())
                )
    return found


def _missing_counts(
    parts: Parts, large: dict[int, Pencil], found: dict[int, Pairs], k: int
) -> dict[int, int]:
    """Return how many pairs to request from the parts whose pairs end below the k-th eigenvalue of all parts."""
    known = np.concatenate([pairs.values for pairs in found.values()])
    residuals = np.concatenate([pairs.residuals for pairs in found.values()])
    last = float(np.partition(known + widths(known, residuals), k - 1)[k - 1])
    counts = {}
    for number, pencil in large.items():
        n_found = len(found[number].values)
        if n_found < min(k, pencil.n) and found[number].values[-1] < last:
            n_below = factor_below(pencil, float(np.ldexp(last, -parts.exponent(pencil)))).count
            counts[number] = min(max(n_below, n_found) + EXTRA_PAIRS, k, pencil.n)
    return counts


def _share(report: Progress, parts: Parts, number: int) -> Progress:
    """Return a progress function for one part, as a share of all points."""
    begin, end = (parts.starts[number : number + 2] / parts.pencil.n).tolist()
    label = f"part {number + 1} of {len(parts.sizes)}"
    return lambda done, message: report(
        0.05 + 0.85 * (begin + done * (end - begin)), f"{label}: {message}"
    )


def _solve_blocks(
    parts: Parts, first: int, count: int
) -> tuple[Float[np.ndarray, "c s"], Float[np.ndarray, "c s s"], Float[np.ndarray, "c s"]]:
    """Return all eigenpairs of consecutive parts of one size, and their residuals."""
    size = int(parts.sizes[first])
    inside = slice(int(parts.starts[first]), int(parts.starts[first]) + count * size)
    stiffness, mass = np.zeros((2, count, size, size))
    for blocks, matrix in zip((stiffness, mass), parts.block_diagonal, strict=True):
        entries = matrix[inside, inside].tocoo()
        blocks[entries.row // size, entries.row % size, entries.col % size] = entries.data
    diagonal = parts.pencil.mass_diagonal[parts.order[inside]].reshape(count, size, 1)
    if parts.pencil.mass_floor == 1.0:
        roots = np.sqrt(diagonal)
        values, vectors = np.linalg.eigh(stiffness / roots / roots.transpose(0, 2, 1))
        vectors /= roots
    else:
        inverse = np.linalg.inv(np.linalg.cholesky(mass))
        values, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.transpose(0, 2, 1))
        vectors = inverse.transpose(0, 2, 1) @ vectors
    rests = stiffness @ vectors - mass @ vectors * values[:, None, :]
    squares = np.square(rests) / diagonal / parts.pencil.mass_floor  # as in `Pencil.residual_norms`
    return values, vectors, np.sqrt(squares.sum(axis=1))


def widths(
    values: Float[np.ndarray, "*k"], residuals: Float[np.ndarray, "*k"]
) -> Float[np.ndarray, "*k"]:
    """Return, for each value, the largest distance of another that counts as equal to it."""
    return ZERO_RESIDUALS * residuals + CONGRUENT * np.abs(values)


def merge_pairs(parts: Parts, found: list[Pairs], k: int) -> Pairs:
    """Return the k lowest of all eigenpairs of all parts; each vector is zero outside its part.

    Values that differ only by rounding count as equal. They are in the order of the first points of
    their parts, whatever their last digits, and are raised to the largest value before them, so
    that all ascend. Values that cannot be distinguished from 0 are set to 0.
    """
    counts = np.array([len(pairs.values) for pairs in found])
    part = np.repeat(np.arange(len(found)), counts)
    column = np.arange(len(part)) - np.repeat(np.cumsum(counts) - counts, counts)
    values = np.concatenate([pairs.values for pairs in found])
    width = widths(values, np.concatenate([pairs.residuals for pairs in found]))
    values = np.where(np.abs(values) <= width, 0.0, values)
    ascending = np.argsort(values, kind="stable")
    steps = np.diff(values[ascending])
    apart = steps > width[ascending][1:] + width[ascending][:-1]
    group = np.empty(len(values), dtype=np.int64)
    group[ascending] = np.concatenate([[0], np.cumsum(apart)])
    lowest = np.lexsort((column, parts.order[parts.starts[part]], group))[:k]
    merged = np.maximum.accumulate(values[lowest])
    vectors = np.zeros((parts.pencil.n, k))
    for number in np.unique(part[lowest]).tolist():
        places = np.flatnonzero(part[lowest] == number)
        vectors[np.ix_(parts.points(number), places)] = found[number].vectors[
            :, column[lowest[places]]
        ]
    return Pairs(merged, vectors, parts.pencil.residual_norms(merged, vectors))
