"""Many eigenvalues a slice at a time: spaces stay small, and so does the cost of keeping them orthogonal."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import ConvergenceError
from certeig.solver.factor import Factor
from certeig.solver.lanczos import Wanted, block_lanczos
from certeig.solver.pencil import Pencil
from certeig.solver.shift import factorize_near, shift_inside

Report = Callable[[float], None]

# Eigenvalues in a slice: with more the orthogonalization is slow, with fewer there are more
# factors.
SLICE = 250
# Eigenvalues found past the end of a slice, in whose widest gap it ends.
OVERLAP = 12
# Gap, relative to the last eigenvalue, across which two slices are orthogonal to rounding.
CLEAR_GAP = 1e-5
# Trial factors for the shift of a slice; any shift beyond the last one is correct, some are slow.
SLICE_TRIALS = 5
# Shares of a slice that may lie below its shift.
FAIR = (0.2, 0.9)


def walk(pencil: Pencil, k: int, report: Report) -> tuple[Float[np.ndarray, "n j"], Factor]:
    """Return the lowest k eigenvectors as far as they were seen, and the factor at the last shift.

    Raises a ConvergenceError if a slice does not converge, or has no gap to end in.
    """
    return walk_on(pencil, shift_inside(pencil, next_slice(k, 0)), 0, k, report)


def walk_on(
    pencil: Pencil, factor: Factor, known: int, k: int, report: Report
) -> tuple[Float[np.ndarray, "n j"], Factor]:
    """Return the eigenvectors from number `known` to k as far as they were seen, and the factor at the last shift.

    The first factor stands in the first slice. A slice ends in a clear gap. The next shift is
    placed by the spacing of the last eigenvalues found, and the count of its factor tells how many
    lie between. What a slice does not see, copies of a multiple eigenvalue beyond the width of its
    block, is left out.

    Raises a ConvergenceError if a slice does not converge, or has no gap to end in.
    """
    parts: list[Float[np.ndarray, "n j"]] = []
    begin, floor = known, -np.inf
    while True:
        target = next_slice(k, known)
        last = known + target >= k
        above = max(known + target - factor.count, 1 if not last else 0) + (0 if last else OVERLAP)
        wanted = Wanted(below=factor.count - known, above=above, floor=floor)
        none = np.empty((pencil.n, 0))
        start, share = (known - begin) / (k - begin), target / (k - begin)

        def within(done: float, start: float = start, share: float = share) -> None:
            report(start + share * done)

        values, vectors = block_lanczos(pencil, factor, wanted, locked=none, report=within)
        if last:
            return np.hstack([*parts, vectors]) if parts else vectors, factor
        kept, floor = _find_cut(values, factor.shift)
        parts.append(vectors[:, values < floor])
        known = factor.count + kept
        if known >= k:  # the overlap of this slice holds all that was left
            return np.hstack(parts), factor
        upper_half = np.sort(values[values < floor])[parts[-1].shape[1] // 2 :]
        spacing = (floor - float(upper_half[0])) / len(upper_half)
        factor = factor_beyond(pencil, floor, spacing, known, next_slice(k, known))


def next_slice(k: int, known: int) -> int:
    """Return the number of eigenvalues of the next slice, such that the remaining slices are equal."""
    remaining = k - known
    return -(-remaining // max(-(-remaining // SLICE), 1))


def _find_cut(values: Float[np.ndarray, " j"], shift: float) -> tuple[int, float]:
    """Return the number of eigenvalues above the shift that the slice keeps, and the middle of the gap at its end."""
    above = np.sort(values[values > shift])
    gaps = np.diff(above[-(OVERLAP + 1) :])
    widest = int(gaps.argmax()) if gaps.size else 0
    if not gaps.size or gaps[widest] < CLEAR_GAP * above[-1]:
        raise ConvergenceError(
            "A slice must end in a clear gap; there is none among the last eigenvalues found."
        )
    kept = len(above) - len(gaps) + widest
    return kept, float(above[kept - 1] + above[kept]) / 2


def factor_beyond(pencil: Pencil, floor: float, spacing: float, known: int, target: int) -> Factor:
    """Factor at a shift with about half of the next slice between `floor` and it.

    Raises a ConvergenceError if none is found beyond `floor`.
    """
    step = spacing * target / 2
    for _ in range(SLICE_TRIALS):
        factor = factorize_near(pencil, floor + step)
        between = factor.count - known
        if FAIR[0] * target <= between <= FAIR[1] * target:
            break
        step *= min(max(target / 2 / max(between, 0.5), 0.25), 4.0)
    if factor.shift <= floor or between < 0:
        raise ConvergenceError(
            f"The shift of a slice must lie beyond the one before; {between} eigenvalues lie between."
        )
    return factor
