"""What must hold for the two matrices of a Laplace operator, and how well it does."""

from collections.abc import Callable, Iterable

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from scipy.sparse.csgraph import connected_components

from certeig.kit.arguments import require_type
from certeig.kit.arrays import TINY
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import ASYMMETRY
from certeig.kit.threads import one_blas_thread
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.laws.agreement import sizes_of
from eigenshape.spectral.laws.outcomes import (
    DEFAULT_PROMISES,
    Law,
    OperatorReport,
    Outcome,
    Promise,
    SkippedLaw,
    check_promises,
    make_law,
    make_report,
)
from eigenshape.spectral.laws.transformations import Subject, as_subject
from eigenshape.spectral.pencils import normalize

ROW_SUM = 1e-11  # of the largest √(W_ii W_jj) in the row
WEIGHT = 1e-11  # of √(W_ii W_jj): weights that are 0 in exact arithmetic come out on either side
# Entry between two components, relative to √(W_ii W_jj), that counts as rounding.
LINK = 1e-14
# Relative difference of the sum of B and the volume that counts as rounding.
VOLUME = 1e-11
NEGATIVE = 1e-9  # of trace W / trace B
# Shifts in trace W / trace B, from what rounding leaves of a zero upwards.
LADDER = 10.0 ** np.arange(-12, 4)
FIRST_LINE = 1e-14  # in the same unit: between zero and not zero
# Largest line between zero and positive eigenvalues, in the same unit: rounding, or constants with
# energy, may move it up to here.
LARGEST_ZERO = 1e-6
# Multiples of a shift that are tried if a pivot is exactly zero.
COUNT_NUDGES = (1.0, 1.07, 0.93, 1.15)


@one_blas_thread()
def check_laplacian(
    laplacian: Laplacian,
    shape: ShapeLike | sp.sparray | None = None,
    *,
    promises: Iterable[Promise] = DEFAULT_PROMISES,
) -> OperatorReport:
    """Check the laws that the two matrices of a Laplace operator must obey.

    Symmetry of W and B, B positive definite and W positive semidefinite are always checked, other
    laws if they are promised. Signs of eigenvalues are counted by Sylvester's law of inertia
    (Parlett 1998, section 3.3), at any size: a factor of W + δB without negative pivots shows that
    no eigenvalue is below -δ.

    Parameters
    ----------
    laplacian : Laplacian
    shape : ShapeLike or (n, n) sparse, optional
        The shape on which the operator was built; "volume" and "components" need a mesh.
    promises : iterable of str
        "constants": row sums are zero, and as many eigenvalues are zero as the graph of W has
        components. "components": no entry of W or B joins two components of the shape, and W has as
        many. "definite": no eigenvalue is zero, instead of "constants" if points are fixed.
        "volume": the entries of B sum to the volume. "nonnegative_weights": w_ij = -W_ij ≥ 0. The
        other promises are for `check_operator`.

    Returns
    -------
    OperatorReport

    Raises
    ------
    InvalidParameterError
        If a promise is unknown.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(1)
    >>> report = es.spectral.check_laplacian(es.cotangent_laplacian(ball), ball)
    >>> report.passed
    True
    """
    require_type(laplacian, Laplacian, "laplacian")
    promised, subject = check_promises(promises), None if shape is None else as_subject(shape)
    symmetry = [
        _symmetry("symmetry of W", laplacian.stiffness),
        _symmetry("symmetry of B", laplacian.mass),
    ]
    if not all(law.holds for law in symmetry):
        # Factors take the symmetry for granted. Check the other laws on the symmetric parts.
        halves = ((matrix + matrix.T) / 2 for matrix in (laplacian.stiffness, laplacian.mass))
        laplacian = Laplacian(*halves)
    mass, pencil = _mass(laplacian)
    optional: dict[Promise, Callable[[], list[Outcome]]] = {
        "constants": lambda: [_row_sums(laplacian), _kernel(laplacian, pencil)],
        "components": lambda: [_components(laplacian, subject)],
        "definite": lambda: [_definite(pencil)],
        "volume": lambda: [_volume(laplacian, subject)],
        "nonnegative_weights": lambda: [_weights(laplacian)],
    }
    found: list[Outcome] = [
        *symmetry,
        mass,
        _semidefinite(pencil),
    ]
    for name, laws in optional.items():
        found += (
            laws() if name in promised else [SkippedLaw(name.replace("_", " "), "not promised")]
        )
    return make_report(found)


def _symmetry(name: str, matrix: sp.csr_array) -> Law:
    off = abs(matrix - matrix.T).tocoo()
    largest = float(np.abs(matrix.data).max(initial=0.0)) or 1.0
    worst = float(off.data.max(initial=0.0)) / largest
    return make_law(
        name,
        worst,
        ASYMMETRY,
        f"entries (i, j) and (j, i) differ by at most {worst:.1e} of the largest.",
    )


def _mass(laplacian: Laplacian) -> tuple[Law, Pencil]:
    """Prove B ≥ c diag(B) with c > 0; where that fails, the other laws are judged with diag(B) for B."""
    name = "positive mass"
    try:
        pencil = normalize(laplacian)
    except InvalidParameterError as err:
        diagonal = sp.diags_array(laplacian.mass.diagonal()).tocsr()
        return Law(name, False, 1.0, 0.0, str(err)), normalize(
            Laplacian(laplacian.stiffness, diagonal)
        )
    floor = pencil.mass_floor
    return Law(
        name, True, 0.0, 0.0, f"B is positive definite: it is at least {floor:.3g} of its diagonal."
    ), pencil


def _factor(pencil: Pencil, share: float) -> Factor | None:
    """Factor at a share of trace W / trace B, or within a few per cent of it where a pivot is exactly zero."""
    tries = (Factor.at(pencil, nudge * share * pencil.level) for nudge in COUNT_NUDGES)
    return next((factor for factor in tries if factor), None)


def _count(pencil: Pencil, share: float) -> int | None:
    """Count the eigenvalues below a share of trace W / trace B."""
    factor = _factor(pencil, share)
    return factor.count if factor else None


def _semidefinite(pencil: Pencil) -> Law:
    name = "positive semidefinite"
    for share in LADDER.tolist():
        factor = _factor(pencil, -share)
        if factor and factor.count == 0:
            loss = float((factor.rounding() / pencil.mass_diagonal).max()) / pencil.mass_floor
            proved = float(pencil.values_out(np.array([-factor.shift + loss]))[0])
            explanation = f"W + {share:.0e} (trace W / trace B) B has no negative pivot"
            if share > LADDER[0]:
                explanation = f"{explanation}, and some with {share / 10:.0e}"
            explanation = (
                f"{explanation}: rounding included, no eigenvalue lies below {-proved:.1e}."
            )
            return make_law(name, share, NEGATIVE, explanation)
    explanation = f"eigenvalues lie below -{LADDER[-1]:.0e} trace W / trace B."
    return make_law(name, np.inf, NEGATIVE, explanation)


def _row_sums(laplacian: Laplacian) -> Law:
    W = laplacian.stiffness
    sums, roots = W.sum(axis=1), sizes_of(W)
    rows = np.repeat(np.arange(W.shape[0]), np.diff(W.indptr))
    largest = roots.copy()
    np.maximum.at(largest, rows, roots[W.indices])
    relative = np.abs(sums) / np.maximum(roots * largest, TINY)
    worst = int(relative.argmax())
    explanation = (
        f"the largest sum of a row is that of row {worst}, {sums[worst]:.3g} where W_ii is "
        f"{W[worst, worst]:.3g}."
    )
    return make_law("row sums", relative[worst], ROW_SUM, explanation)


def _kernel(laplacian: Laplacian, pencil: Pencil) -> Law:
    """Count the eigenvalues on either side of zero: a zero for each component, and no other.

    The energy of each component's indicator bounds that many eigenvalues from above
    (Courant-Fischer). So this law finds zeros that are too many; those too few are found by the row
    sums.
    """
    n_parts, labels = _graph_parts(laplacian.stiffness)
    energies = np.abs(np.bincount(labels, weights=pencil.stiffness.sum(axis=1)))
    masses = np.bincount(labels, weights=pencil.mass.sum(axis=1))
    energy = float((energies / np.maximum(np.abs(masses), TINY)).max()) / pencil.level
    line = min(max(FIRST_LINE, 4 * energy), LARGEST_ZERO)
    while True:
        below, negative = _count(pencil, line), _count(pencil, -line)
        zeros = 0 if below is None or negative is None else below - negative
        if zeros >= n_parts or line >= LARGEST_ZERO:
            break
        # What rounding makes of a zero may lie farther out; a larger interval holds no fewer.
        line *= 10
    explanation = (
        f"within {line:.0e} trace W / trace B of zero lie {zeros} of the eigenvalues; "
        f"components of W: {n_parts}."
    )
    return make_law("kernel", abs(zeros - n_parts), 0, explanation)


def _graph_parts(matrix: sp.csr_array) -> tuple[int, Int[np.ndarray, " n"]]:
    linked = matrix.copy()
    linked.eliminate_zeros()
    count, labels = connected_components(linked, directed=False)
    return int(count), labels.astype(np.int64)


def _components(laplacian: Laplacian, shape: Subject | None) -> Outcome:
    if shape is None or isinstance(shape, PointCloud):
        return SkippedLaw("components", "no mesh or graph says what belongs together")
    n_parts, labels = (
        _graph_parts(shape) if isinstance(shape, sp.csr_array) else vertex_components(shape)
    )
    if len(labels) != laplacian.n_points:
        found, _ = _graph_parts(laplacian.stiffness)
        explanation = f"the shape has {n_parts}, and W has {found}."
        return make_law("components", abs(found - n_parts), 0, explanation)
    largest, explanation = 0.0, "no entry of W or B joins two of them."
    for name, matrix in (("W", laplacian.stiffness), ("B", laplacian.mass)):
        entries, roots = matrix.tocoo(), sizes_of(matrix)
        scaled = np.abs(entries.data) / (roots[entries.row] * roots[entries.col])
        scaled[labels[entries.row] == labels[entries.col]] = 0.0
        if scaled.max(initial=0.0) > largest:
            worst = int(scaled.argmax())
            largest = float(scaled[worst])
            place = int(entries.row[worst]), int(entries.col[worst])
            explanation = f"entry {place} of {name} joins two of them: it is {largest:.1e} of √({name}_ii {name}_jj)."
    return make_law("components", largest, LINK, f"the shape has {n_parts}; {explanation}")


def _definite(pencil: Pencil) -> Law:
    share = float(LADDER[0])
    count = _count(pencil, share)
    if count is None:
        return make_law(
            "definite", np.inf, 0, "no factor near zero has its pivots on the diagonal."
        )
    return make_law(
        "definite", count, 0, f"below {share:.0e} trace W / trace B lie {count} of the eigenvalues."
    )


def _volume(laplacian: Laplacian, shape: Subject | None) -> Outcome:
    if shape is None or isinstance(shape, PointCloud | sp.csr_array):
        return SkippedLaw("volume", "only a mesh has one to compare with")
    volume, total = float(simplex_volumes(shape).sum()), float(laplacian.mass.sum())
    explanation = f"the entries of B sum to {total:.12g}, and the shape has volume {volume:.12g}."
    return make_law("volume", abs(total / volume - 1), VOLUME, explanation)


def _weights(laplacian: Laplacian) -> Law:
    entries, roots = laplacian.stiffness.tocoo(), sizes_of(laplacian.stiffness)
    off = entries.row != entries.col
    rows, columns, weights = entries.row[off], entries.col[off], -entries.data[off]
    relative = -weights / (roots[rows] * roots[columns])
    if not relative.size:
        return make_law("nonnegative weights", 0, WEIGHT, "there is no pair of points to weigh.")
    worst = int(relative.argmax())
    explanation = f"the lowest weight, {weights[worst]:.3g}, is that of points {rows[worst]} and {columns[worst]}."
    return make_law("nonnegative weights", max(relative[worst], 0.0), WEIGHT, explanation)
