"""Compare two shapes: their closeness, their spectra, and the heat times that are reliable."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, positive_values, record, whole_number, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.samples.surface_points import sample_surface
from eigenshape.operators.catalog import build_laplacian
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.comparison.angles import EigenspaceAngles, eigenspace_angles
from eigenshape.spectral.comparison.eigenvalues import SpectrumComparison, compare_spectra
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.stability.bounds import TimeRange, admissible_times
from eigenshape.stability.closeness import Closeness, measure_closeness
from eigenshape.stability.perturbation import measure_perturbation
from eigenshape.stability.plan import USUAL_K, StabilityPlan
from eigenshape.stability.sampled import (
    ChangeAtTime,
    changes_over_times,
    matched_samples,
)

# Fewest matched points: the fewer points, the larger the effect of sampling.
FEWEST_SAMPLES = 100
# Heat times over the admissible range. Each costs three solves.
N_TIMES = 4
# Points of a shape to which distances are measured, as a multiple of the matched points. More of
# them lower the distance of points to the surface that sampling adds.
DENSER = 20
# Most matched points: memory of the kernels and of the matching grows faster than their number.
MOST_SAMPLES = 20_000


@record
class StabilityReport(ReadOnly):
    """Result of `compare_shapes`.

    Attributes
    ----------
    spectra : SpectrumComparison
        Spectra of the shapes, by the usual operator of each (`build_laplacian`).
    closeness : Closeness or None
        Closeness of the map from vertex to vertex; None if the vertices do not correspond.
    distance : float
        Hausdorff distance of the shapes in space, in length.
    matching_distance, sampling_distance : float
        Largest distance of partners in the bottleneck matching of samples of both shapes, and of
        two samples of the first shape, in length.
    delta : float
        Closeness that determines the admissible heat times, in length: the largest displacement of
        a vertex, or `distance` if the vertices do not correspond.
    times : TimeRange
        The admissible heat times.
    changes : tuple of ChangeAtTime
        Changes of the eigenvalues of graph Laplacians, one entry per heat time.
    angles : EigenspaceAngles
        Angles of eigenspaces, from vertex to vertex if the vertices correspond, and between the
        matched samples otherwise.
    n_samples : int
        Number of random points of each shape.
    distances : ((n1,), (n2,)) float
        Distance of each point of each shape to the other shape, in length.

    See Also
    --------
    compare_shapes : Compute a report.

    Examples
    --------
    A noisy copy of a sphere:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> noise = np.random.default_rng(0).normal(scale=0.01, size=ball.vertices.shape)
    >>> noisy = es.TriangleMesh(ball.vertices + noise, ball.faces)
    >>> plan = es.stability.StabilityPlan(k=6, n_samples=300)
    >>> report = es.compare_shapes(ball, noisy, plan)
    >>> bool(report.delta == np.linalg.norm(noise, axis=1).max())  # the vertices correspond
    True
    >>> report.times.low < report.times.high  # some heat times are reliable
    True

    `print(report.explain())` describes all of it in words.
    """

    spectra: SpectrumComparison
    closeness: Closeness | None
    distance: float
    matching_distance: float
    sampling_distance: float
    delta: float
    times: TimeRange
    changes: tuple[ChangeAtTime, ...]
    angles: EigenspaceAngles
    n_samples: int
    distances: tuple[Float[np.ndarray, " n1"], Float[np.ndarray, " n2"]]

    def explain(self) -> str:
        """Describe the results in plain words, in one paragraph each."""
        lines = [
            self.spectra.explain(),
            f"In space, each point of one shape is within {self.distance:.3g} of the other. The "
            f"best one-to-one correspondence of {self.n_samples} random points of each moves them "
            f"by up to {self.matching_distance:.3g}; for two such samples of the first shape it is "
            f"{self.sampling_distance:.3g}.",
        ]
        where = f"between {self.n_samples} matched points of each"
        if self.closeness:
            lines.append(self.closeness.explain())
            where = "from vertex to vertex"
        lines.append(self.times.explain())
        significant = [change for change in self.changes if change.significant]
        if significant:
            clearest = max(significant, key=lambda change: change.change / change.floor)
            lines.append(
                "Graph Laplacians of such samples distinguish the shapes at "
                f"{len(significant)} of {len(self.changes)} heat times, most clearly at "
                f"t = {clearest.t:.3g}: eigenvalues change by up to {clearest.change:.3g} of the "
                f"last, the eigenvalues of two samples of the first shape by {clearest.floor:.3g}, and "
                f"Weyl's bound is {clearest.weyl:.3g}."
            )
        else:
            lines.append(
                "Graph Laplacians of such samples do not distinguish the shapes at any heat time: "
                "sampling alone changes them as much."
            )
        lines.append(f"Eigenspaces, {where}: {self.angles.explain()}")
        if not self.closeness and self.times.low_reason == "closeness":
            lines.append(
                "Points were matched by their places in space, which says little about one shape "
                "in two poses or places. Pass the map between the vertices (`partners`, or --map on the "
                "command line), or compare eigenvalues only."
            )
        return "\n\n".join(lines)


def compare_shapes(
    one: ShapeLike,
    two: ShapeLike,
    plan: StabilityPlan | None = None,
    *,
    partners: ArrayLike | None = None,
    progress: Progress | None = None,
) -> StabilityReport:
    """Compare two shapes by closeness, spectra and graph Laplacians (thesis chapters 3 and 4).

    The shapes are compared in their given places and units; neither is moved or scaled. Meshes with
    the same simplices correspond vertex by vertex. Other meshes correspond by `partners`, if it is
    given. Random points of both shapes are matched one to one, as in Theorem 4.2.1.

    Parameters
    ----------
    one, two : ShapeLike
        Two shapes of the same dimension, in the same space.
    plan : StabilityPlan, optional
        Number of eigenvalues, of samples, heat times and seed.
    partners : (n1,) int, optional
        For each point of the first mesh, the corresponding point of the second; for instance the
        result of `eigenshape.matching.match_shapes`.
    progress : callable, optional
        Called as ``progress(fraction_done, message)``.

    Returns
    -------
    StabilityReport

    Raises
    ------
    InvalidParameterError
        If the shapes differ in dimension or space, an option is out of range, `partners` has
        another length, or `partners` or brackets are requested for a point cloud.
    InvalidShapeError
        If an operator cannot be built; see `build_laplacian`.
    ConvergenceError
        If a spectrum cannot be proved complete.

    See Also
    --------
    measure_closeness : Closeness of a mesh and its image.
    theorem_rate : Rates of change that theorems prove.

    Examples
    --------
    A sphere and an ellipsoid that is 5 % longer:

    >>> import eigenshape as es
    >>> sphere = es.icosphere(3)
    >>> ellipsoid = es.TriangleMesh(sphere.vertices * [1, 1, 1.05], sphere.faces)
    >>> plan = es.stability.StabilityPlan(k=6, n_samples=200)
    >>> report = es.compare_shapes(sphere, ellipsoid, plan)
    >>> round(report.delta, 3)
    0.05
    >>> report.closeness.limited_by
    'Jacobian'
    """
    one = as_shape(one, "one")
    two = as_shape(two, "two")
    require_type(plan, StabilityPlan | None, "plan")
    chosen = plan or StabilityPlan()
    report_progress = progress or silent
    meshes, images = None, None
    if not isinstance(one, PointCloud) and not isinstance(two, PointCloud):
        meshes = one, two
    elif chosen.brackets or partners is not None:
        raise InvalidParameterError(
            f"brackets and partners are for meshes; the shapes are {one!r} and {two!r}."
        )
    n_samples, k = _check_plan(chosen, one, two)
    # The point of the second mesh for each point of the first; None if unknown.
    if partners is not None:
        images = whole_numbers(partners, "partners", 0, two.n_points - 1)
        if len(images) != one.n_points:
            raise InvalidParameterError(
                "partners must have one entry per point of the first mesh; "
                f"there are {len(images)} for {one.n_points}."
            )
    elif meshes and np.array_equal(meshes[0].simplices, meshes[1].simplices):
        images = np.arange(one.n_points) if one.n_points == two.n_points else None
    report_progress(0.0, "spectra")
    laplacians = [build_laplacian(shape) for shape in (one, two)]
    spectra = [solve_spectrum(laplacian, k) for laplacian in laplacians]
    brackets = None
    if meshes and chosen.brackets:
        brackets = (bracket_eigenvalues(meshes[0], k), bracket_eigenvalues(meshes[1], k))
    report_progress(0.3, "matching points")
    rng = np.random.default_rng(chosen.seed)
    samples = matched_samples(one, two, n_samples, rng)
    # The distance of each point of each shape to the other; a mesh is represented by its vertices
    # and random points.
    first, second = (
        shape.points
        if isinstance(shape, PointCloud)
        else np.vstack([shape.points, sample_surface(shape, DENSER * n_samples, rng=rng).points])
        for shape in (one, two)
    )
    distances = (cKDTree(second).query(one.points)[0], cKDTree(first).query(two.points)[0])
    distance = float(max(each.max() for each in distances))
    closeness = None
    if meshes is not None and images is not None:
        mesh = meshes[0]
        image = type(mesh)(two.points[images], mesh.simplices)
        closeness = measure_closeness(measure_perturbation(mesh, image))
    delta = float(closeness.displacement.max()) if closeness else distance
    spacing = max(
        neighbor_distance(points, one.dim) for points in (samples.one, samples.two, samples.again)
    )
    times = admissible_times(
        delta=delta, spacing=spacing, eigenvalue=float(spectra[0].eigenvalues[-1])
    )
    # Heat times over the admissible range; if it is empty, over the computable one.
    low = times.reach if times.empty else times.low
    spread = np.geomspace(low, times.high, N_TIMES).tolist() if low < times.high else [low]
    changes, angles = changes_over_times(
        samples,
        k,
        chosen.times or tuple(spread),
        times,
        lambda share, what: report_progress(0.5 + share / 2, what),
    )
    if images is not None:
        angles = eigenspace_angles(*spectra, points=images, laplacian=laplacians[0])
    report_progress(1.0, "compared")
    return StabilityReport(
        spectra=compare_spectra(*spectra, brackets=brackets),
        closeness=closeness,
        distance=distance,
        matching_distance=samples.matching.distance,
        sampling_distance=samples.resampling.distance,
        delta=delta,
        times=times,
        changes=changes,
        angles=angles,
        n_samples=n_samples,
        distances=distances,
    )


def _check_plan(plan: StabilityPlan, one: Shape, two: Shape) -> tuple[int, int]:
    """Check the options; return the number of samples and the number of eigenvalues."""
    kinds = [(shape.dim, shape.points.shape[1]) for shape in (one, two)]
    if kinds[0] != kinds[1]:
        dims = " and ".join(f"{dim} in R^{d}" for dim, d in kinds)
        raise InvalidParameterError(
            f"Shapes must have the same dimension, in the same space; theirs are {dims}."
        )
    if plan.times:
        positive_values(np.array(plan.times), "times")
    clouds = [shape for shape in (one, two) if isinstance(shape, PointCloud)]
    wanted = whole_number(plan.n_samples, "n_samples", FEWEST_SAMPLES, MOST_SAMPLES)
    # Two samples of one cloud must be disjoint, so that their difference is that of sampling.
    n_samples = min([wanted, *(len(cloud.points) // 2 for cloud in clouds)])
    if n_samples < FEWEST_SAMPLES:
        smallest = min(clouds, key=lambda cloud: len(cloud.points))
        raise InvalidParameterError(
            f"A point cloud must have at least {2 * FEWEST_SAMPLES} points, because it is halved; "
            f"it is {smallest!r}."
        )
    most = min(n_samples, len(one.points), len(two.points)) - 1
    k = min(USUAL_K, max(most, 2)) if plan.k is None else plan.k
    return n_samples, whole_number(k, "k", 2, most)
