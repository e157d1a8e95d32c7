"""Random points of two shapes, matched one to one, and what their graph Laplacians hear at several heat times."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from eigenshape._arrays import frozen
from eigenshape._progress import Progress
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.quadrature import uniform_quadrature
from eigenshape.geometry.surface_points import sample_surface
from eigenshape.operators.kernel import (
    KernelOptions,
    choose_kernel,
    kernel_laplacian,
    neighbor_distance,
    require_whole,
)
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.neighbors import neighbor_graph
from eigenshape.spectral.comparison.angles import EigenspaceAngles, eigenspace_angles
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum
from eigenshape.stability.bounds import TimeRange, weyl_bound
from eigenshape.stability.correspondence import BottleneckMatching, bottleneck_matching
from eigenshape.stability.rates import theorem_rate

N_TIMES = 4
DENSER = 20  # times as many points to measure distances to, as are matched
ABOVE_SAMPLING = (
    2.0  # a change that is so much more than that of two samples of one shape is the shapes'
)

Points = Float[np.ndarray, "n d"]


@dataclass(frozen=True)
class ChangeAtTime:
    """How far the graph Laplacians of samples of two shapes are apart at one heat time.

    Shares are of the last eigenvalue of the first shape's sample.

    Attributes
    ----------
    t : float
        Heat time, in length².
    change : float
        Largest |λ_i - ω_i|, as a share.
    floor : float
        The same between two samples of the first shape: what sampling alone does.
    weyl : float
        ‖L_P - L_Q‖₂ of the matched points, as a share: no eigenvalue can change by more.
    bound : float
        What theory allows for points so far apart (`theorem_rate("lipschitz")`), as a share.
    trusted : bool
        Whether the time lies in the range that can be trusted.
    """

    t: float
    change: float
    floor: float
    weyl: float
    bound: float
    trusted: bool

    @property
    def significant(self) -> bool:
        """Whether the change stands out from what sampling does."""
        return self.change > ABOVE_SAMPLING * self.floor


@dataclass(frozen=True, eq=False)
class Samples:
    """Random points of two shapes of dimension m.

    Attributes
    ----------
    one, two, again : (n, d) float
        Of the first shape, of the second, and others of the first.
    matched, floor : BottleneckMatching
        From `one` to `two`, and from `one` to `again`.
    dim : int
    """

    one: Points
    two: Points
    again: Points
    matched: BottleneckMatching
    floor: BottleneckMatching
    dim: int


def matched_samples(one: Shape, two: Shape, n: int, rng: np.random.Generator) -> Samples:
    """Throw n points on each of two shapes, 2n on the first, and match them one to one."""
    both, other = _thrown(one, 2 * n, rng), _thrown(two, n, rng)
    first, again = both[:n], both[n:]
    matched, floor = bottleneck_matching(first, other), bottleneck_matching(first, again)
    return Samples(first, other, again, matched, floor, one.dim)


def _thrown(shape: Shape, n: int, rng: np.random.Generator) -> Points:
    if isinstance(shape, PointCloud):
        return shape.points[rng.choice(len(shape.points), n, replace=False)]
    return sample_surface(shape, n, rng=rng).points


def distances_between(
    one: Shape, two: Shape, n: int, rng: np.random.Generator
) -> tuple[Float[np.ndarray, " n1"], Float[np.ndarray, " n2"]]:
    """Return how far each point of each shape is from the other, of which n points a match are known beside its own."""
    clouds = [_dense(shape, DENSER * n, rng) for shape in (one, two)]
    pairs = zip((one, two), clouds[::-1], strict=True)
    first, second = (frozen(cKDTree(cloud).query(shape.points)[0]) for shape, cloud in pairs)
    return first, second


def _dense(shape: Shape, n: int, rng: np.random.Generator) -> Points:
    if isinstance(shape, PointCloud):
        return shape.points
    return np.vstack([shape.points, sample_surface(shape, n, rng=rng).points])


def spaced_times(times: TimeRange) -> tuple[float, ...]:
    """Return heat times over the range that can be trusted; where that is empty, over what at least can be computed."""
    low = times.reach if times.empty else times.low
    return tuple(np.geomspace(low, times.high, N_TIMES).tolist()) if low < times.high else (low,)


def changes_over_times(
    samples: Samples, k: int, asked: tuple[float, ...], trusted: TimeRange, progress: Progress
) -> tuple[tuple[ChangeAtTime, ...], EigenspaceAngles]:
    """Return what changes at each heat time, and how far eigenspaces turn at the one in the middle."""
    changes = []
    pieces = [
        (points, _pieces(points, samples.dim))
        for points in (samples.one, samples.two, samples.again)
    ]
    for place, t in enumerate(asked):
        progress(place / len(asked), f"heat time {t:.3g}")
        laplacians = [_whole(points, t, samples.dim, labels) for points, labels in pieces]
        spectra = [solve_spectrum(laplacian, k) for laplacian in laplacians]
        changes.append(_change(samples, laplacians, spectra, t, trusted))
        if place == len(asked) // 2:
            angles = eigenspace_angles(
                *spectra[:2], points=samples.matched.partners, laplacian=laplacians[0]
            )
    return tuple(changes), angles


def _whole(points: Points, t: float, dim: int, labels: Int[np.ndarray, " n"]) -> Laplacian:
    """Build `gaussian_laplacian`, which must hold together what has one label, without its kernel.

    Nobody is warned of heat times that do not serve: `ChangeAtTime.trusted` tells. (To silence
    warnings would silence those of other threads too.)
    """
    measure = uniform_quadrature(points, dim)
    kernel = choose_kernel(KernelOptions(t=t), neighbor_distance(measure.points, dim))
    laplacian = kernel_laplacian(measure, kernel)
    require_whole(laplacian, labels, kernel)
    return replace(laplacian, kernel=None)


def _pieces(points: Points, dim: int) -> Int[np.ndarray, " n"]:
    """Label the points that nearest neighbours hold together."""
    joined = neighbor_graph(points, min(dim * (dim + 1), len(points) - 1))
    return connected_components(joined, directed=False)[1]


def _change(
    samples: Samples,
    laplacians: list[Laplacian],
    spectra: list[Spectrum],
    t: float,
    trusted: TimeRange,
) -> ChangeAtTime:
    values = [spectrum.eigenvalues for spectrum in spectra]
    last = float(values[0][-1])
    moved = samples.matched
    return ChangeAtTime(
        t=t,
        change=float(np.abs(values[1] - values[0]).max()) / last,
        floor=float(np.abs(values[2] - values[0]).max()) / last,
        weyl=weyl_bound(laplacians[0], laplacians[1], moved.partners).norm / last,
        bound=float(theorem_rate("lipschitz", samples.dim).at(moved.distance, t)) / last,
        trusted=trusted.low <= t <= trusted.high,
    )
