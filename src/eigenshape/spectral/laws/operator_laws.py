"""What must hold between the operators of one shape told in different ways."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any, TypeAlias, get_args

import numpy as np
import scipy.sparse as sp

from certeig.kit.arguments import require_type
from certeig.kit.arrays import record
from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.laws import transformations as changes
from eigenshape.spectral.laws.agreement import (
    MOST_ROUNDING,
    distance,
    lowest_eigenvalues,
    matrices,
    permute,
    same_eigenvalues,
    same_entries,
    spectral_distance,
)
from eigenshape.spectral.laws.laplacian_laws import check_laplacian
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
from eigenshape.spectral.laws.transformations import Subject
from eigenshape.spectral.spectrum import Spectrum

Build: TypeAlias = Callable[[Any], Laplacian]

# Powers of two near 1e±100, 1e±50 and 1e±20, which round no coordinate; the first for which W and B
# stay floats serves.
DOUBLINGS = (332, 166, 66)
# Powers of two that W and B may grow by: floats end at 2^1023.
LARGEST_EXPONENT = 900
# Tolerance at least, of √(W_ii W_jj).
LEAST_ROUNDING = 1e-12
# Perturbations of the coordinates by which rounding is measured.
JIGGLES = 3
# over what jiggles by rounding change: an entry takes ten roundings or more, that may all go one
# way
HEADROOM = 32


@record
class Trial:
    """An operator under trial: how it is made, of what, and how much rounding alone may change it.

    Attributes
    ----------
    build : callable
    subject : Shape or adjacency
    laplacian : Laplacian
        What `build` makes of `subject`.
    rng : Generator
    spectrum : Spectrum, optional
        Its lowest eigenvalues, where rows are not points and are compared by these.
    by_points : bool
        Whether row i is point i.
    rounding : float
        What rounding may change, of √(W_ii W_jj) or of the last of the lowest eigenvalues.
    """

    build: Build
    subject: Subject
    laplacian: Laplacian
    rng: np.random.Generator
    spectrum: Spectrum | None
    by_points: bool
    rounding: float

    @property
    def tolerance(self) -> float:
        """Largest change that a law accepts if it leaves coordinates and corners as they are."""
        return min(self.rounding, MOST_ROUNDING)


def check_operator(
    build: Build,
    shape: ShapeLike | sp.sparray,
    *,
    promises: Iterable[Promise] = DEFAULT_PROMISES,
    by_points: bool | None = None,
    rng: np.random.Generator | None = None,
) -> OperatorReport:
    """Check the laws that a Laplace operator must obey, by building it on transformed copies of a shape.

    The matrices are checked as in `es.spectral.check_laplacian`. Then the operator is built again
    on transformed copies of the shape (moved, scaled, renumbered, ...) and compared entry by entry,
    relative to √(W_ii W_jj) and √(B_ii B_jj). If rows are not points (elements of higher order, a
    boundary condition, vectors), the 20 lowest eigenvalues are compared instead.

    Rounding changes entries more if simplices are thin. The tolerance is 32 times the largest
    change under three random perturbations of the coordinates by their rounding, and at least
    1e-12. If it is above 1e-4, laws that round coordinates anew are skipped.

    Parameters
    ----------
    build : callable
        Maps a shape to a `Laplacian`. A scale parameter must be chosen inside, as a multiple of a
        length of the shape.
    shape : ShapeLike or (n, n) sparse
        A mesh, a point cloud, or the adjacency matrix of a graph.
    promises : iterable of str
        Laws to check, those of `es.spectral.check_laplacian` and these. "rigid_motion": a rotated
        and translated shape has the same operator. "reflection": so has its mirror image.
        "orientation": so has the mesh with some simplices reversed. "scaling": at 1e±100 times the
        size W and B change by one factor each, and eigenvalues by 1/length² (on a graph, whose
        weights are scaled, by any factor). "union": a shape with a distant copy has the operator
        twice, as blocks. Two laws are always checked: building twice gives the same bits, and the
        order of points and simplices does not matter.
    by_points : bool, optional
        Whether row i of the operator is point i of the shape. The default is True if the operator
        has as many rows as the shape has points.
    rng : Generator, optional
        Source of the random transformations. The default is the same at each call.

    Returns
    -------
    OperatorReport

    Raises
    ------
    InvalidParameterError
        If a promise is unknown, `build` is not callable, or it does not return a `Laplacian`.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(1)
    >>> es.check_operator(es.cotangent_laplacian, ball).passed
    True

    An operator that depends on the position of the shape:

    >>> def build(mesh):
    ...     laplacian = es.cotangent_laplacian(mesh)
    ...     return es.Laplacian(laplacian.stiffness * mesh.points[:, 0].max(), laplacian.mass)
    >>> report = es.check_operator(build, es.icosphere(1))
    >>> [law.name for law in report.laws if law.name == "rigid motion" and not law.holds]
    ['rigid motion']
    """
    require_type(rng, np.random.Generator | None, "rng")
    promised = check_promises(promises)
    if not callable(build):
        raise InvalidParameterError(
            "build must be a function that maps a shape to a Laplacian, such as "
            f"es.cotangent_laplacian; it is a {type(build).__name__}. "
            "es.spectral.check_laplacian checks a Laplacian."
        )
    random = rng or np.random.default_rng(0)
    subject = changes.as_subject(shape)
    laplacian = build(subject)
    if not isinstance(laplacian, Laplacian):
        raise InvalidParameterError(
            f"build must return a Laplacian; it returned a {type(laplacian).__name__}."
        )
    report = check_laplacian(laplacian, subject, promises=promised)
    rows_are_points = laplacian.n_points == _n_points(subject) if by_points is None else by_points
    spectrum = None
    if not rows_are_points:
        with suppress(CerteigError):  # laws that need it are not judged, and say so
            spectrum = lowest_eigenvalues(laplacian)
    rounding = _rounding(build, subject, spectrum or laplacian, random)
    trial = Trial(build, subject, laplacian, random, spectrum, rows_are_points, rounding)
    return make_report([*report.laws, *report.skipped, *_rebuilding_laws(trial, promised)])


def _rounding(
    build: Build, subject: Subject, expected: Laplacian | Spectrum, rng: np.random.Generator
) -> float:
    if isinstance(subject, sp.csr_array):
        return LEAST_ROUNDING
    largest = 0.0
    try:
        for other in [build(changes.jiggle(subject, rng)) for _ in range(JIGGLES)]:
            change = 0.0
            if not isinstance(expected, Laplacian):
                found = lowest_eigenvalues(other, len(expected.eigenvalues))
                change, _ = spectral_distance(expected.eigenvalues, found.eigenvalues)
            elif expected.n_points == other.n_points:
                change, _ = distance(expected, other)
            largest = max(largest, change)
    except (CerteigError, ValueError, ArithmeticError):
        return LEAST_ROUNDING  # the laws that change coordinates will find the refusal
    return max(LEAST_ROUNDING, HEADROOM * largest)


def _rebuilding_laws(trial: Trial, promised: frozenset[Promise]) -> Iterator[Outcome]:
    laws: dict[str, Callable[[str, Trial], Outcome]] = {
        "repetition": _repetition,
        "point order": _point_order,
        "simplex order": _same_operator,
        "rigid motion": _same_operator,
        "reflection": _same_operator,
        "orientation": _same_operator,
        "scaling": _scaling,
        "union": _union,
    }
    for name, law in laws.items():
        promise = name.replace(" ", "_")
        if promise in get_args(Promise.__value__) and promise not in promised:
            yield SkippedLaw(name, "not promised")
            continue
        try:
            outcome = law(name, trial)
        except (CerteigError, ValueError, ArithmeticError) as err:
            # An operator that refuses the shape told otherwise breaks the law.
            refusal = f"told otherwise, the shape or its spectrum is refused: {err}"
            outcome = Law(name, False, np.inf, trial.tolerance, refusal)
        yield outcome


def _repetition(name: str, trial: Trial) -> Outcome:
    again = trial.build(trial.subject)
    pairs = [(again.stiffness, trial.laplacian.stiffness), (again.mass, trial.laplacian.mass)]
    n_changed = sum(
        (one != two).nnz if one.shape == two.shape else max(one.nnz, two.nnz) for one, two in pairs
    )
    return make_law(name, n_changed, 0, f"built twice, {n_changed} entries differ.")


def _point_order(name: str, trial: Trial) -> Outcome:
    old_of_new = trial.rng.permutation(_n_points(trial.subject))
    other = trial.build(changes.renumber(trial.subject, old_of_new))
    expected = permute(trial.laplacian, old_of_new) if trial.by_points else None
    return _agree(name, trial, other, expected)


def _same_operator(name: str, trial: Trial) -> Outcome:
    """Compare with the operator of the same points; rows that are not points may have changed places, or frames."""
    subject, rng = trial.subject, trial.rng
    other: Subject
    if name in ("simplex order", "orientation"):
        if isinstance(subject, PointCloud | sp.csr_array):
            return SkippedLaw(name, "the shape has no simplices")
        change = changes.reorder if name == "simplex order" else changes.turn_over
        other = change(subject, rng)
    elif isinstance(subject, sp.csr_array):
        return SkippedLaw(name, "a graph lies nowhere")
    elif name == "rigid motion":
        other = changes.move(subject, rng)
    else:
        other = changes.mirror(subject)
    if trial.rounding > MOST_ROUNDING:
        return _too_rough(name, trial.rounding)
    return _agree(name, trial, trial.build(other), trial.laplacian)


def _scaling(name: str, trial: Trial) -> Outcome:
    # How W and B grow with the shape says how far it may.
    few = 20
    traces = [
        _unit_traces(trial.build(changes.rescale(trial.subject, 2.0**power)))[2:]
        for power in (0, few)
    ]
    growth = max(np.abs(np.log2(traces[1]) - np.log2(traces[0]))) / few
    doublings = next((power for power in DOUBLINGS if growth * power <= LARGEST_EXPONENT), few)
    laws = [_scaling_by(name, trial, power) for power in (doublings, -doublings)]
    return next((law for law in laws if not law.holds), max(laws, key=lambda law: law.measured))


def _scaling_by(name: str, trial: Trial, power: int) -> Law:
    """Compare W and B after division by their traces, and the ratio of the traces with 1/length²."""
    other = trial.build(changes.rescale(trial.subject, 2.0**power))
    here, there = _unit_traces(trial.laplacian), _unit_traces(other)
    law = same_entries(
        name, Laplacian(there[0], there[1]), Laplacian(here[0], here[1]), trial.tolerance
    )
    unit = f"in a unit 2^{power} (1e{power * np.log10(2):+.0f}) times as large,"
    if not law.holds or isinstance(trial.subject, sp.csr_array):
        return make_law(name, law.measured, law.allowed, f"{unit} {law.explanation}")
    ratio = (there[2] / here[2]) / (there[3] / here[3]) * 2.0**power * 2.0**power
    explanation = f"{unit} W and B change by one factor each, and eigenvalues times length² by {abs(ratio - 1):.1e}."
    return make_law(name, max(law.measured, abs(ratio - 1)), law.allowed, explanation)


def _unit_traces(laplacian: Laplacian) -> tuple[sp.csr_array, sp.csr_array, float, float]:
    stiffness, mass = laplacian.stiffness, laplacian.mass
    traces = [float(np.abs(matrix.diagonal()).sum()) or 1.0 for matrix in (stiffness, mass)]
    return stiffness / traces[0], mass / traces[1], traces[0], traces[1]


def _union(name: str, trial: Trial) -> Outcome:
    other = trial.build(changes.double(trial.subject))
    rounding = trial.rounding
    if not isinstance(trial.subject, sp.csr_array):
        # The coordinates of a copy that far away are so many times coarser.
        rounding *= changes.APART
    if rounding > MOST_ROUNDING:
        return _too_rough(name, rounding)
    if trial.by_points:
        twice = Laplacian(
            *(sp.csr_array(sp.block_diag([matrix, matrix])) for matrix in matrices(trial.laplacian))
        )
        return same_entries(name, other, twice, rounding)
    if trial.spectrum is None:
        return _no_spectrum(name)
    return same_eigenvalues(name, other, trial.spectrum, rounding, copies=2)


def _too_rough(name: str, rounding: float) -> SkippedLaw:
    return SkippedLaw(
        name,
        f"rounding of coordinates may change W by {rounding:.0e}: simplices are thin, or the operator is unstable",
    )


def _no_spectrum(name: str) -> SkippedLaw:
    return SkippedLaw(name, "rows are no points, and the lowest eigenvalues cannot be proved")


def _agree(name: str, trial: Trial, found: Laplacian, expected: Laplacian | None) -> Outcome:
    if trial.by_points and expected is not None:
        return same_entries(name, found, expected, trial.tolerance)
    if trial.spectrum is None:
        return _no_spectrum(name)
    return same_eigenvalues(name, found, trial.spectrum, trial.tolerance)


def _n_points(subject: Subject) -> int:
    return int(subject.shape[0]) if isinstance(subject, sp.csr_array) else subject.n_points
