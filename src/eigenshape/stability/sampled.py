"""Random points of two shapes, matched one to one, and how the spectra of their graphs differ."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import record
from certeig.kit.progress import Progress
from certeig.kit.text import html_repr
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.samples.quadrature import Quadrature
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.samples.surface_points import sample_surface
from eigenshape.operators.clouds.kernel import (
    KernelOptions,
    choose_kernel,
    kernel_laplacian,
    require_whole,
)
from eigenshape.operators.clouds.neighbors import neighbor_graph
from eigenshape.spectral.comparison.angles import EigenspaceAngles, eigenspace_angles
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.stability.bounds import TimeRange, weyl_bound
from eigenshape.stability.correspondence import BottleneckMatching, bottleneck_matching
from eigenshape.stability.rates import theorem_rate

# A change is significant if it exceeds that between two samples of one shape by this factor.
ABOVE_SAMPLING = 2.0

Points = Float[np.ndarray, "n d"]


@dataclass(frozen=True)
class ChangeAtTime:
    """Difference of the graph Laplacians of samples of two shapes at one heat time.

    All numbers but `t` are shares of the last eigenvalue of the first shape's sample.

    Attributes
    ----------
    t : float
        Heat time, in length².
    change : float
        Largest |λ_i - ω_i| between the two shapes.
    floor : float
        Largest |λ_i - ω_i| between two samples of the first shape: the effect of sampling alone.
    weyl : float
        ‖L_P - L_Q‖₂ of the matched points: no eigenvalue can change by more.
    bound : float
        Bound by theory for points at this distance (`theorem_rate("lipschitz")`).
    admissible : bool
        Whether the time is in the admissible range.

    See Also
    --------
    compare_shapes : Compute these changes.

    Examples
    --------
    Whether the spectra of a sphere and an ellipsoid differ by more than random sampling explains:

    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> ellipsoid = es.TriangleMesh(ball.vertices * [1, 1, 1.5], ball.faces)
    >>> plan = es.stability.StabilityPlan(k=6, n_samples=100)
    >>> change = es.compare_shapes(ball, ellipsoid, plan).changes[0]
    >>> change.significant
    True
    >>> change.floor < change.change <= change.weyl
    True
    """

    t: float
    change: float
    floor: float
    weyl: float
    bound: float
    admissible: bool

    _repr_html_ = html_repr

    @property
    def significant(self) -> bool:
        """Whether the change is more than twice the effect of sampling."""
        return self.change > ABOVE_SAMPLING * self.floor


@record
class Samples:
    """Random points of two shapes of dimension m.

    Attributes
    ----------
    one, two, again : (n, d) float
        Points of the first shape, of the second, and further points of the first, in length.
    matching, resampling : BottleneckMatching
        Between `one` and `two`, and between `one` and `again`.
    dim : int
        m.
    """

    one: Points
    two: Points
    again: Points
    matching: BottleneckMatching
    resampling: BottleneckMatching
    dim: int


def matched_samples(one: Shape, two: Shape, n: int, rng: np.random.Generator) -> Samples:
    """Draw 2n points of the first shape and n of the second, and match them one to one."""
    both, other = _draw_points(one, 2 * n, rng), _draw_points(two, n, rng)
    first, again = both[:n], both[n:]
    matching, resampling = bottleneck_matching(first, other), bottleneck_matching(first, again)
    return Samples(first, other, again, matching, resampling, one.dim)


def _draw_points(shape: Shape, n: int, rng: np.random.Generator) -> Points:
    if isinstance(shape, PointCloud):
        return shape.points[rng.choice(len(shape.points), n, replace=False)]
    return sample_surface(shape, n, rng=rng).points


def changes_over_times(
    samples: Samples, k: int, times: tuple[float, ...], admissible: TimeRange, progress: Progress
) -> tuple[tuple[ChangeAtTime, ...], EigenspaceAngles]:
    """Return the changes at each heat time, and the angles of eigenspaces at the middle one."""
    changes = []
    clouds = (samples.one, samples.two, samples.again)
    dim, moved = samples.dim, samples.matching
    pieces = []  # the connected components of the graphs of nearest neighbors
    for points in clouds:
        joined = neighbor_graph(points, min(dim * (dim + 1), len(points) - 1))
        pieces.append(connected_components(joined, directed=False)[1])
    for place, t in enumerate(times):
        progress(place / len(times), f"heat time {t:.3g}")
        laplacians = []
        for points, labels in zip(clouds, pieces, strict=True):
            kernel = choose_kernel(KernelOptions(t=t), neighbor_distance(points, dim))
            laplacian = kernel_laplacian(Quadrature(points, None, dim), kernel)
            require_whole(laplacian, labels, kernel)
            # Without its kernel the solver does not warn about heat times out of range:
            # `ChangeAtTime.admissible` reports them. (A filter of warnings would act on other
            # threads too.)
            laplacians.append(replace(laplacian, kernel=None))
        spectra = [solve_spectrum(laplacian, k) for laplacian in laplacians]
        values = [spectrum.eigenvalues for spectrum in spectra]
        last = float(values[0][-1])
        changes.append(
            ChangeAtTime(
                t=t,
                change=float(np.abs(values[1] - values[0]).max()) / last,
                floor=float(np.abs(values[2] - values[0]).max()) / last,
                weyl=weyl_bound(laplacians[0], laplacians[1], moved.partners).norm / last,
                bound=float(theorem_rate("lipschitz", dim).at(moved.distance, t)) / last,
                admissible=admissible.low <= t <= admissible.high,
            )
        )
        if place == len(times) // 2:
            angles = eigenspace_angles(*spectra[:2], points=moved.partners, laplacian=laplacians[0])
    return tuple(changes), angles
