"""Methods that find and certify the lowest pairs of a pencil: by parts, dense, with one shift, or in slices."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from eigenshape._errors import ConvergenceError
from eigenshape._memory import require_memory
from eigenshape._progress import Progress, silent
from eigenshape.sparse.lane_loops import LANES
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.solver.certify import in_user_units, prove, take_pairs
from eigenshape.spectral.solver.complement import prove_outside, sparser_below
from eigenshape.spectral.solver.components import (
    Parts,
    connected_parts,
    merge_pairs,
    solve_small,
    widths,
)
from eigenshape.spectral.solver.factor import Factor
from eigenshape.spectral.solver.filters import chebyshev_filter
from eigenshape.spectral.solver.lanczos import Wanted, block_lanczos, grow_space
from eigenshape.spectral.solver.pairs import Pairs, lowest_pairs, polish
from eigenshape.spectral.solver.pencil import Pencil
from eigenshape.spectral.solver.shift import (
    expected_values,
    factor_below,
    factorize_near,
    shift_inside,
)
from eigenshape.spectral.solver.slices import walk

Start = Callable[[Pencil, int, Callable[[float], None]], tuple[np.ndarray, Factor]]
Solve = Callable[[Pencil, int, Progress], tuple[Pairs, Certificate]]

# Points up to which a dense solve is faster than a sparse one.
DENSE_POINTS = 300
# Entries a row from which products of W are used in place of a factor (measured),
FILTER_ENTRIES = 100
# in a filter that damps what lies above about 1.9 times as many eigenvalues as are wanted of a
# sparser operator below W, which has more of them.
DAMPED_FROM = 4
# Runs before the method with factors of the operator itself takes over.
FILTER_RUNS = 4
# Pairs beyond the wanted ones, among which the cluster of the last should end.
BEYOND = 8
# Vectors of that proof beyond as many as the sparser operator has eigenvalues below γ,
MORE_VECTORS = 16
# and how far γ is past the last wanted eigenvalue, relative to the last that was sought.
COUNTED_PAST = 1e-3
# A dense solve is also used if k is more than n / DENSE_SHARE,
DENSE_SHARE = 4
# and n is at most this: it takes 32 n² bytes, 1.1 GiB for 6,000 points.
DENSE_LIMIT = 6000
# Pairs up to which one shift is used; more are found slice by slice, because orthogonalization
# grows with the square of the pairs.
ONE_SHIFT_PAIRS = 400
# Vectors of a Lanczos space at least, for the estimate of memory.
FEWEST_VECTORS = 150
# Groups of eight columns in a block at most; wider blocks find more copies of an eigenvalue at
# once.
MOST_GROUPS = 8
# Runs of block Lanczos before giving up. Each run finds at least one missing pair or is the last.
MOST_RUNS = 40
# A part is solved for this many times the pairs that Weyl's law expects of it,
PART_MARGIN = 1.1
# plus these: a few pairs too many are cheaper than a second solve.
EXTRA_PAIRS = 2


def solve_lowest(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    """Compute the k lowest pairs of a pencil and their certificate, by the fastest method that converges.

    Raises
    ------
    InvalidParameterError
        If the memory is too small.
    ConvergenceError
        If no method converges.
    """
    if pencil.labels.any():
        return _solve_parts(connected_parts(pencil), k, report)
    return _solve_connected(pencil, k, report)


def _solve_connected(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    if dense_serves(pencil, k):
        return _solve_dense(pencil, k, report)
    methods: list[Solve] = []
    if filter_serves(pencil, k):
        methods.append(_solve_filtered)
    if k > ONE_SHIFT_PAIRS:
        methods.append(partial(_solve_sparse, start=walk))
    methods.append(partial(_solve_sparse, start=_at_once))
    if pencil.n <= DENSE_LIMIT:
        methods.append(_solve_dense)  # slow, but it always converges
    for method in methods[:-1]:
        with suppress(ConvergenceError):
            return method(pencil, k, report)
    return methods[-1](pencil, k, report)


def dense_serves(pencil: Pencil, k: int) -> bool:
    """Return whether a dense solve is faster than a sparse one for k pairs."""
    return pencil.n <= DENSE_POINTS or (DENSE_SHARE * k > pencil.n and pencil.n <= DENSE_LIMIT)


def _solve_dense(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    require_memory_for_pairs(pencil, k, 32 * pencil.n**2)
    report(0.1, f"solving {pencil.n} points densely")
    roots = np.sqrt(pencil.mass_diagonal)
    stiffness = pencil.stiffness.toarray() / np.outer(roots, roots)
    mass = None if pencil.mass_floor == 1.0 else pencil.mass.toarray() / np.outer(roots, roots)
    _, vectors = sl.eigh(stiffness, mass)
    pairs = lowest_pairs(pencil, vectors[:, :k] / roots[:, None], k)
    report(0.8, "counting eigenvalues")
    return _complete(pencil, pairs)


def _solve_parts(parts: Parts, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    """Solve each connected part separately, and certify the merged pairs as a whole.

    A Krylov space of all parts finds few copies of an eigenvalue at a time, and 0 has as many
    copies as there are parts. From a large part as many pairs are requested as Weyl's law expects,
    and more until its last eigenvalue is not below the k-th of all parts: then none of its other
    eigenvalues is among the k lowest.
    """
    require_memory_for_pairs(parts.pencil, k)
    report(0.02, f"solving {len(parts.sizes)} parts")
    found = dict(enumerate(solve_small(parts, DENSE_POINTS, k)))
    large = {number: parts.only(number) for number in range(len(found), len(parts.sizes))}
    wanted = _expected_counts(parts, large, found, k)
    progress = report
    while wanted:
        for number, count in wanted.items():
            found[number] = _solve_part(
                parts, large[number], count, _share(progress, parts, number)
            )
        wanted = _missing_counts(parts, large, found, k)
        progress = silent  # the fraction done has reached its end once
    report(0.9, "counting eigenvalues")
    return _complete(
        parts.pencil, merge_pairs(parts, [found[number] for number in range(len(found))], k)
    )


def _expected_counts(
    parts: Parts, large: dict[int, Pencil], found: dict[int, Pairs], k: int
) -> dict[int, int]:
    """Return how many of the k lowest pairs each large part is expected to have, with a margin."""
    expected = {}
    for number, pencil in large.items():
        values = expected_values(pencil, np.arange(min(k, pencil.n), dtype=float))
        expected[number] = np.ldexp(values, parts.exponent(pencil))
    known = np.concatenate([*expected.values(), *(pairs.values for pairs in found.values())])
    last = np.partition(known, k - 1)[k - 1]
    counts = {number: int(np.count_nonzero(values <= last)) for number, values in expected.items()}
    return {
        number: min(int(PART_MARGIN * count) + EXTRA_PAIRS, k, large[number].n)
        for number, count in counts.items()
    }


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


def _solve_part(parts: Parts, pencil: Pencil, k: int, report: Progress) -> Pairs:
    pairs, _ = _solve_connected(pencil, k, report)
    up = pencil.vector_exponent - parts.pencil.vector_exponent
    values, residuals = np.ldexp([pairs.values, pairs.residuals], parts.exponent(pencil))
    return Pairs(values, np.ldexp(pairs.vectors, up), residuals)


def _complete(pencil: Pencil, pairs: Pairs) -> tuple[Pairs, Certificate]:
    certificate = prove(pencil, pairs)
    if not certificate.complete:
        raise ConvergenceError(in_user_units(pencil, certificate).explain())
    return pairs, certificate


def _solve_sparse(
    pencil: Pencil, k: int, report: Progress, *, start: Start
) -> tuple[Pairs, Certificate]:
    require_memory_for_pairs(pencil, k)
    report(0.02, "looking for a shift")
    vectors, factor = start(pencil, k, _in_run(report, 0))
    for run in range(1, MOST_RUNS + 1):
        pairs = polish(pencil, factor, lowest_pairs(pencil, vectors, k))
        report(0.9, "counting eigenvalues")
        certificate, wanted = _remaining(pencil, factor, pairs, k)
        missing = wanted.below + wanted.above
        if certificate is not None and certificate.complete:
            return pairs, certificate
        if missing == 0 or run == MOST_RUNS:
            break
        if certificate is not None:
            # The count has spent the factor, which saves much memory where nothing is missing.
            factor = factorize_near(pencil, factor.shift)
        _, found = block_lanczos(
            pencil,
            factor,
            wanted,
            locked=pairs.vectors,
            groups=_groups_for(missing),
            report=_in_run(report, run),
        )
        if not found.shape[1]:
            break
        vectors = np.hstack([pairs.vectors, found])
    raise ConvergenceError(
        f"Every eigenvalue that inertia counts must be found; {len(pairs.values)} of {k} were found in {run} runs "
        f"and {missing} are missing."
    )


def require_memory_for_pairs(pencil: Pencil, k: int, factors: int | None = None) -> None:
    """Raise an error if the memory is too small for a solve of k pairs.

    Parameters
    ----------
    pencil : Pencil
    k : int
    factors : int, optional
        Bytes of the factors; by default estimated from the elimination order.

    Raises
    ------
    InvalidParameterError
        With the estimated sizes.
    """
    if factors is None:
        factors = 24 * pencil.shift_pattern.elimination.n_entries  # two at once, and their making
    bases = (
        8 * pencil.n * (3 * k + FEWEST_VECTORS + 2 * min(k, ONE_SHIFT_PAIRS))
    )  # a space of twice the pairs, results, a copy
    advice = "Request fewer pairs, or pass method='approximate' to solve_spectrum, which needs no factor."
    require_memory(
        "A spectrum",
        f"{k} pairs of {pencil.n} points",
        {"bases": bases, "factors of their operator": factors},
        advice,
    )


def _at_once(
    pencil: Pencil, k: int, report: Callable[[float], None]
) -> tuple[Float[np.ndarray, "n j"], Factor]:
    factor = shift_inside(pencil, k)
    wanted = Wanted(below=factor.count, above=k - factor.count)
    return block_lanczos(pencil, factor, wanted, locked=np.empty((pencil.n, 0)), report=report)[
        1
    ], factor


def _groups_for(missing: int) -> int:
    """Return the width of a block, in groups of eight columns, that finds so many copies at once."""
    return min(1 + -(-missing // LANES), MOST_GROUPS)


def _in_run(report: Progress, run: int) -> Callable[[float], None]:
    return lambda done: report(0.05 + 0.8 * done, f"run {run + 1} of block Lanczos")


def filter_serves(pencil: Pencil, k: int) -> bool:
    """Return whether products are so much cheaper than factors that a filter replaces the inverse."""
    entries = pencil.stiffness.nnz / pencil.n
    return pencil.mass_floor == 1.0 and entries >= FILTER_ENTRIES and k <= ONE_SHIFT_PAIRS


def _solve_filtered(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    """Find the pairs with products of W alone, and prove them complete with factors of a sparser operator."""
    report(0.02, "looking for a filter")
    sparser = sparser_below(pencil)
    analysis = sparser.shift_pattern.elimination
    require_memory_for_pairs(pencil, k, 24 * (analysis.n_entries + pencil.stiffness.nnz))
    n_sought = min(k + BEYOND, pencil.n)
    low = shift_inside(sparser, DAMPED_FROM * n_sought).shift
    inner = chebyshev_filter(pencil, analysis.order, low)
    wanted = Wanted(below=0, above=n_sought)
    none = np.empty((pencil.n, 0))
    space = grow_space(inner, wanted, locked=none, report=_in_run(report, 0))
    report(0.85, "counting eigenvalues")
    values = np.sort(space.ritz.values)
    below = factorize_near(sparser, float(values[k - 1] + COUNTED_PAST * values[n_sought - 1]))
    lowest = space.lowest(max(below.count, n_sought) + MORE_VECTORS)
    vectors, near = space.vectors(lowest), space.ritz.values[lowest]
    del space  # and its memory
    for run in range(1, FILTER_RUNS):
        pairs = lowest_pairs(pencil, vectors, vectors.shape[1], near)
        found, certificate = prove_outside(pencil, pairs, k, below)
        missing = certificate.n_missing
        if not missing:
            return take_pairs(pencil, found, certificate, 0, k)
        if missing > MOST_GROUPS * LANES:
            break
        more = grow_space(
            inner,
            Wanted(below=0, above=missing),
            locked=pairs.vectors,
            groups=_groups_for(missing),
            report=_in_run(report, run),
        )
        vectors = np.hstack([pairs.vectors, more.vectors(more.chosen)])
        near = np.append(pairs.values, more.ritz.values[more.chosen])
    raise ConvergenceError(
        f"Every eigenvalue that is counted must be found; up to {missing} of {k} are missing."
    )


def _remaining(
    pencil: Pencil, factor: Factor, pairs: Pairs, k: int
) -> tuple[Certificate | None, Wanted]:
    """Return the certificate, complete or not, and what the next run has to find; a count spends the factor."""
    certificate = prove(pencil, pairs, factor) if len(pairs.values) == k else None
    missing = certificate.n_missing if certificate else k - len(pairs.values)
    missing = min(max(missing, 0), k)
    ceiling = certificate.shift if certificate else np.inf
    below = min(max(factor.count - int(np.count_nonzero(pairs.values < factor.shift)), 0), missing)
    return certificate, Wanted(below=below, above=missing - below, ceiling=ceiling)
