"""Methods that find and certify the lowest pairs of a pencil: by parts, dense, with one shift, or in slices."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.linalg as sl

from certeig.certificate import Certificate
from certeig.kit.errors import ConvergenceError
from certeig.kit.memory import require_memory
from certeig.kit.progress import Progress
from certeig.solver.certify import prove, take_pairs
from certeig.solver.chebyshev import chebyshev_filter
from certeig.solver.complement import prove_outside, sparser_below
from certeig.solver.components import solve_parts
from certeig.solver.eigenpairs import Pairs, lowest_pairs, polish
from certeig.solver.lanczos import Wanted, block_lanczos, grow_space
from certeig.solver.pencil import Pencil
from certeig.solver.shift import factorize_near, shift_above, shift_inside
from certeig.solver.slices import walk
from certeig.sparse.basis_loops import LANES

Solve = Callable[[Pencil, int, Progress], tuple[Pairs, Certificate]]

# Points up to which a dense solve is faster than a sparse one.
DENSE_POINTS = 300
# A dense solve is also used if k is more than n / DENSE_SHARE,
DENSE_SHARE = 4
# and n is at most this: it takes 32 n² bytes, 1.1 GiB for 6,000 points.
DENSE_LIMIT = 6000
# Pairs up to which one shift is used; more are found slice by slice, because orthogonalization
# grows with the square of the pairs.
ONE_SHIFT_PAIRS = 400
# Entries a column of a factor from which on, as in solids of quadratic and cubic elements, another
# factor costs more than one more pair.
HEAVY_ENTRIES = 250
# Runs of block Lanczos before giving up. Each run finds at least one missing pair or is the last.
MOST_RUNS = 40
# Groups of eight columns in a block at most; wider blocks find more copies of an eigenvalue at
# once.
MOST_GROUPS = 8
# Vectors of a Lanczos space at least, for the estimate of memory.
FEWEST_VECTORS = 150
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


def solve_lowest(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    """Compute the k lowest pairs of a pencil and their certificate, by the fastest method that converges.

    Raises an InvalidParameterError if the memory is too small, and a ConvergenceError if no method
    converges.
    """
    if not pencil.labels.any():  # one connected part, whose label is 0
        return _solve_connected(pencil, k, report)

    # Each part is solved by itself, and one factor counts the eigenvalues of them all.
    require_memory_for_pairs(pencil, k)
    fallbacks: list[str] = []

    def solve(part: Pencil, count: int, report: Progress) -> Pairs:
        pairs, certificate = _solve_connected(part, count, report)
        fallbacks.extend(certificate.fallbacks)
        return pairs

    found = solve_parts(pencil, k, DENSE_POINTS, solve, report)
    report(0.9, "counting eigenvalues")
    pairs, certificate = _prove_complete(pencil, found)
    return pairs, replace(certificate, fallbacks=tuple(dict.fromkeys(fallbacks)))


def _solve_connected(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    if dense_serves(pencil, k):
        return _solve_dense(pencil, k, report)
    # Methods, the fastest first. If one does not converge, the next is tried, and the certificate names it.
    methods: list[tuple[str, Solve]] = []
    if is_filled(pencil) and pencil.mass_floor == 1.0 and k <= ONE_SHIFT_PAIRS:
        methods.append(("a filter", _solve_filtered))
    if k > ONE_SHIFT_PAIRS:
        methods.append(("slices", partial(_solve_sparse, in_slices=True)))
    methods.append(("one shift", partial(_solve_sparse, in_slices=False)))
    if pencil.n <= DENSE_LIMIT:
        methods.append(("a dense solve", _solve_dense))  # slow, but it always converges

    *first, (_, last) = methods
    fallbacks: list[str] = []
    for name, method in first:
        try:
            pairs, certificate = method(pencil, k, report)
        except ConvergenceError as error:
            fallbacks.append(f"{name}: {error}")
        else:
            return pairs, replace(certificate, fallbacks=tuple(fallbacks))
    pairs, certificate = last(pencil, k, report)
    return pairs, replace(certificate, fallbacks=tuple(fallbacks))


def is_filled(pencil: Pencil) -> bool:
    """Return whether W has so many entries that products with it are cheaper than its factors."""
    return pencil.stiffness.nnz >= FILTER_ENTRIES * pencil.n


def dense_serves(pencil: Pencil, k: int) -> bool:
    """Return whether a dense solve is faster than a sparse one for k pairs."""
    return pencil.n <= DENSE_POINTS or (DENSE_SHARE * k > pencil.n and pencil.n <= DENSE_LIMIT)


def _solve_dense(pencil: Pencil, k: int, report: Progress) -> tuple[Pairs, Certificate]:
    require_memory_for_pairs(pencil, k, 32 * pencil.n**2)
    report(0.1, f"solving {pencil.n} {pencil.advice.row}s densely")
    roots = np.sqrt(pencil.mass_diagonal)
    stiffness = pencil.stiffness.toarray() / np.outer(roots, roots)
    mass = None if pencil.mass_floor == 1.0 else pencil.mass.toarray() / np.outer(roots, roots)
    _, vectors = sl.eigh(stiffness, mass)
    pairs = lowest_pairs(pencil, vectors[:, :k] / roots[:, None], k)
    report(0.8, "counting eigenvalues")
    return _prove_complete(pencil, pairs)


def _prove_complete(pencil: Pencil, pairs: Pairs) -> tuple[Pairs, Certificate]:
    certificate = prove(pencil, pairs)
    if not certificate.complete:
        raise ConvergenceError(pencil.certificate_out(certificate).explain())
    return pairs, certificate


def _solve_sparse(
    pencil: Pencil, k: int, report: Progress, *, in_slices: bool
) -> tuple[Pairs, Certificate]:
    """Find the pairs by block Lanczos around one shift, or slice by slice, and what is missing by further runs."""
    require_memory_for_pairs(pencil, k)
    # Where factors are costly, all eigenvalues below a shift above the wanted ones are sought, which
    # its factor has counted; or else one pair more, so that the first count in the gap before it
    # serves.
    heavy = pencil.shift_pattern.elimination.n_entries > HEAVY_ENTRIES * pencil.n
    n_certified, n_sought = k, min(k + heavy, pencil.n)
    report(0.02, "looking for a shift")
    if in_slices:
        vectors, factor = walk(pencil, n_sought, _in_run(report, 0))
    else:
        factor = shift_above(pencil, k) if heavy else shift_inside(pencil, k)
        if heavy:
            n_certified = max(k, factor.count)
            n_sought = min(n_certified + 1, pencil.n)
        pencil.shift_pattern.memory.release()  # the Krylov space takes its place
        wanted = Wanted(below=factor.count, above=n_sought - factor.count)
        none = np.empty((pencil.n, 0))
        _, vectors = block_lanczos(pencil, factor, wanted, locked=none, report=_in_run(report, 0))

    for run in range(1, MOST_RUNS + 1):
        found = polish(pencil, factor, lowest_pairs(pencil, vectors, n_sought))
        pairs, following = found.select(slice(n_certified)), found.values[n_certified:]
        report(0.9, "counting eigenvalues")
        n_found, count_shift = len(pairs.values), np.inf
        missing = n_certified - n_found
        if missing == 0:
            certificate = prove(pencil, pairs, factor, following)
            if certificate.complete:
                if n_certified > k:
                    pairs, certificate = take_pairs(pencil, pairs, certificate, 0, k)
                return pairs, certificate
            count_shift = certificate.shift
            missing = min(max(certificate.n_missing, 0), n_certified)
        if missing == 0 or run == MOST_RUNS:
            break

        # Where they are: below the shift as many as its factor counted and were not found there.
        n_below = factor.count - int(np.count_nonzero(pairs.values < factor.shift))
        below = min(max(n_below, 0), missing)
        wanted = Wanted(below=below, above=missing - below, ceiling=count_shift)
        if n_found == n_certified:
            # `prove` made the factors of its count in the memory of this one, which saves much where
            # nothing is missing. So it cannot solve any more, and is made anew.
            factor = factorize_near(pencil, factor.shift)
        _, more = block_lanczos(
            pencil,
            factor,
            wanted,
            locked=pairs.vectors,
            groups=_groups_for(missing),
            report=_in_run(report, run),
        )
        if not more.shape[1]:
            break
        vectors = np.hstack([pairs.vectors, more])
    raise ConvergenceError(
        f"Every eigenvalue that inertia counts must be found; {len(pairs.values)} of {n_certified} were found in "
        f"{run} runs and {missing} are missing."
    )


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
    values = np.sort(space.values)
    below = factorize_near(sparser, float(values[k - 1] + COUNTED_PAST * values[n_sought - 1]))
    lowest = space.lowest(max(below.count, n_sought) + MORE_VECTORS)
    vectors, near = space.vectors(lowest), space.values[lowest]
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
        near = np.append(pairs.values, more.values[more.chosen])
    raise ConvergenceError(
        f"Every eigenvalue that is counted must be found; up to {missing} of {k} are missing."
    )


def _groups_for(missing: int) -> int:
    """Return the width of a block, in groups of eight columns, that finds so many copies at once."""
    return min(1 + -(-missing // LANES), MOST_GROUPS)


def _in_run(report: Progress, run: int) -> Callable[[float], None]:
    return lambda done: report(0.05 + 0.8 * done, f"run {run + 1} of block Lanczos")


def require_memory_for_pairs(pencil: Pencil, k: int, factors: int | None = None) -> None:
    """Raise an InvalidParameterError with the estimated sizes if the memory is too small for a solve of k pairs.

    `factors` are the bytes of the factors, by default estimated from the elimination order.
    """
    if factors is None:
        factors = 24 * pencil.shift_pattern.elimination.n_entries  # two at once, and their making
    bases = (
        8 * pencil.n * (3 * k + FEWEST_VECTORS + 2 * min(k, ONE_SHIFT_PAIRS))
    )  # a space of twice the pairs, results, a copy
    advice = pencil.advice.memory
    n_pieces = int(pencil.labels.max()) + 1
    if 2 * n_pieces > k:  # as in a soup of faces that share no vertices
        advice = pencil.advice.pieces.format(n=n_pieces)
    require_memory(
        "A spectrum",
        f"{k} pairs of {pencil.n} {pencil.advice.row}s",
        {"bases": bases, "factors of their operator": factors},
        advice,
    )
