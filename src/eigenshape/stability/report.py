"""Two shapes side by side: how close they lie, how far their spectra are apart, and which heat times to trust."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_number, whole_numbers
from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress
from eigenshape._typing import ArrayLike
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.catalog import build_laplacian
from eigenshape.operators.kernel import neighbor_distance
from eigenshape.spectral.bounds.brackets import Brackets, bracket_eigenvalues
from eigenshape.spectral.comparison.angles import EigenspaceAngles, eigenspace_angles
from eigenshape.spectral.comparison.spectra import SpectrumComparison, compare_spectra
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.stability.bounds import TimeRange, admissible_times
from eigenshape.stability.closeness import Closeness, map_closeness
from eigenshape.stability.sampled import (
    ChangeAtTime,
    changes_over_times,
    distances_between,
    matched_samples,
    spaced_times,
)

FEWEST_SAMPLES = 100
MOST_SAMPLES = 20_000
USUAL_K = 20


@dataclass(frozen=True)
class StabilityPlan:
    """What a stability report is made of.

    Attributes
    ----------
    k : int, optional
        Eigenvalues to compare; by default 20, or as many as the smaller shape has to compare.
    n_samples : int
        Points to throw on each shape, 100 to 20,000; of a cloud at most half of its points.
    times : sequence of float, optional
        Heat times in length²; by default four over the range that can be trusted.
    seed : int
        Of the random points.
    brackets : bool
        Whether to bound each eigenvalue of both meshes, so that changes are proved of the shapes themselves.
    """

    k: int | None = None
    n_samples: int = 2000
    times: tuple[float, ...] = ()
    seed: int = 0
    brackets: bool = False


@dataclass(frozen=True, eq=False)
class StabilityReport:
    """How stable a spectrum is between two shapes.

    Attributes
    ----------
    spectra : SpectrumComparison
        Of the shapes, by the operator that serves them best.
    closeness : Closeness or None
        Of the map from vertex to vertex, where both meshes have the same simplices.
    distance : float
        Hausdorff distance of the shapes as they lie, in length.
    matched, matched_floor : float
        Longest move of the best one-to-one correspondence of samples of both, and of two samples of the first.
    delta : float
        The closeness that heat times are judged by, in length: how far the map moves points, or else `distance`.
    times : TimeRange
    changes : tuple of ChangeAtTime
    angles : EigenspaceAngles
        From vertex to vertex where both have the same simplices, else between the matched samples.
    n_samples : int
    distances : ((n1,), (n2,)) float
        Of each point of each shape from the other shape, in length.
    """

    spectra: SpectrumComparison
    closeness: Closeness | None
    distance: float
    matched: float
    matched_floor: float
    delta: float
    times: TimeRange
    changes: tuple[ChangeAtTime, ...]
    angles: EigenspaceAngles
    n_samples: int
    distances: tuple[Float[np.ndarray, " n1"], Float[np.ndarray, " n2"]]

    def explain(self) -> str:
        """Say in plain words what was found, a paragraph each."""
        where = (
            "from vertex to vertex"
            if self.closeness
            else f"between {self.n_samples} matched points of each"
        )
        lines = [self.spectra.explain(), self._lie()]
        if self.closeness:
            lines.append(self.closeness.explain())
        lines += [
            self.times.explain(),
            self._heard(),
            f"Eigenspaces, {where}: {self.angles.explain()}",
        ]
        if not self.closeness and self.times.low_reason == "closeness":
            lines.append(
                "Points were matched as the shapes lie. Of one shape in two poses that tells little: bring a map "
                "between their vertices, or look at the eigenvalues alone."
            )
        return "\n\n".join(lines)

    def _lie(self) -> str:
        return (
            f"As they lie, no point of one shape is further than {self.distance:.3g} from the other. The best "
            f"one-to-one correspondence of {self.n_samples} random points of each moves them by up to "
            f"{self.matched:.3g}; two such samples of the first shape alone take {self.matched_floor:.3g}."
        )

    def _heard(self) -> str:
        seen = [change for change in self.changes if change.significant]
        if not seen:
            return "At no heat time do graph Laplacians of such samples tell the shapes apart: sampling does as much."
        worst = max(seen, key=lambda change: change.change / change.floor)
        return (
            f"Graph Laplacians of such samples tell the shapes apart at {len(seen)} of {len(self.changes)} heat times, "
            f"most clearly at t = {worst.t:.3g}: eigenvalues change by up to {worst.change:.3g} of the last, two "
            f"samples of the first shape by {worst.floor:.3g}, and Weyl's bound allows {worst.weyl:.3g}."
        )


def compare_shapes(
    one: ShapeLike,
    two: ShapeLike,
    plan: StabilityPlan | None = None,
    *,
    partners: ArrayLike | None = None,
    progress: Progress | None = None,
) -> StabilityReport:
    """Measure how stable the spectrum is from one shape to another (thesis, chapters 3 and 4).

    The shapes are compared as they lie and in their own unit: neither is moved, nor scaled. Meshes with the same
    simplices correspond vertex by vertex, others by `partners`; for all others random points of both are matched one
    to one, as Theorem 4.2.1 does.

    Parameters
    ----------
    one, two : ShapeLike
        Of one dimension, in one space.
    plan : StabilityPlan, optional
    partners : (n1,) int, optional
        The point of the second mesh on which each point of the first lies.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    StabilityReport

    Raises
    ------
    InvalidParameterError
        If the shapes differ in dimension or space, a number of the plan is not in range, or `partners` are for other
        meshes or for clouds.
    InvalidShapeError
        As the operators say.
    ConvergenceError
        If a spectrum cannot be proved complete.
    """
    one = as_shape(one, "one")
    two = as_shape(two, "two")
    require_type(plan, StabilityPlan | None, "plan")
    chosen = plan or StabilityPlan()
    tell = progress or (lambda share, what: None)
    meshes = _meshes(one, two, chosen, partners)
    n_samples, k = _checked(chosen, one, two)
    told = _partners(*meshes, partners) if meshes else None
    tell(0.0, "spectra")
    laplacians = [build_laplacian(shape) for shape in (one, two)]
    spectra = [solve_spectrum(laplacian, k) for laplacian in laplacians]
    brackets = _brackets(*meshes, k) if meshes and chosen.brackets else None
    tell(0.3, "matching points")
    rng = np.random.default_rng(chosen.seed)
    samples = matched_samples(one, two, n_samples, rng)
    distances = distances_between(one, two, n_samples, rng)
    distance = float(max(each.max() for each in distances))
    closeness = map_closeness(meshes[0], two.points[told]) if meshes and told is not None else None
    delta = float(closeness.displacement.max()) if closeness else distance
    spacing = max(
        neighbor_distance(points, one.dim) for points in (samples.one, samples.two, samples.again)
    )
    times = admissible_times(
        delta=delta, spacing=spacing, eigenvalue=float(spectra[0].eigenvalues[-1])
    )
    changes, angles = changes_over_times(
        samples,
        k,
        chosen.times or spaced_times(times),
        times,
        lambda share, what: tell(0.5 + share / 2, what),
    )
    if told is not None:
        angles = eigenspace_angles(*spectra, points=told, laplacian=laplacians[0])
    tell(1.0, "compared")
    return StabilityReport(
        spectra=compare_spectra(*spectra, brackets=brackets),
        closeness=closeness,
        distance=distance,
        matched=samples.matched.distance,
        matched_floor=samples.floor.distance,
        delta=delta,
        times=times,
        changes=changes,
        angles=angles,
        n_samples=n_samples,
        distances=distances,
    )


def _checked(plan: StabilityPlan, one: Shape, two: Shape) -> tuple[int, int]:
    """Return how many points to throw on each shape, and how many eigenvalues to compare."""
    kinds = [(shape.dim, shape.points.shape[1]) for shape in (one, two)]
    if kinds[0] != kinds[1]:
        said = " and ".join(f"{dim} in R^{d}" for dim, d in kinds)
        raise InvalidParameterError(
            f"Shapes to compare must have one dimension, in one space; theirs are {said}."
        )
    if plan.times:
        positive_values(np.array(plan.times), "times")
    clouds = [shape for shape in (one, two) if isinstance(shape, PointCloud)]
    wanted = whole_number(plan.n_samples, "n_samples", FEWEST_SAMPLES, MOST_SAMPLES)
    n_samples = min([wanted, *(len(cloud.points) // 2 for cloud in clouds)])
    if n_samples < FEWEST_SAMPLES:
        smallest = min(clouds, key=lambda cloud: len(cloud.points))
        raise InvalidParameterError(
            f"A cloud to compare is halved, and takes {2 * FEWEST_SAMPLES} points; it is {smallest!r}."
        )
    most = min(n_samples, len(one.points), len(two.points)) - 1
    k = min(USUAL_K, max(most, 2)) if plan.k is None else plan.k
    return n_samples, whole_number(k, "k", 2, most)


def _meshes(
    one: Shape, two: Shape, plan: StabilityPlan, partners: ArrayLike | None
) -> tuple[Mesh, Mesh] | None:
    if not isinstance(one, PointCloud) and not isinstance(two, PointCloud):
        return one, two
    if plan.brackets or partners is not None:
        raise InvalidParameterError(
            f"brackets and partners are for meshes; the shapes are {one!r} and {two!r}."
        )
    return None


def _partners(one: Mesh, two: Mesh, partners: ArrayLike | None) -> Int[np.ndarray, " n"] | None:
    """Return the point of the second mesh for each of the first, where that is known."""
    n = one.n_points
    if partners is None:
        same = n == two.n_points and np.array_equal(one.simplices, two.simplices)
        return np.arange(n) if same else None
    found = whole_numbers(partners, "partners", 0, two.n_points - 1)
    if len(found) != n:
        raise InvalidParameterError(
            f"partners must be one a point of the first mesh; there are {len(found)} for {n}."
        )
    return found


def _brackets(one: Mesh, two: Mesh, k: int) -> tuple[Brackets, Brackets]:
    return bracket_eigenvalues(one, k), bracket_eigenvalues(two, k)
